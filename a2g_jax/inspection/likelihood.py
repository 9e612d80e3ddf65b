"""How likely a trained model finds a motion for a speech, moment by moment: ``a2g inspect RUN --score MOTION``.

Flips, jitter and cuts are far less likely than anything in a natural motion. A pose that is held is not: to stand still
for a moment is likely, and only the frame in which a frozen stretch lets go stands out. Stretches that stand still are
what :mod:`a2g_jax.inspection.motion_checks` looks for.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.evaluation.likelihood import compiled_score
from a2g_jax.features.mel import log_mel
from a2g_jax.generation.audio2gestures.pins import face, read_on_skeleton
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_space import rotations_from_rows
from a2g_jax.geometry.pose_track import represent
from a2g_jax.inspection.finding import Finding, Place
from a2g_jax.inspection.report import Report
from a2g_jax.inspection.unlikely import Moment, robust_scale, unlikely_moments
from a2g_jax.io.audio import read_audio
from a2g_jax.training.run import Run, open_run

#: Frames that are scored at once: bounds memory, and nothing compiles anew for a new length.
WINDOW = 512
#: Degrees about the vertical by which a motion may face elsewhere than the run's do before it is turned: beyond how
#: people stand, it is the recording's own idea of which way is forward.
FACING = 30.0
#: Seconds by which a motion may outlast its speech; frames are rounded.
_SPARE = 0.1
#: Robust standard deviations below the median from which a moment is a warning: a tiny flow of 1500 steps put the worst
#: of two clean minutes 4.7 below, cuts 6 to 9, and flipped wrists and ten degrees of jitter 30 and more.
WARN = 6.0


@dataclass(frozen=True, eq=False)
class Score:
    """The log-likelihood of a motion over time."""

    first: int
    """The first frame that is told of enough poses before it; all after it are scored too."""
    log_likelihood: Float[np.ndarray, " N"]
    """Nats of each frame's z-scores, given those before it and the speech."""
    moments: tuple[Moment, ...]
    """The least likely first."""
    dimensions: int
    """Values of a pose."""
    fps: float
    turned: float = 0.0
    """Degrees about the vertical by which the motion was turned to face as the run's do."""

    @property
    def seconds(self) -> Float[np.ndarray, " N"]:
        """When each scored frame is."""
        return (self.first + np.arange(len(self.log_likelihood))) / self.fps

    @property
    def bits_per_dim(self) -> float:
        """Mean over frames; less is more likely."""
        return -float(np.mean(self.log_likelihood)) / (self.dimensions * math.log(2.0))


def score_motion(run: Run, motion: Motion, audio: Float[np.ndarray, " N"]) -> Score:
    """The log-likelihood of a motion given a speech.

    Beyond the audio's end the model hears silence, so the last frames count too. A long motion is scored in windows;
    in each the recurrent layers begin as many frames early as a training clip lasts, at rest.

    Args:
        motion: on the run's skeleton, at its frame rate.
        audio: mono, at the run's sample rate.

    Raises:
        InputError: a model that tells no likelihood, or a motion that is too short or longer than the audio.
    """
    config = run.config
    score, model = compiled_score(run), config.model_config
    seconds = len(audio) / config.mel.sample_rate
    if motion.seconds > seconds + max(_SPARE, 1.0 / config.fps):
        raise InputError(
            f"the motion lasts {motion.seconds:.2f} s, but its speech only {seconds:.2f} s; are they of the same take?"
            " Cut the motion."
        )
    before, after, run_in = model.history_frames, model.lookahead_frames, model.clip_frames
    count = motion.frames - before
    if count < 1:
        raise InputError(f"the motion has {motion.frames} frames; the run needs more than the {before} it is told of.")
    features = log_mel(audio, config.mel, config.fps, motion.frames + after)
    heard = np.asarray(config.statistics["audio"].normalise(features), np.float32)
    turned, faced = _facing(run, motion)
    pose, _ = represent(faced, config.representation, "the motion")
    # No frame sees those after it: what fills up the last window changes nothing.
    length = before + run_in + WINDOW + after
    fill = -(-count // WINDOW) * WINDOW + length - len(heard)
    heard = np.pad(heard, ((0, fill), (0, 0)), mode="edge")
    pose = np.pad(pose, ((0, len(heard) - len(pose)), (0, 0), (0, 0)), mode="edge")
    parts, done = [], 0
    while done < count:
        start = max(0, done - run_in)
        nats = np.asarray(score(heard[None, start : start + length], pose[None, start : start + length]))[0]
        parts.append(nats[done - start :])
        done += len(parts[-1])
    log_likelihood = np.concatenate(parts)[:count].astype(np.float64)
    moments = tuple(unlikely_moments(log_likelihood, before, faced))
    return Score(before, log_likelihood, moments, int(pose[0].size), config.fps, turned)


def _facing(run: Run, motion: Motion) -> tuple[float, Motion]:
    mean = np.asarray(run.config.statistics["pose"].mean)
    usual = rotations_from_rows(mean[None], run.config.representation)[0, 0]
    faced, turned = face(motion, np.asarray(usual, np.float64))
    return (turned, faced) if abs(turned) > FACING else (0.0, motion)


def score_file(folder: Path, path: Path, audio: Path) -> Score:
    """The score of a motion file: any humanoid BVH, or an NPZ that this package wrote.

    Raises:
        InputError: a file that cannot be used, or as :func:`score_motion`, with the file named.
    """
    run = open_run(folder)
    if run.config.build().score is None:
        raise InputError(
            f"{folder}: is a run of {run.config.model}, which tells no likelihood of a motion; name one of"
            " stylized_flow."
        )
    motion = read_on_skeleton(path, run.config.skeleton, run.config.fps)
    speech = read_audio(audio, run.config.mel.sample_rate)
    try:
        return score_motion(run, motion, speech)
    except InputError as error:
        raise InputError(f"{path}, {audio}: {error}") from None


def score_report(score: Score, path: Path, *, curve: bool = False) -> Report:
    """What a score says.

    Args:
        path: of the motion.
        curve: with the log-likelihood of every frame, for JSON.
    """
    median, scale = robust_scale(score.log_likelihood)
    facts: dict[str, Any] = {
        "likelihood": {
            "frames": len(score.log_likelihood),
            "from (s)": float(score.seconds[0]),
            "to (s)": float(score.seconds[-1]),
            "mean (nats a frame)": float(np.mean(score.log_likelihood)),
            "median (nats a frame)": median,
            "robust standard deviation": scale,
            "bits per dimension": score.bits_per_dim,
            "dimensions": score.dimensions,
        }
    }
    if score.turned:
        facts["likelihood"]["turned to face as the run does (degrees)"] = score.turned
    if curve:
        facts["curve"] = {
            "seconds": score.seconds.tolist(),
            "log_likelihood": score.log_likelihood.tolist(),
        }
    return Report(str(path), "score", facts, [_finding(moment, path) for moment in score.moments])


def _finding(moment: Moment, path: Path) -> Finding:
    sure = moment.deviations >= WARN
    joints = f"; the jerkiest joints: {', '.join(moment.joints)}" if moment.joints else ""
    return Finding(
        "warning" if sure else "info",
        "unlikely",
        f"log-likelihood {moment.log_likelihood:.1f} nats, {moment.deviations:.1f} standard deviations below the"
        f" median{joints}.",
        "Look at it." if sure else "",
        Place(
            path=str(path),
            joint=moment.joints[0] if moment.joints else "",
            frame=moment.frame,
            seconds=moment.seconds,
        ),
        moment.log_likelihood,
    )
