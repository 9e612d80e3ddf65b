"""Feet of a motion with pinned clips: they stand where they stood, unless a clip steps itself."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.footholds import Goal, Leg, find_legs, steps
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle, world_rotations

#: A foot that the clip turns by more than this against the generated one would twist its leg, degrees.
_TWIST = 35.0
#: Share of a transition that each foot takes for a step, and metres that it is lifted for a step of ten centimetres.
_STEP, _LIFT = 0.6, 0.05
#: Width of the Gaussian for the height of a stepping body, seconds.
_SMOOTHING = 0.07


@dataclass(frozen=True)
class Feet:
    """Paths of both ankles."""

    legs: tuple[Leg, ...]
    places: Float[np.ndarray, "legs T 3"]
    world: Float[np.ndarray, "legs T 3 3"]

    def middle(self) -> Float[np.ndarray, " 3"]:
        """Mean place between the ankles."""
        middle: Float[np.ndarray, " 3"] = self.places.mean(axis=(0, 1))
        return middle


def feet_of(motion: Motion) -> Feet | None:
    """The ankles of a motion; None for skeletons without legs of hip, knee and ankle."""
    legs = tuple(find_legs(motion))
    if not legs:
        return None
    places = motion.positions().astype(np.float64)
    world = world_rotations(np.asarray(motion.rotations, np.float64), motion.skeleton.parents)
    return Feet(legs, np.stack([places[:, leg.ankle] for leg in legs]), np.stack([world[:, leg.ankle] for leg in legs]))


def steps_itself(clip: Feet, plain: Feet, fps: float) -> bool:
    """Whether a clip needs feet of its own: it steps, or stands turned against the motion around it.

    Args:
        plain: of the generated motion in the same frames.
    """
    if any(steps(path, fps).any() for path in clip.places):
        return True
    return bool(np.median(rotation_angle(clip.world, plain.world), axis=1).max() > _TWIST)


def lifted(clip: Feet, plain: Feet, fps: float) -> Float[np.ndarray, " n"]:
    """Metres by which a clip has to be higher for its lower ankle not to be below those of the motion around it."""
    depth = np.maximum(plain.places[:, :, 1].mean() - clip.places[:, :, 1].min(axis=0), 0.0)
    smooth: Float[np.ndarray, " n"] = gaussian_filter1d(depth, _SMOOTHING * fps, mode="nearest")
    return smooth


def share_of_clip(before: int, inside: int, after: int, leg: int, ends: tuple[bool, bool]) -> Float[np.ndarray, " n"]:
    """Weight of a clip's own foot in its transitions and between them; one foot steps after the other.

    Args:
        before: frames of the transition before the clip, ``after`` of that after it.
        leg: 0 for the foot that steps first.
        ends: whether either transition ends in the generated motion; else the weight stays 1.
    """
    start = 0.0 if leg == 0 else 1.0 - _STEP
    rise = _smooth((np.arange(before) / max(before, 1) - start) / _STEP) if ends[0] else np.ones(before)
    fall = 1.0 - _smooth((np.arange(1, after + 1) / max(after, 1) - start) / _STEP) if ends[1] else np.ones(after)
    return np.concatenate([rise, np.ones(inside), fall])


def step_over(
    place: Float[np.ndarray, "n 3"],
    world: Float[np.ndarray, "n 3 3"],
    own_place: Float[np.ndarray, "n 3"],
    own_world: Float[np.ndarray, "n 3 3"],
    share: Float[np.ndarray, " n"],
) -> Goal:
    """An ankle on its way between two paths, lifted in between."""
    way = own_place - place
    moved = place + share[:, None] * way
    far = np.linalg.norm(way[:, [0, 2]], axis=-1)
    moved[:, 1] += _LIFT * np.minimum(far / 0.1, 1.0) * 64.0 * (share * (1.0 - share)) ** 3
    turn = Rotation.from_matrix(own_world @ np.swapaxes(world, -1, -2)).as_rotvec()
    return moved, Rotation.from_rotvec(share[:, None] * turn).as_matrix() @ world


def _smooth(u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    u = np.clip(u, 0.0, 1.0)
    smooth: Float[np.ndarray, " n"] = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    return smooth
