"""Motions for a speech of any length, from a trained run."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.features.mel import log_mel
from a2g_jax.features.offset import without_offset
from a2g_jax.features.samples import mono_samples
from a2g_jax.generation.engine import WINDOW, Engine, Rows
from a2g_jax.generation.planting import planted
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_rows import rotations_from_rows
from a2g_jax.io.audio import resampled
from a2g_jax.models.base import Condition
from a2g_jax.models.control_curves import check_ends
from a2g_jax.training.run import Run

Audio = Float[np.ndarray, " N"]
#: Generators of other sampling settings that are kept, with their compiled programs.
_KEPT = 4


@runtime_checkable
class Sampler(Protocol):
    """The interface of plain, pinned and styled generation: different motions for one speech."""

    def stream(self, audio: Audio, samples: int, seed: int = 0) -> Iterator[Motion]:
        """Yield motions; sample k depends on the audio, the run, the seed and k alone."""
        ...


class Generator:
    """Generates motion for any audio with a run; sampling settings are those of ``run.config``.

    Example:
        >>> import a2g_jax
        >>> speech = a2g_jax.talk(2.0, seed=5)  # or a2g_jax.read_audio("speech.wav", 16000)
        >>> generator = a2g_jax.Generator(a2g_jax.demo_run())
        >>> first, second = generator.generate(speech.audio, 2, seed=0, sample_rate=16000)
        >>> first.frames, first.fps, first.skeleton.joints
        (60, 30.0, 22)
        >>> calm = generator.generate(speech.audio, 1, noise_scale=0.5)
    """

    def __init__(self, run: Run, window: int = WINDOW, like: "Generator | None" = None) -> None:
        """
        Args:
            window: frames of one call of a compiled function, a multiple of 128.
            like: a generator of the same run with other sampling settings; compiled functions that serve both are
                shared.

        Raises:
            InputError: the run's model does not generate motion from audio.
        """
        self.run = run
        self.engine: Engine = Engine(run, window, None if like is None else like.engine)
        self._changed: dict[Any, Generator] = {}

    def with_sampling(self, **sampling: Any) -> "Generator":
        """The generator with other sampling settings; calls with equal ones return the same, compiled already.

        Args:
            sampling: settings of the model, such as ``noise_scale=0.7`` or ``temperature=0.8``.

        Raises:
            InputError: a setting that the model does not have or that has no effect, or a value out of range.
        """
        if not sampling:
            return self
        config = self.run.config.with_sampling(**sampling)
        if config.sampling not in self._changed:
            while len(self._changed) >= _KEPT:
                del self._changed[next(iter(self._changed))]
            self._changed[config.sampling] = Generator(replace(self.run, config=config), self.engine.window, self)
        return self._changed[config.sampling]

    def frames(self, audio: Any, sample_rate: int | None = None) -> int:
        """Length of the motion for an audio: its seconds times fps, rounded."""
        return audio_frames(self.run, audio, sample_rate)

    def check(self, audio: Any) -> None:
        """Refuse sampling settings that do not fit an audio, before any work.

        Raises:
            InputError: such as a timeline with times after its end.
        """
        check_ends(self.engine.lines, self.frames(audio), self.run.config.fps)
        if self.engine.model.requested is not None:
            self.engine.model.requested(self.frames(audio))

    def generate(
        self,
        audio: Any,
        samples: int,
        seed: int = 0,
        report: Callable[[int], None] = lambda done: None,
        *,
        sample_rate: int | None = None,
        **given: Any,
    ) -> list[Motion]:
        """Different motions for the same speech.

        Sample k depends on the audio, the run, the seed and k alone, not on how many samples are requested.

        Args:
            audio: (N,), mono: floating-point numbers in -1 to 1, or integers of full scale.
            samples: how many.
            seed: of everything random.
            report: called with the number of samples done.
            sample_rate: of the audio, Hz, which is resampled to the run's; None for the run's own.
            given: further fields of :class:`~a2g_jax.models.base.Condition` that the model uses, as arrays; and
                sampling settings in place of the run's, such as ``noise_scale=0.7`` or ``controls=("energy=0.9",)``.

        Raises:
            InputError: the audio has several channels or is shorter than a frame; conditioning that the model does
                not use, or a setting that it does not have.
        """
        motions = []
        stream = self.stream(audio, samples, seed, sample_rate=sample_rate, **given)
        for number, motion in enumerate(stream, start=1):
            motions.append(motion)
            report(number)
        return motions

    def stream(
        self, audio: Any, samples: int, seed: int = 0, *, sample_rate: int | None = None, **given: Any
    ) -> Iterator[Motion]:
        """Yield the motions of :meth:`generate` one at a time."""
        sampling = {name: given.pop(name) for name in list(given) if _is_setting(name, given[name])}
        if sampling:
            yield from self.with_sampling(**sampling).stream(audio, samples, seed, sample_rate=sample_rate, **given)
            return
        audio = speech_at_rate(self.run, audio, sample_rate)
        if given.get("controls") is None:
            check_ends(self.engine.lines, self.frames(audio), self.run.config.fps)
        features = speech_features(self.run, audio)
        if "waveform" in self.engine.model.condition_fields:
            given.setdefault("waveform", without_offset(audio, self.run.config.mel.sample_rate))
        yield from self.stream_features(features, samples, seed, **given)

    def stream_features(
        self, features: Float[np.ndarray, "T bands"], samples: int, seed: int = 0, **given: Any
    ) -> Iterator[Motion]:
        """Yield the motions of :meth:`stream` for log-mel features, one row a frame, not normalised.

        Raises:
            InputError: the run generates keypoints or directions, which do not move a skeleton; see :meth:`rows`.
        """
        _ = self.run.config.skeleton
        for rows in self.rows(features, samples, seed, **given):
            yield plant_rows(self.run, rows)

    def rows(self, features: Float[np.ndarray, "T bands"], samples: int, seed: int = 0, **given: Any) -> Iterator[Rows]:
        """Yield different motions in the run's pose space, for log-mel features, not normalised."""
        audio: Any = features
        yield from self.engine.rows(Condition(audio, **given), samples, seed)


