"""Clips as a trained flow can use them: checked against its training motion, adapted to it, or refused by name."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.generation.stylized_flow.into_range import Ranges, rows_into_range
from a2g_jax.generation.stylized_flow.repair import bridged, joint_turns, tilt, without_turning
from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_track import represent
from a2g_jax.geometry.retarget.onto import face, on_skeleton
from a2g_jax.metrics.liveliness import body_of, wrist_jerk, wrist_speeds
from a2g_jax.training.run import Run

#: Degrees from upright beyond which a body lies, bends to the floor or turns over, and the share of a clip's time that
#: it may.
_UPRIGHT, _BENT_SHARE = 50.0, 0.1
#: Share of a clip's frames with jumps that are bridged.
_JUMPING_SHARE = 0.05
#: Mean speed of both wrists of gesturing people, m/s.
_SPEED = (0.02, 1.5)


@dataclass(frozen=True)
class Distance:
    """Figures of a clip beside a run's training motion, before it is adapted."""

    seconds: float
    tilt: float
    """90th percentile over time, degrees from upright."""
    jumps: int
    """Frames in which a joint or wrist jumps: see :mod:`a2g_jax.generation.stylized_flow.repair`."""
    largest_turn: float
    """Degrees by which a joint turns in a frame of the run."""
    wrist_speed: float | None = None
    """Mean of both wrists relative to the pelvis, m/s, jumps bridged; None without the joints of a body."""
    wrist_top_speed: float | None = None
    """Largest, m/s, as in the file."""
    wrist_jerk: float | None = None
    """99th percentile, m/s3, as in the file."""
    pose: float | None = None
    """99th percentile of absolute z-scores; that of training motion is about 3. None for a run that holds no ranges."""
    log_likelihood: float | None = None
    """Median over frames, nats."""
    code: float | None = None
    """Median over frames of the root mean square of latents; about 0.8 for training motion."""


@dataclass(frozen=True)
class Adapted:
    """What was changed in a clip for the flow."""

    turned: float = 0.0
    """Degrees about the vertical, to the facing direction of the run."""
    turning: float = 0.0
    """Range of the heading that was removed, degrees."""
    bridged: int = 0
    """Frames with jumps that were bridged."""
    posture: float = 0.0
    """Largest removed offset, standard deviations of a channel."""
    amplitude: float = 1.0
    """Smallest factor on a channel's deviations."""
    clipped: float = 0.0
    """Share of values that were clipped to the range of training."""
    latents: float = 1.0
    """Factor by which latents are as large as the clip's own, root mean square."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A clip on a run's skeleton, the poses that the flow is given, and the record of both."""

    motion: Motion
    """The clip itself, jumps bridged and facing as the run's motions do."""
    rows: Float[np.ndarray, "T R D"]
    """Within the range of the training motion."""
    distance: Distance
    adapted: Adapted

    def as_json(self) -> dict[str, Any]:
        """The figures, for a report."""
        return {"distance": asdict(self.distance), "adapted": asdict(self.adapted)}


def fit(motion: Motion, run: Run, name: str, *, whole: bool = True) -> Fitted:
    """A clip that a run's flow can encode or continue.

    It is retargeted, resampled and turned to face as the run's motions do. Jumps of single frames are bridged, turning
    about is removed, and posture and amplitude are moved into the range of the training motion, where the run holds it.
    A clip that needs none of this is unchanged.

    Args:
        motion: on any humanoid rig, at any rate.
        name: for messages, such as ``--style clip.bvh``.
        whole: whether speeds of the whole clip count; False for seed poses.

    Raises:
        InputError: a rig that is not recognised, a body that is not upright, too many jumps, or hands that are still or
            faster than people gesture.
    """
    config = run.config
    facing = np.asarray(config.space.mean_rotations(config.statistics["pose"].mean)[0], np.float64)
    clip, turned = face(on_skeleton(motion, config.skeleton, config.fps, name), facing)
    first = _as_given(clip, facing)
    _refuse_tilt(tilt(clip, facing), clip.fps, name)
    straight, turning = without_turning(clip, facing)
    sound, count = bridged(straight)
    if count > max(1.0, _JUMPING_SHARE * clip.frames):
        raise InputError(
            f"{name}: joints turn by up to {first.largest_turn:.0f} degrees in a frame, or wrists jump, in {count} of"
            f" {clip.frames} frames; people's do not. Clean up the recording, or give a part without such frames."
        )
    speed = None
    if first.wrist_top_speed is not None:
        speed = float(wrist_speeds(body_of(sound)).mean())
        if whole:
            _refuse_speed(speed, name)
    rows = represent(sound, config.space.kind, name)[0]
    distance, adapted = replace(first, jumps=count, wrist_speed=speed), Adapted(turned, turning, count)
    ranges = Ranges.of(run)
    if ranges is not None:
        distance = replace(distance, pose=_pose_distance(run, rows, ranges))
        rows, moved = rows_into_range(run, rows, ranges)
        adapted = replace(
            adapted,
            posture=float(np.abs(moved.offset).max()),
            amplitude=float(moved.amplitude.min()),
            clipped=moved.clipped,
        )
    return Fitted(sound, rows, distance, adapted)


def _as_given(clip: Motion, facing: Float[np.ndarray, "3 3"]) -> Distance:
    lean = float(np.percentile(tilt(clip, facing), 90))
    found = Distance(clip.seconds, lean, 0, float(joint_turns(clip).max(initial=0.0)))
    if clip.frames < 4 or find_body_joints(clip.skeleton) is None:
        return found
    body = body_of(clip)
    jerk = float(np.percentile(wrist_jerk(body), 99))
    return replace(found, wrist_top_speed=float(wrist_speeds(body).max()), wrist_jerk=jerk)


def _pose_distance(run: Run, rows: Float[np.ndarray, "T R D"], ranges: Ranges) -> float:
    statistics = run.config.statistics["pose"]
    z = np.abs(statistics.normalise(run.config.space.continuous(rows, statistics.mean)))
    return float(np.percentile(z.reshape(len(rows), -1)[:, ranges.channels], 99))


def _refuse_tilt(lean: Float[np.ndarray, " T"], fps: float, name: str) -> None:
    bent = lean > _UPRIGHT
    if bent.mean() > _BENT_SHARE:
        raise InputError(
            f"{name}: its body is not upright in {100 * bent.mean():.0f} % of the frames (from"
            f" {int(np.argmax(bent)) / fps:.2f} s on, {lean.max():.0f} degrees at most); give a part of the take in which"
            " a person stands or sits, or correct its axes (a2g inspect)."
        )


def _refuse_speed(speed: float, name: str) -> None:
    if not _SPEED[0] <= speed <= _SPEED[1]:
        what = "do not move" if speed < _SPEED[0] else "are faster than people gesture"
        remedy = "in which a person gestures" if speed < _SPEED[0] else "of the right frame rate, without noise"
        raise InputError(
            f"{name}: its hands {what}: {speed:.2f} m/s on average, expected {_SPEED[0]:g} to {_SPEED[1]:g}; give a clip"
            f" {remedy}."
        )
