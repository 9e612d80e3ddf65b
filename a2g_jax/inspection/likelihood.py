"""Log-likelihood of a motion given speech, frame by frame, by a trained model: ``a2g inspect RUN --score MOTION``.

Flips, jitter and cuts are far less likely than natural motion. A held pose is not: to stand still for a moment is
likely, and of a frozen stretch only the frame after it stands out. Frozen stretches are found by
:mod:`a2g_jax.inspection.motion_checks`.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.evaluation.likelihood import compiled_log_likelihood, density_of
from a2g_jax.features.mel import log_mel
from a2g_jax.generation.clips import read_on_skeleton
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_track import represent
from a2g_jax.geometry.retarget.onto import face
from a2g_jax.inspection.finding import Finding, Place
from a2g_jax.inspection.report import Report
from a2g_jax.inspection.unlikely import Moment, robust_scale, unlikely_moments
from a2g_jax.io.audio import read_audio
from a2g_jax.training.run import Run, open_run

#: Frames of a window: bounds memory, and one compiled program serves all lengths.
WINDOW = 512
#: Degrees about the vertical by which a motion's heading may differ from that of the run before it is turned: a larger
#: difference is another convention of the forward axis, not a way to stand.
FACING = 30.0
#: Seconds by which a motion may be longer than its speech; frames are rounded.
_SPARE = 0.1
#: Robust standard deviations below the median from which a moment is a warning: a tiny flow of 1500 steps put the worst
#: of two clean minutes 4.7 below, cuts 6 to 9, and flipped wrists and ten degrees of jitter 30 and more.
WARN = 6.0


@dataclass(frozen=True, eq=False)
class MotionLikelihood:
    """The log-likelihood of a motion over time."""

    first: int
    """The first frame with a full pose history; values are of it and all later frames."""
    log_likelihood: Float[np.ndarray, " N"]
    """Log-density of each frame's z-scores given earlier frames and the speech, nats."""
    moments: tuple[Moment, ...]
    """The least likely first."""
    dimensions: int
    """Number of values of a pose that have a density."""
    fps: float
    turned: float = 0.0
    """Degrees about the vertical by which the motion was turned to the heading of the run."""

    @property
    def seconds(self) -> Float[np.ndarray, " N"]:
        """Time of each frame."""
        return (self.first + np.arange(len(self.log_likelihood))) / self.fps

    @property
    def bits_per_dim(self) -> float:
        """Mean negative log-likelihood; lower is more likely."""
        return -float(np.mean(self.log_likelihood)) / (self.dimensions * math.log(2.0))


