"""Units of a report: ours, or those of a paper's tables, so that its figures can be compared in value."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton
from a2g_jax.metrics.beats import FLOW_SIGMA_FRAMES, SIGMA, frames_to_seconds
from a2g_jax.metrics.pointwise import REFERENCE_WRIST_TO_WRIST
from a2g_jax.metrics.registry import Metric

#: SMPL-X joints that a body joint stands for where only body joints move: the wrist and 15 finger joints; the head, jaw
#: and eyes.
_RIDERS = {"L_Wrist": 16, "R_Wrist": 16, "Head": 4}


@dataclass(frozen=True)
class Units:
    """How distances are averaged over coordinates, joints and pairs, and the unit of time."""

    key: str
    describe: str
    """What differs from our units, for a report."""
    axis_mean: bool = False
    """Whether an L1 distance is the mean over x, y, z instead of their sum."""
    per_frame: bool = False
    """Whether speeds and accelerations are per frame, in centimetres, instead of per second."""
    published_pairs: bool = False
    """Whether sums over pairs are divided by N ceil(N / 2), as printed in Eq. 26 and 27, instead of N (N - 1) / 2."""
    smplx_joints: bool = False
    """Whether means over joints weight body joints as in a mean over all 55 joints of SMPL-X whose fingers, jaw and
    eyes do not move of their own."""
    reference: float | None = None
    """Distance of the wrists in T-pose, metres, of the skeleton that lengths are scaled to (Eq. 23); None for none."""
    beat_sigma: float = SIGMA
    """Tolerance of the beat alignment from motion to audio, seconds."""
    beat_sigma_frames: float | None = None
    """That tolerance in frames, where a paper counts in frames; it takes the place of the seconds."""

    def beat_tolerance(self, fps: float) -> float:
        """Tolerance of the beat alignment from motion to audio, seconds, for motion of a frame rate."""
        return self.beat_sigma if self.beat_sigma_frames is None else frames_to_seconds(self.beat_sigma_frames, fps)

    def axis_share(self, axes: int) -> float:
        """Factor from a sum over coordinates to these units."""
        return 1.0 / axes if self.axis_mean else 1.0

    def weights(self, body: object) -> Float[np.ndarray, " J"] | None:
        """Weights of a body's joints, with a sum of 1; None where all count alike."""
        return smplx_weights(body) if self.smplx_joints and isinstance(body, Skeleton) else None

    def shown(self, metric: Metric) -> Metric:
        """The metric with the unit and decimals that its values have in these units."""
        unit = {"speed_l1": "cm/frame", "acceleration_l1": "cm/frame2"}.get(metric.key) if self.per_frame else None
        return metric if unit is None else replace(metric, unit=unit, digits=3)


def smplx_weights(skeleton: Skeleton) -> Float[np.ndarray, " J"] | None:
    """Weights of joints as in a mean over SMPL-X's 55 joints of a body whose fingers, jaw and eyes do not move.

    The 15 finger joints of a hand count as its wrist, jaw and eyes as the head. Joints that are not body joints have no
    weight of their own. None where the body joints are not found.
    """
    body = find_body_joints(skeleton)
    if body is None:
        return None
    weights = np.zeros(skeleton.joints)
    weights[list(body)] = [_RIDERS.get(name, 1) for name in BODY_JOINTS]
    return (weights / weights.sum()).astype(np.float32)


OURS = Units("ours", "")

#: By the name of ``a2g evaluate --units``.
UNITS: dict[str, Units] = {
    units.key: units
    for units in (
        OURS,
        Units(
            "audio2gestures",
            "Units of Audio2Gestures' tables: L1 distances are means over coordinates and over SMPL-X's 55 joints"
            " (fingers count as their wrist, jaw and eyes as the head), on a skeleton of 120.64 cm from wrist to wrist"
            " (Eq. 23); speeds and accelerations are per frame; pairs are divided by N ceil(N / 2).",
            axis_mean=True,
            per_frame=True,
            published_pairs=True,
            smplx_joints=True,
            reference=REFERENCE_WRIST_TO_WRIST,
        ),
        Units(
            "stylized-flow",
            "Units of the flow paper's tables: L1 distances are means over coordinates; the tolerance of beat alignment"
            " is 5 frames.",
            axis_mean=True,
            beat_sigma_frames=FLOW_SIGMA_FRAMES,
        ),
    )
}


def find_units(name: str) -> Units:
    """The units of that name.

    Raises:
        InputError: there are none of that name.
    """
    if name not in UNITS:
        raise InputError(f"--units: there are no {name!r}; there are: {', '.join(UNITS)}.")
    return UNITS[name]
