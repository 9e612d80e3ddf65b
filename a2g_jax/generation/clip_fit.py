"""How far a clip lies from a run's training motion and from what a human body does: figures, and reasons to refuse it.

Pure functions of a motion on the run's body, at any rate. Which figures matter depends on the use: a pinned clip is
performed as it is and only has to be a sound human motion; a clip that networks encode also has to resemble what they
were trained on. The bounds are therefore arguments.
"""

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.retarget.poses import angle_between, rotation_angle
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton
from a2g_jax.metrics.hands import hand_jerk, hand_speeds

#: Standard deviations from the mean beyond which a value lies outside the training range; held-out talk has 0.1 % of
#: its values there.
RANGE = 4.0
#: Degrees by which both bones of both arms may point elsewhere than straight to the side in a T-pose.
T_POSE = 20.0
#: Fastest wrist of a clip that counts as standing still, m/s.
STILL = 0.1
#: Degrees per second beyond which a joint flips in a recording: 60 degrees between two frames at 30 fps.
FLIP = 1800.0
#: Metres between two frames from which the root jumps, at 30 fps.
JUMP = 0.15


class Worst(NamedTuple):
    """The largest value of a motion, and its place."""

    value: float
    frame: int
    joint: str


@dataclass(frozen=True)
class ClipFit:
    """Figures of a clip on a run's body."""

    frames: int
    fps: float
    turn: Worst
    """Fastest turn of a joint relative to its parent, degrees per second; the frame is the one before the turn."""
    wrist_speed: Worst
    """Fastest wrist relative to the root, m/s."""
    wrist_speed_p99: float
    """99th percentile of the faster wrist's speed over frames, m/s."""
    jerk_p99: float
    """99th percentile of the jerk of the hand with more of it, m/s3; 300 to 1000 in recordings of talk."""
    tilt: Worst
    """Largest angle between the trunk (pelvis to neck) and the vertical, degrees."""
    t_pose_share: float
    """Share of frames with both arms stretched out to the sides."""
    beyond_share: float
    """Share of pose values more than :data:`RANGE` standard deviations from the mean of the run's training poses."""
    z_rms: float
    """Root mean square of the z-scores of pose values; about 1 for training motion."""
    from_mean: float
    """Angle between joints' rotations and the run's mean pose, degrees: mean over joints, median over frames."""
    travel: float
    """Diameter of the box around the root's horizontal path, metres."""
    jumps: int
    """Steps of the root longer than :data:`JUMP` at 30 fps, or as fast at another rate."""

    @property
    def seconds(self) -> float:
        """Length: frames / fps."""
        return self.frames / self.fps

    @property
    def is_t_pose(self) -> bool:
        """Whether the clip holds a T-pose throughout, as for the calibration of a capture system."""
        return self.t_pose_share > 0.9 and self.wrist_speed.value < STILL

    def as_json(self) -> dict[str, Any]:
        """The figures as JSON values."""
        found = {name: value._asdict() if isinstance(value, Worst) else value for name, value in asdict(self).items()}
        return {**found, "seconds": self.seconds}


@dataclass(frozen=True)
class Bounds:
    """Largest figures of a clip that is used; None for no bound."""

    shortest: float = 0.2
    """Seconds; shorter clips are lost in their transitions."""
    turn: float | None = FLIP
    """Degrees per second."""
    wrist_speed: float | None = 6.0
    """m/s; the liveliest talk has 3 to 4.5."""
    tilt: float | None = 75.0
    """Degrees of the trunk from the vertical; a body that lies or stands on its hands cannot be put on its feet."""
    from_mean: float | None = 50.0
    """Degrees; people who talk have 10 to 25, and seated people about 40; a dog has 64."""
    beyond_share: float | None = None
    z_rms: float | None = None


def measure_clip(motion: Motion, space: PoseSpace, statistics: Statistics) -> ClipFit:
    """Figures of a clip.

    Args:
        motion: one frame or more, on the run's skeleton.
        space: pose space of the run; its poses are rotations.
        statistics: of the run's training poses.
    """
    rotations = np.asarray(motion.rotations)
    names, fps = motion.skeleton.names, motion.fps
    turns = rotation_angle(rotations[1:], rotations[:-1]) * fps
    body = find_body_joints(motion.skeleton)
    places = motion.positions()
    root = places[:, 0].astype(np.float64)
    local = places - places[:, :1]
    wrists = [body[BODY_JOINTS.index(f"{side}_Wrist")] for side in "LR"] if body else []
    speeds = np.linalg.norm(np.diff(local[:, wrists], axis=0), axis=-1) * fps
    scores = np.asarray(statistics.normalise(np.asarray(space.from_rotations(jnp.asarray(rotations)))))
    mean = np.asarray(space.mean_rotations(statistics.mean))
    away = rotation_angle(rotations, np.broadcast_to(mean, rotations.shape))
    steps = np.linalg.norm(np.diff(root, axis=0), axis=-1)
    return ClipFit(
        frames=motion.frames,
        fps=fps,
        turn=_worst(turns, names),
        wrist_speed=_worst(speeds, [names[joint] for joint in wrists]),
        wrist_speed_p99=_percentile(hand_speeds(local, motion.skeleton, fps)),
        jerk_p99=_percentile(hand_jerk(local, motion.skeleton, fps)),
        tilt=_worst(_tilt(local, body)[:, None], ["trunk"]),
        t_pose_share=float(np.mean(t_pose_frames(motion))),
        beyond_share=float(np.mean(np.abs(scores) > RANGE)),
        z_rms=float(np.sqrt(np.mean(np.square(scores)))),
        from_mean=float(np.median(away.mean(axis=1))),
        travel=float(np.linalg.norm(np.ptp(root[:, [0, 2]], axis=0))),
        jumps=int(np.sum(steps * fps > JUMP * 30.0)),
    )


