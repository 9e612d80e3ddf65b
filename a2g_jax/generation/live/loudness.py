"""The level of active speech as it is so far."""

from collections import deque

import numpy as np
from jaxtyping import Float

#: Length of a block, seconds.
BLOCK = 0.025
#: Time constant of the level, seconds of active speech; the level before any, dB relative to full scale, which counts
#: as a second of speech at first and no longer after some of it.
TIME_CONSTANT, START_DB, START_WEIGHT, START_SECONDS = 10.0, -26.0, 1.0, 2.0
#: Time constants of the loudness of loud blocks, seconds: as it rises, and as it falls.
_RISE, _FALL = 0.1, 10.0
#: Power of the quietest speech that counts as loud.
_LEAST_LOUD = 10**-4.5
#: Power of active blocks: at least this share of the loud ones, and this many times that of the background noise.
_ACTIVE, _ABOVE_NOISE = 10**-2.5, 10.0
#: Seconds of which the quietest block is the background noise.
_NOISE = 5.0
#: Largest gains, dB.
LEAST_GAIN, MOST_GAIN = -30.0, 40.0


class Loudness:
    """The running level of active speech, similar to :func:`~a2g_jax.features.mel.active_level_db`.

    A mean of the power of active blocks of 25 ms, exponentially weighted with a time constant of 10 s of active speech;
    it starts at -26 dB, which two seconds of speech replace. Active are blocks less than 25 dB below the loud ones and
    10 dB above the background noise, the quietest block of the last 5 s that is not digital silence: pauses and steady
    noise do not change the level, however long they are.
    """

    def __init__(self, sample_rate: int) -> None:
        self.size = round(BLOCK * sample_rate)
        self._loud = _LEAST_LOUD
        self._quiet: deque[float] = deque(maxlen=round(_NOISE / BLOCK))
        self._weight = self._power = 0.0
        self._active = 0

    def add(self, block: Float[np.ndarray, " size"]) -> None:
        """Take a block of ``size`` samples into account."""
        power = float(np.mean(np.square(block, dtype=np.float64)))
        if power == 0.0:
            return
        self._quiet.append(power)
        change = BLOCK / (_RISE if power > self._loud else _FALL)
        self._loud = max(self._loud + (power - self._loud) * min(change, 1.0), _LEAST_LOUD)
        if power >= self._loud * _ACTIVE and power >= _ABOVE_NOISE * min(self._quiet):
            stays = float(np.exp(-BLOCK / TIME_CONSTANT))
            self._power, self._weight = self._power * stays + power, self._weight * stays + 1.0
            self._active = min(self._active + 1, round(START_SECONDS / BLOCK))

    @property
    def level_db(self) -> float:
        """dB relative to full scale."""
        start = START_WEIGHT / BLOCK * (1.0 - self._active / round(START_SECONDS / BLOCK))
        power = (self._power + start * 10 ** (START_DB / 10)) / (self._weight + start)
        return float(10 * np.log10(max(power, 1e-20)))

    def gain_db(self, target_db: float) -> float:
        """What brings the level to a target, within bounds."""
        return float(np.clip(target_db - self.level_db, LEAST_GAIN, MOST_GAIN))
