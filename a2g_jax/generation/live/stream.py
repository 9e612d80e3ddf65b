"""Live generation: samples of a microphone in, frames of a motion out."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.features.samples import mono_samples
from a2g_jax.generation.live.features import LiveFeatures
from a2g_jax.generation.live.feet import Feet
from a2g_jax.generation.live.poses import PoseProgram, Poses
from a2g_jax.generation.live.rates import check_rate
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_rows import rotations_from_rows
from a2g_jax.training.run import Run

#: Seconds of motion that are generated at a time.
HOP = 0.1


@dataclass(frozen=True)
class Latency:
    """Seconds between a sound and the arrival of the last samples that the frame at its time waits for."""

    model: float
    """Speech after its own frame that the model depends on."""
    features: float
    """Half the window of the spectrum, resampling, and groups of 10 ms."""
    feet: float
    """Smoothing of the root, and footholds."""
    hop: float
    """Frames are generated some at a time; the first of them waits for the last one's samples."""

    @property
    def total(self) -> float:
        """Sum of all, the delay of a player that shows the frames in time with each other."""
        return self.model + self.features + self.feet + self.hop


class Stream:
    """Generates motion for speech while it arrives, in bounded memory.

    The motion does not depend on how the samples are cut into pushes, to the last bit: :func:`stream_offline` gives
    the same from one push of everything. It is not the motion of :class:`~a2g_jax.generation.generator.Generator`,
    which finds out the level and the offset of a recording, and where feet stand, from all of it.

    Example:
        >>> import a2g_jax, numpy as np
        >>> stream = a2g_jax.Stream(a2g_jax.demo_run(), sample_rate=16000)
        >>> stream.warm_up()
        >>> speech, frames = a2g_jax.talk(2.0, seed=5).audio, 0
        >>> for start in range(0, len(speech), 1600):  # as a microphone gives them
        ...     frames += stream.push(speech[start : start + 1600]).frames
        >>> frames + stream.finish().frames
        60
    """

    def __init__(
        self,
        run: Run,
        sample_rate: int | float = 48000,
        seed: int = 0,
        *,
        lookahead: float | None = None,
        hop: float = HOP,
        **sampling: Any,
    ) -> None:
        """
        Args:
            sample_rate: of the samples that are pushed, Hz.
            seed: of everything random.
            lookahead: seconds of speech after its own that a frame waits for; None for all that the model depends on.
                With less, the present sound stands for what has not been said yet: lower latency, and motion that
                follows the speech less closely.
            hop: seconds of motion that are computed at a time; more cost less computing and wait longer.
            sampling: sampling settings of the model in place of those of the run, such as ``temperature=0.8``.

        Raises:
            InputError: a rate that no microphone has, a run that cannot be generated live, or a setting that does not
                fit it.
        """
        if sampling:
            run = replace(run, config=run.config.with_sampling(**sampling))
        if lookahead is not None and not 0 <= lookahead < float("inf"):
            raise InputError(f"lookahead: expected seconds, 0 or more; got {lookahead}.")
        if not 0 < hop < float("inf"):
            raise InputError(f"hop: expected seconds above 0; got {hop}.")
        fps = run.config.fps
        ahead = None if lookahead is None else round(lookahead * fps)
        self.run, self.sample_rate, self._seed = run, check_rate(sample_rate), _seed(seed)
        self._program = PoseProgram(run, max(1, round(hop * fps)), ahead)
        self._start()

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.run.config.fps

    @property
    def latency(self) -> Latency:
        """Algorithmic latency, without the time that computing takes."""
        frame = 1.0 / self.fps
        program = self._program
        return Latency(
            program.lookahead * frame, self._features.latency, self._feet.delay * frame, (program.hop - 1) * frame
        )

    @property
    def lookaheads(self) -> tuple[float, float]:
        """The shortest and the longest look-ahead that the model has, seconds."""
        least, most = self._program.lookaheads
        return least / self.fps, most / self.fps

    def warm_up(self) -> None:
        """Compile everything; the motion is the same without it, but its first frames wait for it."""
        program, features = self._program, LiveFeatures(self.run.config.mel, self.fps, self.sample_rate)
        features.push(np.zeros(self.sample_rate // 4, np.float32))
        window = np.zeros((program.rows, len(features.quiet)), np.float32)
        key, state = program.begin(self._seed)
        for frame in (0, program.hop):
            poses, state = program.advance(key, state, window, frame)
        Feet(self.run.config, program.hop).push(rotations_from_rows(poses, self.run.config.space.kind))

    def restarted(self, seed: int, sample_rate: int | float | None = None) -> "Stream":
        """Another stream from its first frame on, which shares what is compiled with this one.

        Args:
            sample_rate: of its samples, Hz; None for that of this one.

        Raises:
            InputError: a seed out of range, or a rate that no microphone has.
        """
        stream = object.__new__(Stream)
        rate = self.sample_rate if sample_rate is None else check_rate(sample_rate)
        stream.run, stream.sample_rate, stream._seed = self.run, rate, _seed(seed)
        stream._program = self._program
        stream._start()
        return stream

    def push(self, samples: Any) -> Motion:
        """The frames that are complete after further samples; often none, and a few more every tenth of a second.

        Args:
            samples: (N,) of one channel, of any number: floating-point from -1 to 1, or integers of full scale.

        Raises:
            InputError: several channels, NaN, or a stream that is finished; the stream stays as it was.
        """
        if self._finished:
            raise InputError("the stream is finished; start another one, for example stream.restarted(seed=0).")
        array = mono_samples(samples, "samples")
        self._samples += len(array)
        return self._pushed(array)

    def finish(self) -> Motion:
        """The last frames: as if silence followed. In all there are ``round(seconds * fps)`` frames.

        Raises:
            InputError: the stream is finished already.
        """
        if self._finished:
            raise InputError("the stream is finished already; start another one, for example stream.restarted(seed=0).")
        frames = round(self._samples / self.sample_rate * self.fps)
        self._finished, parts = True, [self._empty]
        silence = np.zeros(self.sample_rate // 4, np.float32)
        while self._frames < frames:
            parts.append(self._pushed(silence))
        more = self._frames - frames
        motion = _joined(parts)
        self._frames = frames
        return motion.clip(0, motion.frames - more)

    _samples: int
    _frames: int
    _finished: bool

    def _start(self) -> None:
        config = self.run.config
        self._features = LiveFeatures(config.mel, config.fps, self.sample_rate)
        self._poses = Poses(self._program, self._features.quiet, self._seed)
        self._feet = Feet(config, self._program.hop)
        joints = len(config.skeleton.names)
        empty = np.zeros((0, joints, 3, 3), np.float32), np.zeros((0, 3), np.float32)
        self._empty = Motion(*empty, config.skeleton, config.fps)
        self._samples = self._frames = 0
        self._finished = False

    def _pushed(self, samples: np.ndarray) -> Motion:
        parts = [self._empty]
        for row in self._features.push(samples):
            poses = self._poses.push(row)
            if poses is not None:
                parts.append(self._feet.push(rotations_from_rows(poses, self.run.config.space.kind)))
        motion = _joined(parts)
        self._frames += motion.frames
        return motion


def stream_offline(
    run: Run,
    audio: Any,
    sample_rate: int | float = 48000,
    seed: int = 0,
    *,
    lookahead: float | None = None,
    **sampling: Any,
) -> Motion:
    """The whole motion of a stream for a recording: one push of everything.

    Raises:
        InputError: as :class:`Stream`.
    """
    stream = Stream(run, sample_rate, seed, lookahead=lookahead, **sampling)
    return _joined([stream.push(audio), stream.finish()])


def _seed(seed: int) -> int:
    if isinstance(seed, bool) or not 0 <= seed < 2**32:
        raise InputError(f"seed: expected a whole number from 0 to {2**32 - 1}; got {seed}.")
    return int(seed)


def _joined(parts: list[Motion]) -> Motion:
    rotations = np.concatenate([np.asarray(part.rotations) for part in parts])
    root = np.concatenate([np.asarray(part.root) for part in parts])
    return replace(parts[0], rotations=rotations, root=root)