def refusals(fit: ClipFit, bounds: Bounds | None = None) -> list[str]:
    """Reasons to refuse a clip, each with its figure and remedy; none for a clip that is within the bounds.

    Args:
        bounds: those of a clip that is performed as it is, by default.
    """
    bounds = Bounds() if bounds is None else bounds
    found = []
    if fit.frames == 1:
        found.append("is a single frame, a pose without motion; give a clip of two frames or more.")
    elif fit.seconds < bounds.shortest - 1e-6:
        found.append(f"lasts {fit.seconds:.2f} s; give a clip of {bounds.shortest:g} s or more.")
    if fit.is_t_pose:
        found.append(f"holds a T-pose for {fit.t_pose_share:.0%} of its frames, as for calibration; give a motion.")
    if _exceeds(fit.from_mean, bounds.from_mean):
        found.append(
            f"has joints turned by {fit.from_mean:.0f} degrees on average from the mean pose of the training motion"
            f" (limit {bounds.from_mean:g}); is it a human body on its feet?"
        )
    if _exceeds(fit.tilt.value, bounds.tilt):
        found.append(
            f"tilts the trunk by {fit.tilt.value:.0f} degrees in frame {fit.tilt.frame} (limit {bounds.tilt:g}); use"
            " clips of people on their feet."
        )
    if _exceeds(fit.turn.value, bounds.turn):
        found.append(
            f"turns {fit.turn.joint} by {fit.turn.value / fit.fps:.0f} degrees from frame {fit.turn.frame} to the next,"
            f" {fit.turn.value:.0f} degrees/s (limit {bounds.turn:g}); correct it at the source or cut it out."
        )
    if _exceeds(fit.wrist_speed.value, bounds.wrist_speed):
        found.append(
            f"moves {fit.wrist_speed.joint} at {fit.wrist_speed.value:.1f} m/s from frame {fit.wrist_speed.frame} to"
            f" the next (limit {bounds.wrist_speed:g}); check its frame rate and unit, or cut it out."
        )
    if _exceeds(fit.beyond_share, bounds.beyond_share):
        found.append(
            f"has {fit.beyond_share:.0%} of its pose values {RANGE:g} or more standard deviations from the mean of the"
            f" training motion (limit {bounds.beyond_share:.0%})."
        )
    if _exceeds(fit.z_rms, bounds.z_rms):
        found.append(
            f"lies {fit.z_rms:.1f} standard deviations from the mean of the training motion (limit {bounds.z_rms:g})."
        )
    return found


def t_pose_frames(motion: Motion) -> Bool[np.ndarray, " T"]:
    """Frames in which both arms are stretched out to the sides, relative to the trunk."""
    body = find_body_joints(motion.skeleton)
    if body is None:
        return np.zeros(motion.frames, bool)
    places = motion.positions()
    part = {name: places[:, body[BODY_JOINTS.index(name)]] for name in _T_JOINTS}
    across = part["L_Shoulder"] - part["R_Shoulder"]
    found = np.ones(motion.frames, bool)
    for side, sign in (("L", 1.0), ("R", -1.0)):
        for start, end in ((f"{side}_Shoulder", f"{side}_Elbow"), (f"{side}_Elbow", f"{side}_Wrist")):
            found &= angle_between(part[end] - part[start], sign * across) < T_POSE
    return found


def leading_t_pose(motion: Motion) -> int:
    """Number of frames of a T-pose that a motion begins with and jumps out of; 0 if it leaves it as people do."""
    held = t_pose_frames(motion)
    frames = motion.frames if held.all() else int(np.argmin(held))
    if frames in (0, motion.frames):
        return 0
    rotations = np.asarray(motion.rotations)
    leaves = rotation_angle(rotations[frames], rotations[frames - 1]).max() * motion.fps
    return frames if leaves > FLIP else 0


_T_JOINTS = tuple(f"{side}_{joint}" for side in "LR" for joint in ("Shoulder", "Elbow", "Wrist"))
#: Parts of names of joints that people do not have.
_ANIMAL = ("tail", "paw", "hoof", "wing")


def animal_joints(skeleton: Skeleton) -> list[str]:
    """Names of joints that people do not have, such as tails, as far as names show it."""
    return [name for name in skeleton.names if any(word in name.lower() for word in _ANIMAL)]


def _percentile(values: Float[np.ndarray, " t"]) -> float:
    return float(np.percentile(values, 99.0)) if len(values) else 0.0


def _exceeds(value: float, bound: float | None) -> bool:
    return bound is not None and value > bound


def _tilt(local: Float[np.ndarray, "T J 3"], body: tuple[int, ...] | None) -> Float[np.ndarray, " T"]:
    if body is None:
        return np.zeros(len(local))
    trunk = local[:, body[BODY_JOINTS.index("Neck")]] - local[:, body[BODY_JOINTS.index("Pelvis")]]
    return angle_between(trunk, np.broadcast_to(np.array([0.0, 1.0, 0.0]), trunk.shape))


def _worst(values: Float[np.ndarray, "t K"], names: tuple[str, ...] | list[str]) -> Worst:
    if values.size == 0:
        return Worst(0.0, 0, names[0] if names else "")
    frame, joint = np.unravel_index(int(np.argmax(values)), values.shape)
    return Worst(float(values[frame, joint]), int(frame), names[joint])
