"""Faults of a motion alone: frozen joints, flipped rotations, jumps of the root, repeated frames.

Every check is a pure function of a motion and finds nothing in a sound one.
"""

import numpy as np
from jaxtyping import Bool, Float

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.calibration import calibration_frames
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.geometry.retarget.rig import Rig
from a2g_jax.inspection.finding import Finding, Place

#: Degrees between frames below which a rotation counts as unchanged: 100 times the rounding of float32 matrices.
STILL = 1e-3
#: Seconds that a joint of a living arm, trunk or head cannot hold still to a thousandth of a degree.
FROZEN_SECONDS = 1.0
#: Degrees by which another joint must turn meanwhile; otherwise the whole body is paused, which is another fault.
MOVES_MEANWHILE = 5.0
#: A flip exceeds the first number of degrees between two frames, and the speed of any wrist, in degrees per second; at
#: low rates, where a fast gesture turns far in a frame, the last number of degrees suffices.
FLIP_DEGREES, FLIP_SPEED, FLIP_SURELY = 60.0, 1800.0, 150.0
#: Ratio of a flip to the steps around it (except one, the way back); fast gestures gain speed over frames.
FLIP_ISOLATION = 4.0
#: Metres between frames, and ratio to the steps around, of a jump of the root.
JUMP_METRES, JUMP_ISOLATION = 0.15, 4.0
#: Share of frames equal to the one before from which a motion counts as upsampled by repetition.
REPEATED_SHARE = 0.2
_BESIDE = 3


def rotation_steps(motion: Motion) -> Float[np.ndarray, "S J"]:
    """Angle between the local rotations of consecutive frames, degrees."""
    rotations = np.asarray(motion.rotations)
    parts = [rotation_angle(rotations[at + 1 : at + 513], rotations[at : at + 512][: len(rotations) - at - 1])
             for at in range(0, max(len(rotations) - 1, 1), 512)]  # fmt: skip
    return np.concatenate(parts).astype(np.float64)


def check_frozen(motion: Motion, rig: Rig | None = None) -> list[Finding]:
    """Findings on joints that do not turn at all, for a stretch or throughout, while others do.

    A warning where that is impossible for a living body: an elbow, a wrist, a shoulder, the whole trunk, or head
    and neck together. Legs, fingers and helpers that never turn are an info, since many data sets keep them
    still.
    """
    if motion.frames < 2:
        return []
    still = rotation_steps(motion) < STILL
    if still.all():
        return [Finding("warning", "frozen", "nothing moves.", "Export the take again.", Place(frame=0, seconds=0.0))]
    names, findings = motion.skeleton.names, []
    reported: set[int] = set()
    for label, joints in _vital_parts(rig):
        for start, stop in _runs(np.all(still[:, joints], axis=1), FROZEN_SECONDS * motion.fps):
            others = np.ones(motion.skeleton.joints, bool)
            others[joints] = False
            if _most_turned(motion, start, stop, others) < MOVES_MEANWHILE:
                continue
            seconds = (stop - start) / motion.fps
            reported.update(joints)
            findings.append(
                Finding(
                    "warning",
                    "frozen",
                    f"{label} does not turn at all for {seconds:.1f} s while other joints move.",
                    "Was the marker lost, or the joint left out of the export? Fix it or cut the stretch out.",
                    Place(joint=names[joints[-1]], frame=start, seconds=start / motion.fps),
                    seconds,
                )
            )
    static = [names[joint] for joint in np.flatnonzero(still.all(axis=0)) if joint not in reported]
    if static:
        message = f"{len(static)} of {len(names)} joints never turn: {_some(static)}."
        findings.append(Finding("info", "static", message, value=float(len(static))))
    return findings


def _vital_parts(rig: Rig | None) -> list[tuple[str, list[int]]]:
    """Parts that always move a little in a living body; those of a trunk may share one joint's motion."""
    if rig is None:
        return []
    roles = rig.roles
    parts = [(f"the {'left' if side == 'L' else 'right'} {part.lower()}", [roles[f"{side}_{part}"]])
             for side in "LR" for part in ("Shoulder", "Elbow", "Wrist")]  # fmt: skip
    head = [*rig.neck, *([roles["Head"]] if "Head" in roles else [])]
    trunk = [*([roles["Pelvis"]] if "Pelvis" in roles else [0]), *rig.spine]
    return parts + [(label, joints) for label, joints in (("the head", head), ("the trunk", trunk)) if joints]


def _most_turned(motion: Motion, start: int, stop: int, joints: Bool[np.ndarray, " J"]) -> float:
    rotations = np.asarray(motion.rotations)[start : stop + 1, joints]
    return float(rotation_angle(rotations, np.broadcast_to(rotations[:1], rotations.shape)).max(initial=0.0))


