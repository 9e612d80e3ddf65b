"""Augmentation that makes clean generated speech sound recorded: equaliser, small room, noise and gain."""

import numpy as np
from jaxtyping import Float
from scipy import fft


def _equaliser(
    frequency: Float[np.ndarray, " F"], rng: np.random.Generator, strength_db: float = 4.0
) -> Float[np.ndarray, " F"]:
    """A smooth random gain over frequency: a microphone, a distance, a codec."""
    knots = np.log2([40.0, 120.0, 350.0, 1000.0, 2800.0, 8000.0, 24000.0])
    gains = strength_db * rng.standard_normal(len(knots))
    octave = np.log2(np.maximum(frequency, 20.0))
    return 10.0 ** (np.interp(octave, knots, gains) / 20.0)


def _room_response(sample_rate: int, rng: np.random.Generator) -> Float[np.ndarray, " N"]:
    """Direct sound at sample 0, then noise that decays exponentially (RT60 of 0.12 to 0.45 s)."""
    decay, level = rng.uniform(0.12, 0.45), rng.uniform(-20.0, -6.0)
    time = np.arange(int(decay * sample_rate)) / sample_rate
    tail = rng.standard_normal(len(time)) * np.exp(-np.log(1000.0) * time / decay)
    tail[time < 0.003] = 0.0
    # Energy of the tail relative to the direct sound: near to far microphone.
    tail *= 10.0 ** (level / 20.0) / np.sqrt(np.sum(tail**2))
    tail[0] = 1.0
    return tail


def augment(audio: Float[np.ndarray, " N"], sample_rate: int, rng: np.random.Generator) -> Float[np.ndarray, " N"]:
    """A randomly recorded version of ``audio``: same length, same timing, float32, peak below 1.

    Random equaliser (standard deviation 4 dB), small room (direct-to-reverberant ratio 6 to 20 dB), coloured noise at a
    signal-to-noise ratio of 15 to 40 dB, and gain of +-6 dB.
    """
    # The number of draws of the room and of the noise depends on the samples: each has a stream of its own.
    echoes, hiss = rng.spawn(2)
    response = _room_response(sample_rate, echoes)
    size = fft.next_fast_len(len(audio) + len(response), real=True)
    frequency = fft.rfftfreq(size, 1.0 / sample_rate)
    shape = fft.rfft(response, size) * _equaliser(frequency, rng)
    wet = fft.irfft(fft.rfft(audio, size) * shape, size)[: len(audio)]

    power = float(np.mean(np.square(wet))) + 1e-12
    slope = rng.uniform(0.0, 1.0)  # white to brown-ish
    colour = (np.maximum(frequency, 60.0) / 60.0) ** -slope
    noise = fft.irfft(fft.rfft(hiss.standard_normal(size)) * colour, size)[: len(audio)]
    ratio_db = rng.uniform(15.0, 40.0)
    noise *= np.sqrt(power / np.mean(np.square(noise)) * 10.0 ** (-ratio_db / 10.0))
    recorded = wet + noise

    # Level of the input, then the random gain; never louder than full scale.
    gain = np.sqrt(np.mean(np.square(audio)) / np.mean(np.square(recorded))) if np.any(audio) else 1.0
    gain *= 10.0 ** (rng.uniform(-6.0, 6.0) / 20.0)
    gain = min(gain, 0.98 / max(float(np.max(np.abs(recorded))), 1e-9))
    return (gain * recorded).astype(np.float32)
