"""Pins: a clip and its second, read from ``FILE@SECOND[+LENGTH]`` and adapted to a run's body, rate and facing."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.generation.clip_fit import Bounds, ClipFit, animal_joints, leading_t_pose, measure_clip, refusals
from a2g_jax.generation.clips import read_motion, without_calibration
from a2g_jax.generation.pins.form import parse_pin
from a2g_jax.generation.pins.repair import repair_flips
from a2g_jax.generation.pins.smooth import resample_smoothly
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.onto import face, on_skeleton
from a2g_jax.training.run import Run

#: Metres of a root's path from which its loss is reported.
_TRAVEL = 0.3
#: Jerk of hands that shake, m/s3: twice that of the liveliest talk.
_SHAKY = 2500.0


class Pin(NamedTuple):
    """A clip and its place in time."""

    name: str
    """Its file, for messages."""
    start: float
    """Seconds from the beginning of the speech."""
    motion: Motion
    """On the run's skeleton, at its frame rate."""
    turned: float = 0.0
    """Degrees about the vertical by which it was turned to the facing direction of the run's motions."""
    notes: tuple[str, ...] = ()
    """What was changed in the clip, for the user."""
    fit: ClipFit | None = None
    """Figures of the clip as it is performed."""

    @property
    def first(self) -> int:
        """First frame of the stretch."""
        return round(self.start * self.motion.fps)

    @property
    def stop(self) -> int:
        """Frame after the last one of the stretch."""
        return self.first + self.motion.frames


def read_pin(text: str, run: Run) -> Pin:
    """The clip of a pin: any humanoid BVH, or an NPZ that this package wrote.

    Args:
        text: as :func:`parse_pin` takes it.

    Raises:
        InputError: a file that cannot be read, a rig that is not recognised, a clip that no human body could perform,
            or one shorter than the requested length.
    """
    path, start, length = parse_pin(text)
    return pin_of(read_motion(path), run, str(path), start, length, text=f"--pin {text}")


def pin_of(
    motion: Motion,
    run: Run,
    name: str,
    start: float,
    length: float | None = None,
    *,
    bounds: Bounds | None = None,
    text: str | None = None,
) -> Pin:
    """A motion as a pin: without flips and a calibration pose at its start, retargeted, resampled, and turned.

    Args:
        motion: on any humanoid rig, at any rate.
        name: of the clip.
        start: seconds from the beginning of the speech.
        length: seconds of the clip that are used, from its beginning; None for all.
        bounds: of clips that are performed.
        text: what errors call the clip; by default its name.

    Raises:
        InputError: a rig that is not recognised, a clip that no human body could perform, or one shorter than the
            length.
    """
    config, text = run.config, name if text is None else text
    whole, source = motion, motion.skeleton
    motion, left = without_calibration(whole)
    notes = list(left)
    motion = on_skeleton(motion, config.skeleton, motion.fps, name, whole)
    # One that is held for longer than a calibration is looked for.
    if held := leading_t_pose(motion):
        notes.append(f"its first {held / motion.fps:.2f} s, a T-pose for calibration, left out")
        motion = motion.clip(held, motion.frames)
    # No frame beyond the last one of the clip, which would be held there and stop the motion.
    frames = int((motion.frames - 1) * config.fps / motion.fps + 1e-6) + 1
    if length is not None:
        if round(length * config.fps) > round(motion.seconds * config.fps):
            raise InputError(f"{text}: the clip lasts {motion.seconds:.2f} s; request no more than that.")
        frames = min(frames, round(length * config.fps))
        motion = motion.clip(0, min(motion.frames, int(np.ceil(length * motion.fps)) + 1))
    # Repaired at its own rate: resampling would spread a flip over frames.
    motion, repairs = repair_flips(motion)
    notes += repairs
    motion = resample_smoothly(motion, config.fps, max(frames, 1))
    facing = np.asarray(config.space.mean_rotations(config.statistics["pose"].mean)[0], np.float64)
    motion, turned = face(motion, facing)
    fit = measure_clip(motion, config.space, config.statistics["pose"])
    if reasons := refusals(fit, bounds):
        animal = animal_joints(source)
        if animal:
            reasons.insert(0, f"has joints that people do not have ({', '.join(animal[:2])}); is it an animal?")
        without = f" ({notes[0]})" if left else ""
        raise InputError(f"{text}: {' It also '.join(reasons)}{without}")
    if fit.travel > _TRAVEL:
        notes.append(
            f"its path of {fit.travel:.1f} m along the floor is not kept: the body stays where it stands, and steps are"
            " taken on the spot, so feet that stood may be reported as sliding"
        )
    if fit.jerk_p99 > _SHAKY:
        notes.append(f"its own hands shake (99th percentile of jerk {fit.jerk_p99:.0f} m/s3): filter it at the source")
    return Pin(name, start, motion, turned, tuple(notes), fit)


def check_pins(pins: Sequence[Pin], frames: int, fps: float) -> list[Pin]:
    """The pins in order of time.

    Raises:
        InputError: a pin that ends after the speech, or two that overlap.
    """
    ordered = sorted(pins, key=lambda pin: pin.first)
    for pin in ordered:
        if pin.first >= frames:
            raise InputError(
                f"--pin {pin.name}@{pin.start:g}: begins at {pin.start:.2f} s, the speech ends at {frames / fps:.2f} s;"
                " pin it earlier."
            )
        if pin.stop > frames:
            left = (frames - pin.first) / fps
            raise InputError(
                f"--pin {pin.name}@{pin.start:g}: ends at {pin.stop / fps:.2f} s, the speech at {frames / fps:.2f} s;"
                f" pin it earlier, or only its beginning: {pin.name}@{pin.start:g}+{np.floor(left * 100) / 100:g}."
            )
    for before, after in zip(ordered, ordered[1:], strict=False):
        if after.first < before.stop:
            raise InputError(
                f"--pin {after.name}@{after.start:g}: begins before {before.name} ends at {before.stop / fps:.2f} s;"
                " pins must not overlap."
            )
    return ordered