def _runs(mask: Bool[np.ndarray, " N"], shortest: float) -> list[tuple[int, int]]:
    """Stretches (start, stop) of true values with a minimum length."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2) if b - a >= shortest]


def check_flips(motion: Motion) -> list[Finding]:
    """Findings on rotations that jump between two frames and not around them: swapped markers, wrong Euler angles.

    Angles that run from 179 to -179 degrees are the same rotation and not found here; see
    :func:`a2g_jax.inspection.bvh_file.check_wraps`.
    """
    if motion.frames < 2 * _BESIDE:
        return []
    steps = rotation_steps(motion)
    least = min(max(FLIP_DEGREES, FLIP_SPEED / motion.fps), FLIP_SURELY)
    large = (steps > least) & (steps > FLIP_ISOLATION * _around(steps))
    findings = []
    for joint in np.flatnonzero(large.any(axis=0)):
        frames = np.flatnonzero(large[:, joint])
        worst = frames[np.argmax(steps[frames, joint])]
        many = f" ({len(frames)} such jumps)" if len(frames) > 1 else ""
        findings.append(
            Finding(
                "warning",
                "flip",
                f"turns by {steps[worst, joint]:.0f} degrees from this frame to the next{many}.",
                "Unroll its Euler angles at the source, or cut these frames out.",
                Place(joint=motion.skeleton.names[joint], frame=int(worst), seconds=float(worst / motion.fps)),
                float(steps[worst, joint]),
            )
        )
    return findings


def check_jumps(motion: Motion) -> list[Finding]:
    """Findings on jumps of the root between two frames, as by cuts and lost tracking."""
    if motion.frames < 2 * _BESIDE:
        return []
    steps = np.linalg.norm(np.diff(np.asarray(motion.root, np.float64), axis=0), axis=1)[:, None]
    frames = np.flatnonzero((steps > JUMP_METRES) & (steps > JUMP_ISOLATION * _around(steps)))
    if len(frames) == 0:
        return []
    worst = int(frames[np.argmax(steps[frames, 0])])
    message = f"the root jumps by {steps[worst, 0]:.2f} m from this frame to the next"
    message += f" ({len(frames)} such jumps)." if len(frames) > 1 else "."
    place = Place(joint=motion.skeleton.names[0], frame=worst, seconds=worst / motion.fps)
    return [
        Finding("warning", "jump", message, "Is it two takes in one file? Split it.", place, float(steps[worst, 0]))
    ]


def check_calibration(motion: Motion) -> tuple[list[Finding], int]:
    """A finding on a calibration pose at the start, and the frame at which the take itself starts."""
    if not (np.isfinite(motion.rotations).all() and np.isfinite(motion.root).all()):
        return [], 0
    count = calibration_frames(motion)
    if count == 0:
        return [], 0
    which = "frame 0 is" if count == 1 else f"frames 0 to {count - 1} are"
    turn = float(rotation_steps(motion.clip(count - 1, count + 1)).max())
    message = f"{which} a calibration pose (such as a T-pose); then joints turn by {turn:.0f} degrees at once."
    fix = "'a2g prepare' and 'a2g generate' (--pin, --style, --seed-clip) leave it out."
    return [Finding("warning", "calibration", message, fix, Place(frame=0, seconds=0.0), float(count))], count


def check_repeats(motion: Motion) -> list[Finding]:
    """Findings on frames that repeat the one before: a motion brought to a higher rate without interpolation."""
    if motion.frames < 10:
        return []
    still = np.all(rotation_steps(motion) < STILL, axis=1)
    share = float(still.mean())
    # A pause repeats its pose in one stretch; a repeated frame stands among others that move.
    alone = still & ~np.roll(still, 1)
    if share < REPEATED_SHARE or still.all() or alone.sum() < 0.1 * len(still):
        return []
    message = f"{100 * share:.0f} % of the frames repeat the one before."
    fix = f"The motion was recorded at about {motion.fps * (1 - share):.3g} fps; export it at that rate."
    return [Finding("warning", "repeated", message, fix, value=share)]


def check_finite(values: Float[np.ndarray, "..."], what: str) -> list[Finding]:
    """Findings on NaN and infinities in an array."""
    bad = ~np.isfinite(values)
    count = int(bad.sum())
    if count == 0:
        return []
    first = ", ".join(str(int(index)) for index in np.argwhere(bad)[0])
    message = f"{what} holds {count} values that are NaN or infinite, the first at [{first}]."
    fix = "Fix the program that wrote it; a network trained on it becomes NaN."
    return [Finding("warning", "nan", message, fix, value=float(count))]


def check_motion(motion: Motion, rig: Rig | None = None) -> list[Finding]:
    """All checks of a motion alone."""
    if findings := check_finite(np.asarray(motion.rotations), "the motion") + check_finite(
        np.asarray(motion.root), "the root"
    ):
        return findings
    return [*check_frozen(motion, rig), *check_flips(motion), *check_jumps(motion), *check_repeats(motion)]


def _around(steps: Float[np.ndarray, "N K"]) -> Float[np.ndarray, "N K"]:
    """The second largest of the three steps before and the three after each."""
    padded = np.pad(steps, ((_BESIDE, _BESIDE), (0, 0)), mode="edge")
    around = [padded[at : at + len(steps)] for at in range(2 * _BESIDE + 1) if at != _BESIDE]
    return np.sort(np.stack(around), axis=0)[-2]


def _some(names: list[str]) -> str:
    return ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