def _is_setting(name: str, value: Any) -> bool:
    """Whether an argument is a sampling setting: text, or no field of a condition, which are arrays."""
    texts = (value,) if isinstance(value, str) else value
    is_text = isinstance(texts, tuple | list) and all(isinstance(one, str) for one in texts)
    return name not in Condition._fields or is_text


def speech_at_rate(run: Run, audio: Any, sample_rate: int | None) -> Audio:
    """Mono samples at a run's rate.

    Args:
        audio: an array, see :func:`~a2g_jax.features.samples.mono_samples`.
        sample_rate: of the audio, Hz; None for the run's.

    Raises:
        InputError: several channels, NaN, or a rate that is not a positive number.
    """
    samples = mono_samples(audio)
    if sample_rate is None:
        return samples
    if not 1000 <= sample_rate <= 1_000_000:
        raise InputError(f"sample_rate: expected 1000 to 1000000 Hz; got {sample_rate}.")
    if len(samples) == 0:
        return samples
    return resampled(without_offset(samples, int(sample_rate)), int(sample_rate), run.config.mel.sample_rate)


def audio_frames(run: Run, audio: Any, sample_rate: int | None = None) -> int:
    """Length of a run's motion for an audio: its seconds times fps, rounded.

    Raises:
        InputError: the audio has several channels.
    """
    samples = mono_samples(audio)
    if sample_rate is not None:
        samples = speech_at_rate(run, samples, sample_rate)
    return round(len(samples) / run.config.mel.sample_rate * run.config.fps)


def speech_features(run: Run, audio: Any, sample_rate: int | None = None) -> Float[np.ndarray, "T bands"]:
    """Log-mel features of speech at a run's frames, not normalised.

    Args:
        sample_rate: of the audio, Hz; None for the run's.

    Raises:
        InputError: the audio has several channels, or is shorter than a frame.
    """
    audio = speech_at_rate(run, audio, sample_rate)
    frames = audio_frames(run, audio)
    if frames == 0:
        raise InputError(f"the audio is {len(audio)} samples long, less than a frame; give a longer one.")
    return log_mel(audio, run.config.mel, run.config.fps, frames)


def plant_rows(run: Run, rows: Rows) -> Motion:
    """The motion of poses of a run, with a root that plants the feet.

    Raises:
        InputError: the run generates keypoints or directions.
    """
    _ = run.config.skeleton
    return plant_rotations(run, rotations_from_rows(rows, run.config.space.kind))


def plant_rotations(run: Run, rotations: Float[np.ndarray, "T J 3 3"]) -> Motion:
    """The motion of local rotations, with a root that plants the feet as in the run's mean pose, and legs that keep
    standing feet where they are."""
    config = run.config
    mean_pose = config.space.mean_rotations(config.statistics["pose"].mean)
    return planted(rotations, config.skeleton, config.fps, config.statistics["root"].mean, mean_pose)
