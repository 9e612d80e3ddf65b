"""Clips as a trained flow can use them: adapted to its training motion, or refused by name with the figure."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.generation.clip_fit import Bounds, ClipFit
from a2g_jax.generation.pins.request import pin_of
from a2g_jax.generation.stylized_flow.into_range import Ranges, rows_into_range
from a2g_jax.generation.stylized_flow.turning import without_turning
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_track import represent
from a2g_jax.metrics.hands import hand_speeds, local_places
from a2g_jax.training.run import Run

#: Shortest clip that a style is taken from, seconds: shorter ones have a pose or two, and no style.
SHORTEST = 1.0
#: Mean speed of the faster hand of gesturing people, m/s; generated talk has 0.3 to 0.9.
_SLOWEST, _FASTEST = 0.03, 2.0


@dataclass(frozen=True)
class Adapted:
    """Changes to a clip for the flow."""

    turned: float = 0.0
    """Degrees about the vertical, to the facing direction of the run."""
    turning: float = 0.0
    """Range of the heading that was removed, degrees."""
    posture: float = 0.0
    """Largest removed offset of a channel, standard deviations of training poses."""
    amplitude: float = 1.0
    """Smallest factor on a channel's deviations from the clip's posture."""
    clipped: float = 0.0
    """Share of values that were clipped to the range of training poses."""
    latents: float = 1.0
    """Root mean square of the latents that are used, relative to those of the adapted clip."""

    def describe(self) -> str:
        """The changes for the terminal; empty if all are small."""
        parts = [f"turned by {self.turned:.0f} degrees"] if abs(self.turned) >= 15.0 else []
        if self.turning > 0:
            parts.append(f"{self.turning:.0f} degrees of turning about removed")
        if self.posture >= 0.5:
            parts.append(f"posture moved by up to {self.posture:.1f} standard deviations")
        if self.amplitude < 0.9:
            parts.append(f"amplitude of a joint reduced to {self.amplitude:.0%}")
        if self.latents < 0.9:
            parts.append(f"its latents to {self.latents:.0%}")
        return ", ".join(parts)


@dataclass(frozen=True, eq=False)
class Fitted:
    """A clip on a run's skeleton, and the poses that the flow is given."""

    motion: Motion
    """The clip itself, flips repaired and facing as the run's motions do."""
    rows: Float[np.ndarray, "T R D"]
    """Its poses within the range of the training motion."""
    figures: ClipFit
    """Before it was adapted."""
    adapted: Adapted
    notes: tuple[str, ...] = ()
    """Repairs and warnings, for the user."""
    code: float | None = None
    """Size of the adapted clip's latents, median over frames of the root mean square: 1 for draws, 0.6 to 0.9 for
    motion like that of training. None before it is encoded."""

    def as_json(self) -> dict[str, Any]:
        """Figures of the clip and changes to it."""
        return {"figures": self.figures.as_json(), "code": self.code, "adapted": asdict(self.adapted)}


def fit(motion: Motion, run: Run, name: str, *, whole: bool = True) -> Fitted:
    """A clip that a run's flow can encode or continue.

    It is retargeted, resampled and turned to face as the run's motions do, and short flips are repaired. Turning about
    is removed, and posture and amplitude are moved into the range of the training motion, where the run holds it. A
    clip that needs none of this is unchanged.

    Args:
        motion: on any humanoid rig, at any rate.
        name: for messages, such as ``--style clip.bvh``.
        whole: whether it is the clip of a style, a second long or more, and not only seed poses.

    Raises:
        InputError: a rig that is not recognised, a clip that no human body could perform, or hands that are still or
            faster than people gesture.
    """
    config = run.config
    clip = pin_of(motion, run, name, 0.0, bounds=Bounds(shortest=SHORTEST if whole else 0.0))
    assert clip.fit is not None
    facing = np.asarray(config.space.mean_rotations(config.statistics["pose"].mean)[0], np.float64)
    sound, turning = without_turning(clip.motion, facing)
    _refuse_speed(sound, name, whole)
    rows = represent(sound, config.space.kind, name)[0]
    adapted, ranges = Adapted(clip.turned, turning), Ranges.of(run)
    if ranges is not None:
        rows, moved = rows_into_range(run, rows, ranges)
        adapted = replace(
            adapted,
            posture=float(np.abs(moved.offset).max()),
            amplitude=float(moved.amplitude.min()),
            clipped=moved.clipped,
        )
    return Fitted(sound, rows, clip.fit, adapted, clip.notes)


def _refuse_speed(motion: Motion, name: str, whole: bool) -> None:
    speeds = hand_speeds(local_places(motion), motion.skeleton, motion.fps)
    speed = float(speeds.mean()) if len(speeds) else 0.0
    if whole and speed < _SLOWEST:
        raise InputError(
            f"{name}: its hands move at {speed:.2f} m/s on average; give a clip in which a person gestures."
        )
    if speed > _FASTEST:
        raise InputError(
            f"{name}: its faster hand moves at {speed:.1f} m/s on average, and people who gesture stay below"
            f" {_FASTEST:g}; check its frame rate, and filter noise."
        )