def motion_likelihood(run: Run, motion: Motion, audio: Float[np.ndarray, " N"]) -> MotionLikelihood:
    """The log-likelihood of a motion given a speech.

    The audio is padded with silence, so that the last frames count too. A long motion is processed in windows; each
    begins one training clip early with a zero hidden state.

    Args:
        motion: on the run's skeleton, at its frame rate.
        audio: mono, at the run's sample rate.

    Raises:
        InputError: a model without a likelihood, or a motion that is too short or longer than the audio.
    """
    config = run.config
    density, model = compiled_log_likelihood(run), config.build()
    dimensions, stride = density_of(config).dimensions, density_of(config).stride
    seconds = len(audio) / config.mel.sample_rate
    if motion.seconds > seconds + max(_SPARE, 1.0 / config.fps):
        raise InputError(
            f"the motion lasts {motion.seconds:.2f} s, but its speech only {seconds:.2f} s; are they of the same take?"
            " Cut the motion."
        )
    before, after, run_in = model.seed_frames, model.lookahead, model.clip_frames
    count = motion.frames - before
    if count < 1:
        raise InputError(f"the motion has {motion.frames} frames; the run needs more than the {before} of its history.")
    features = log_mel(audio, config.mel, config.fps, motion.frames + after)
    rows = np.asarray(config.statistics["audio"].normalise(features), np.float32)
    turned, faced = _facing(run, motion)
    pose, _ = represent(faced, config.space.kind, "the motion")
    # No frame depends on later poses: the padding of the last window changes nothing.
    length = before + run_in + WINDOW + after
    fill = -(-count // WINDOW) * WINDOW + length - len(rows)
    rows = np.pad(rows, ((0, fill), (0, 0)), mode="edge")
    pose = np.pad(pose, ((0, len(rows) - len(pose)), (0, 0), (0, 0)), mode="edge")
    parts, done = [], 0
    while done < count:
        # The poses of a density lie at multiples of its stride, whatever the window.
        start = max(0, done - run_in) // stride * stride
        nats = np.asarray(density(rows[None, start : start + length], pose[None, start : start + length]))[0]
        parts.append(nats[done - start :])
        done += len(parts[-1])
    log_likelihood = np.concatenate(parts)[:count].astype(np.float64)
    moments = tuple(unlikely_moments(log_likelihood, before, faced))
    return MotionLikelihood(before, log_likelihood, moments, dimensions, config.fps, turned)


def _facing(run: Run, motion: Motion) -> tuple[float, Motion]:
    usual = run.config.space.mean_rotations(run.config.statistics["pose"].mean)[0]
    faced, turned = face(motion, np.asarray(usual, np.float64))
    return (turned, faced) if abs(turned) > FACING else (0.0, motion)


def file_likelihood(folder: Path, path: Path, audio: Path) -> MotionLikelihood:
    """The log-likelihood of a motion file: any humanoid BVH, or an NPZ written by this package.

    Raises:
        InputError: a file that cannot be used, or see :func:`motion_likelihood`; the message names the files.
    """
    run = open_run(folder)
    if run.config.build().density is None:
        raise InputError(
            f"{folder}: is a run of {run.config.model}, which has no likelihood of a motion; name one of stylized_flow."
        )
    motion = read_on_skeleton(path, run.config.skeleton, run.config.fps)
    speech = read_audio(audio, run.config.mel.sample_rate)
    try:
        return motion_likelihood(run, motion, speech)
    except InputError as error:
        raise InputError(f"{path}, {audio}: {error}") from None


def likelihood_report(likelihood: MotionLikelihood, path: Path, *, curve: bool = False) -> Report:
    """The report of a log-likelihood.

    Args:
        path: path of the motion.
        curve: whether to add the log-likelihood of every frame, for JSON.
    """
    median, scale = robust_scale(likelihood.log_likelihood)
    facts: dict[str, Any] = {
        "likelihood": {
            "frames": len(likelihood.log_likelihood),
            "from (s)": float(likelihood.seconds[0]),
            "to (s)": float(likelihood.seconds[-1]),
            "mean (nats a frame)": float(np.mean(likelihood.log_likelihood)),
            "median (nats a frame)": median,
            "robust standard deviation": scale,
            "bits per dimension": likelihood.bits_per_dim,
            "dimensions": likelihood.dimensions,
        }
    }
    if likelihood.turned:
        facts["likelihood"]["turned to the heading of the run (degrees)"] = likelihood.turned
    if curve:
        facts["curve"] = {
            "seconds": likelihood.seconds.tolist(),
            "log_likelihood": likelihood.log_likelihood.tolist(),
        }
    return Report(str(path), "likelihood", facts, [_finding(moment, path) for moment in likelihood.moments])


def _finding(moment: Moment, path: Path) -> Finding:
    warn = moment.deviations >= WARN
    joints = f"; largest changes of acceleration: {', '.join(moment.joints)}" if moment.joints else ""
    return Finding(
        "warning" if warn else "info",
        "unlikely",
        f"log-likelihood {moment.log_likelihood:.1f} nats, {moment.deviations:.1f} standard deviations below the"
        f" median{joints}.",
        "Check this moment." if warn else "",
        Place(
            path=str(path),
            joint=moment.joints[0] if moment.joints else "",
            frame=moment.frame,
            seconds=moment.seconds,
        ),
        moment.log_likelihood,
    )
