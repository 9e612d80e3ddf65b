"""Joints that shake from frame to frame, and planted feet that shake or slide.

White noise on a joint has as much power at half the frame rate as anywhere; motion has hardly any there. The standard
deviation of the noise is that of fourth differences of the rotation over sqrt(70), and the variance of fifth
differences over that of fourth ones is 252 / 70 = 3.6 for white noise, and 1 for an oscillation at a sixth of the frame
rate. Both are measured in the calmest fifth of short windows, so that fast gestures of a low frame rate are not taken
for noise. On real takes (BEAT at 15 fps, ZeroEGGS at 30 fps, CMU at 120 fps) that is below 0.35 degrees.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.rig import Rig
from a2g_jax.inspection.finding import Finding, Place

#: Frames of a window, the share of windows that are calmer than the one that counts, and the fewest windows.
_WINDOW, _CALM, _WINDOWS = 16, 20, 2
#: Least ratio of variances of white noise.
_WHITE = 2.4
#: Degrees of noise: in half of the body's joints, and in one. Below 30 fps a fast arm looks like noise, with the square
#: of the frame's length.
_MANY, _ONE, _RATE = 0.3, 0.5, 30.0
#: Metres of noise on the root's path.
_ROOT = 0.003
#: Parts of a body whose noise is looked for; toes and fingers are tracked worse.
_LIMBS = ("Collar", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle")
#: Planted feet: slower than this in m/s, and lower than this over their lowest, metres, when smoothed by this many
#: seconds.
_PLANTED_SPEED, _PLANTED_HEIGHT, _SMOOTHING = 0.1, 0.05, 0.12
#: Amplitude in metres of a foot that shakes, the share of planted windows of so many seconds in which it does, and the
#: fewest windows; lowest frame rate.
_SHAKE, _SHAKING, _SHAKE_WINDOW, _SHAKE_WINDOWS, _LOWEST_RATE = 0.004, 0.1, 0.3, 5, 12.0
#: Sliding feet: height over the floor in metres, smoothing in seconds, speed of the slower foot in m/s, metres and
#: seconds of one slide, metres of all, and their share of the time.
_FLOOR, _SLIDE_SMOOTHING, _SLIDE_SPEED, _SLIDE, _SLIDE_SECONDS = 0.03, 0.05, 0.04, 0.08, 0.4
_SLIDES, _SLIDING = 0.2, 0.05

_SMOOTH = "Filter it with --smooth of 'a2g retarget' or 'a2g prepare', or clean it up at the source."


def check_shaking(motion: Motion, rig: Rig | None, places: Float[np.ndarray, "T J 3"] | None) -> list[Finding]:
    """Findings on noise of joints, else on planted feet.

    Args:
        places: positions of the joints in metres: left, up, forward; None without a body.
    """
    findings = check_jitter(motion, rig)
    if findings or rig is None or places is None or "L_Ankle" not in rig.roles or "R_Ankle" not in rig.roles:
        # Feet of a body that shakes do so, too.
        return findings
    ends = [rig.roles.get(f"{side}_Foot", rig.roles[f"{side}_Ankle"]) for side in "LR"]
    feet = np.asarray(places[:, ends], np.float64)
    return [*check_foot_shake(feet, motion.fps), *check_foot_slide(feet, motion.fps)]


def check_jitter(motion: Motion, rig: Rig | None = None) -> list[Finding]:
    """Findings on white noise of joints' rotations, and of the root's path."""
    if motion.frames < _WINDOWS * _WINDOW + 5:
        return []
    if rig is None:
        joints = np.arange(motion.skeleton.joints)
    else:
        middle = [rig.roles[part] for part in ("Pelvis", "Head") if part in rig.roles]
        limbs = [joint for role, joint in rig.roles.items() if role.partition("_")[2] in _LIMBS]
        joints = np.array(sorted({*middle, *rig.spine, *rig.neck, *limbs}))
    noise, usual, white = _noise(_turns(np.asarray(motion.rotations, np.float32)[:, joints]))
    slow = max(1.0, (_RATE / motion.fps) ** 2)
    shaking = white & (noise > _MANY)
    one = white & (noise > _ONE * slow)
    root, usual_root, root_white = _noise(np.diff(np.asarray(motion.root, np.float64), axis=0)[:, None])
    findings = []
    if one.any() or (rig is not None and shaking.sum() >= max(6, len(joints) / 2)):
        worst = int(np.argmax(np.where(shaking, noise, 0.0)))
        name, degrees = motion.skeleton.names[joints[worst]], float(usual[worst])
        message = (
            f"jitter: {int(shaking.sum())} of {len(joints)} joints shake from frame to frame, most {name} by "
            f"{degrees:.1f} degrees (standard deviation)."
        )
        findings.append(Finding("warning", "jitter", message, _SMOOTH, Place(joint=name), degrees))
    elif root_white[0] and root[0] > _ROOT * slow:
        cm = 100 * float(usual_root[0])
        message = f"jitter: the root's path shakes by {cm:.1f} cm from frame to frame (standard deviation)."
        findings.append(Finding("warning", "jitter", message, _SMOOTH, Place(joint=motion.skeleton.names[0]), cm))
    return findings


def _turns(rotations: Float[np.ndarray, "T J 3 3"]) -> Float[np.ndarray, "S J 3"]:
    """Rotation vectors between frames, degrees; sines stand for the angles, which differ where motion is fast."""
    # Rows of the transposed matrix, written out, since products of small matrices are slow.
    before, after = rotations[:-1], rotations[1:]
    x = np.einsum("tjk,tjk->tj", before[..., 2], after[..., 1]) - np.einsum(
        "tjk,tjk->tj", before[..., 1], after[..., 2]
    )
    y = np.einsum("tjk,tjk->tj", before[..., 0], after[..., 2]) - np.einsum(
        "tjk,tjk->tj", before[..., 2], after[..., 0]
    )
    z = np.einsum("tjk,tjk->tj", before[..., 1], after[..., 0]) - np.einsum(
        "tjk,tjk->tj", before[..., 0], after[..., 1]
    )
    return np.degrees(np.stack([x, y, z], axis=-1) / 2)


def _noise(
    steps: Float[np.ndarray, "S J 3"],
) -> tuple[Float[np.ndarray, " J"], Float[np.ndarray, " J"], Bool[np.ndarray, " J"]]:
    """Standard deviation per axis of noise in a signal with these steps, in calm and in usual windows; is it white?"""
    fourth = np.diff(steps, 3, axis=0)
    fifth = np.diff(fourth, axis=0)
    count = len(fifth) // _WINDOW
    variances = [
        np.square(values[: count * _WINDOW]).sum(axis=-1).reshape(count, _WINDOW, -1).mean(axis=1) / 3
        for values in (fourth, fifth)
    ]
    calm = np.percentile(variances[0], _CALM, axis=0, method="nearest")
    place = np.argmin(np.abs(variances[0] - calm), axis=0)
    ratios = np.take_along_axis(variances[1], place[None], axis=0)[0] / np.maximum(calm, 1e-18)
    typical = np.median(variances[1] / np.maximum(variances[0], 1e-18), axis=0)
    usual = np.sqrt(np.median(variances[0], axis=0) / 70)
    return np.sqrt(calm / 70), usual, np.minimum(ratios, typical) > _WHITE


def check_foot_shake(feet: Float[np.ndarray, "T 2 3"], fps: float) -> list[Finding]:
    """Findings on planted feet that shake.

    Args:
        feet: positions of the balls of both feet, or of the ankles: left, up, forward.
    """
    frames = max(4, int(_SHAKE_WINDOW * fps))
    count = len(feet) // frames
    if fps < _LOWEST_RATE or count < _SHAKE_WINDOWS:
        return []
    calm = gaussian_filter1d(feet, _SMOOTHING * fps, axis=0)
    speed = np.linalg.norm(np.gradient(calm, axis=0), axis=-1) * fps
    floor = np.percentile(calm[..., 1], 5, axis=0)
    planted = (speed < _PLANTED_SPEED) & (calm[..., 1] < floor + _PLANTED_HEIGHT)
    whole = planted[: count * frames].reshape(count, frames, 2).all(axis=1)
    rest = (feet - calm)[: count * frames].reshape(count, frames, 2, 3)
    amplitudes = np.sqrt(2 * np.square(rest).sum(axis=-1).mean(axis=1))
    shaking = whole & (amplitudes > _SHAKE)
    if whole.sum() < _SHAKE_WINDOWS or shaking.sum() < max(2, _SHAKING * whole.sum()):
        return []
    amplitude = float(np.median(amplitudes[shaking]))
    first = int(np.flatnonzero(shaking.any(axis=1))[0]) * frames
    rate = _frequency((feet - calm).reshape(len(feet), -1), fps)
    share = 100 * shaking.sum() / whole.sum()
    message = (
        f"planted feet shake by {100 * amplitude:.1f} cm at about {rate:.0f} Hz, for {share:.0f} % of their time on the"
        " floor."
    )
    place = Place(frame=first, seconds=first / fps)
    return [Finding("warning", "foot-shake", message, _SMOOTH, place, 100 * amplitude)]


def _frequency(values: Float[np.ndarray, "T C"], fps: float) -> float:
    power = np.square(np.abs(np.fft.rfft(values - values.mean(axis=0), axis=0))).sum(axis=1)
    return float(np.fft.rfftfreq(len(values), 1 / fps)[int(np.argmax(power))])


def check_foot_slide(feet: Float[np.ndarray, "T 2 3"], fps: float) -> list[Finding]:
    """Findings on feet that move over the floor both at once: a body that stands or walks has one that does not.

    Args:
        feet: as of :func:`check_foot_shake`.
    """
    if fps < _LOWEST_RATE or len(feet) < fps:
        return []
    smooth = gaussian_filter1d(feet, _SLIDE_SMOOTHING * fps, axis=0)
    speed = np.linalg.norm(np.gradient(smooth[..., [0, 2]], axis=0), axis=-1) * fps
    down = smooth[..., 1] < np.percentile(smooth[..., 1], 5, axis=0) + _FLOOR
    slower = np.where(down, speed, np.inf).min(axis=1)
    moves = down.any(axis=1) & (slower > _SLIDE_SPEED)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moves, [False]]).astype(np.int8))).reshape(-1, 2)
    slides = [(int(a), int(b), float(slower[a:b].sum() / fps)) for a, b in edges if b - a >= _SLIDE_SECONDS * fps]
    slides = [slide for slide in slides if slide[2] > _SLIDE]
    metres, frames = sum(slide[2] for slide in slides), sum(slide[1] - slide[0] for slide in slides)
    if metres < _SLIDES or frames < _SLIDING * len(feet):
        return []
    start, stop, longest = max(slides, key=lambda slide: slide[2])
    message = (
        f"both feet slide over the floor, {metres:.2f} m in {frames / fps:.1f} s; the longest slide is {longest:.2f} m "
        f"in {(stop - start) / fps:.1f} s."
    )
    fix = "Does the root move without steps? Solve the feet again, or plant them at the source."
    return [Finding("warning", "foot-slide", message, fix, Place(frame=start, seconds=start / fps), metres)]
