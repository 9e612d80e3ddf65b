"""The bounds of a body once more, written independently of the package: frames of a file that are outside.

Rotations go through SciPy and positions through a loop over joints, in double precision; only the bounds themselves,
from ``checks.json``, and the names of joints are shared with :mod:`a2g_jax.metrics.body`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from a2g_jax.io.files import read_json
from a2g_jax.training.run import Run

#: Relative excess over a bound below which the two may differ: positions of the package are in single precision.
SLACK = 2e-3
_LEAST = {"sink": 1e-4, "lift": 1e-4, "slide": 1e-4, "turn": 0.5, "wrist_jerk": 5.0}


class Judge:
    """Figures of motions of one run's body."""

    def __init__(self, run: Run) -> None:
        config = run.config
        skeleton = config.skeleton
        self.names = list(skeleton.names)
        self.parents, self.offsets = skeleton.parents, np.asarray(skeleton.offsets, np.float64)
        self.rest = np.asarray(config.space.mean_rotations(config.statistics["pose"].mean), np.float64)
        root = np.array([[0.0, float(config.statistics["root"].mean[1]), 0.0]])
        self.world, self.places = (part[0] for part in self.pose(self.rest[None], root))

    def pose(
        self, rotations: Float[np.ndarray, "T J 3 3"], root: Float[np.ndarray, "T 3"]
    ) -> tuple[Float[np.ndarray, "T J 3 3"], Float[np.ndarray, "T J 3"]]:
        """Orientations and positions of all joints."""
        world, places = np.array(rotations, np.float64), np.zeros((*rotations.shape[:2], 3))
        places[:, 0] = root
        for joint, parent in list(enumerate(self.parents))[1:]:
            world[:, joint] = world[:, parent] @ rotations[:, joint]
            places[:, joint] = places[:, parent] + world[:, parent] @ self.offsets[joint]
        return world, places

    def hinge(
        self, rotations: Float[np.ndarray, "T J 3 3"], above: str, joint: str, below: str
    ) -> tuple[Float[np.ndarray, " T"], Float[np.ndarray, " T"]]:
        """Flexion, and angle out of its plane, degrees, from the lower bone's direction in a frame of the upper one."""
        at, under = self.names.index(joint), self.names.index(below)
        along = self.offsets[at] / np.linalg.norm(self.offsets[at])
        bone = self.offsets[under] / np.linalg.norm(self.offsets[under])
        axis = np.cross(along, self.rest[at] @ bone)
        bent = np.degrees(np.arccos(np.clip(along @ self.rest[at] @ bone, -1.0, 1.0)))
        if bent <= (10.0 if below.endswith("Wrist") else 15.0) or bent >= 170.0:
            if not below.endswith("Ankle"):
                return np.full(len(rotations), -np.inf), np.full(len(rotations), -np.inf)
            toe = self.offsets[self.names.index(below.replace("Ankle", "Foot"))]
            axis = np.cross(self.world[self.names.index(above)].T @ (self.world[under] @ toe), along)
        axis = axis / np.linalg.norm(axis)
        forward = np.cross(axis, along)  # where the lower bone goes as the joint bends
        lower = rotations[:, at] @ bone
        flexion = np.degrees(np.arctan2(lower @ forward, lower @ along))
        return flexion, np.degrees(np.arcsin(np.clip(np.abs(lower @ axis), 0.0, 1.0)))

    def figures(
        self, rotations: Float[np.ndarray, "T J 3 3"], root: Float[np.ndarray, "T 3"], fps: float
    ) -> dict[tuple[str, str], Float[np.ndarray, " T"]]:
        """Each figure of each joint by frame; minus infinity where it is not defined."""
        frames = len(rotations)
        found: dict[tuple[str, str], Float[np.ndarray, " T"]] = {}
        # A rotation matrix in single precision is not quite orthogonal.
        turns = [Rotation.from_matrix(rotations[:, joint]) for joint in range(len(self.names))]
        for joint, name in enumerate(self.names):
            turn = np.full(frames, -np.inf)
            turn[1:] = np.degrees((turns[joint][:-1].inv() * turns[joint][1:]).magnitude()) * fps
            found["turn", name] = turn
            if joint:
                mean = Rotation.from_matrix(self.rest[joint])
                found["range", name] = np.degrees((mean.inv() * turns[joint]).magnitude())
        up = self.rest[0].T @ np.array([0.0, 1.0, 0.0])
        now = np.swapaxes(rotations[:, 0], -1, -2) @ np.array([0.0, 1.0, 0.0])
        found["tilt", self.names[0]] = np.degrees(np.arccos(np.clip(now @ up, -1.0, 1.0)))
        for side in "LR":
            arm = self.hinge(rotations, f"{side}_Shoulder", f"{side}_Elbow", f"{side}_Wrist")
            leg = self.hinge(rotations, f"{side}_Hip", f"{side}_Knee", f"{side}_Ankle")
            for name, (flexion, sideways) in ((f"{side}_Elbow", arm), (f"{side}_Knee", leg)):
                found["bend", name], found["backwards", name], found["sideways", name] = flexion, -flexion, sideways
        _, places = self.pose(rotations, root)
        at = lambda name: places[:, self.names.index(name)]  # noqa: E731
        step = lambda path: np.concatenate([[-np.inf], np.linalg.norm(path[1:] - path[:-1], axis=1) * fps])  # noqa: E731
        found["root_speed", self.names[0]] = step(places[:, 0])
        for wrist in ("L_Wrist", "R_Wrist"):
            path = at(wrist) - places[:, 0]
            found["wrist_speed", wrist] = step(path)
            third = np.full(frames, -np.inf)
            third[2:-1] = np.linalg.norm(path[3:] - 3 * path[2:-1] + 3 * path[1:-2] - path[:-3], axis=1) * fps**3
            found["wrist_jerk", wrist] = third
        feet = ("L_Ankle", "R_Ankle", "L_Foot", "R_Foot")
        heights = {name: at(name)[:, 1] - self.places[self.names.index(name), 1] for name in feet}
        found["lift", self.names[0]] = np.min(list(heights.values()), axis=0)
        for name, height in heights.items():
            found["sink", name] = -height
            found["slide", name] = _slide(at(name), fps)
        return found

    def outside(
        self, rotations: Float[np.ndarray, "T J 3 3"], root: Float[np.ndarray, "T 3"], checks: Mapping[str, Any]
    ) -> dict[tuple[str, str], Bool[np.ndarray, " T"]]:
        """Frames outside the bounds of ``checks.json``, by figure and joint; those with NaN as ``finite``."""
        bad = ~np.isfinite(rotations).all(axis=(1, 2, 3)) | ~np.isfinite(root).all(axis=1)
        if bad.any():
            return {("finite", ""): bad}
        found = {}
        for (name, joint), values in self.figures(rotations, root, float(checks["fps"])).items():
            high = np.full(len(values), float(checks["bounds"][name][joint]))
            for one in checks.get("stretches", ()):
                rows = slice(one["first"], one["stop"])
                high[rows] = np.maximum(high[rows], one["bounds"][name][joint])
            flags = values > high + np.maximum(SLACK * np.abs(high), _LEAST.get(name, 0.05))
            if flags.any():
                found[name, joint] = flags
        return found


def unreported(folder: Path, judge: Judge) -> tuple[int, int]:
    """Frames of the samples in a folder that are outside their bounds, and those of them that no finding covers.

    Args:
        folder: with ``sample_*.npz`` and ``checks.json``.
    """
    checks = read_json(folder / "checks.json")
    outside = missing = 0
    paths = sorted(folder.glob("sample_*.npz"))
    if len(paths) != len(checks["samples"]):
        raise ValueError(f"{folder}: {len(paths)} files and {len(checks['samples'])} reports")
    for path, report in zip(paths, checks["samples"], strict=True):
        with np.load(path, allow_pickle=False) as arrays:
            rotations, root = arrays["rotations"].astype(np.float64), arrays["root"].astype(np.float64)
        bad, covered = np.zeros((2, len(rotations)), bool)
        for (name, joint), flags in judge.outside(rotations, root, checks).items():
            bad |= flags
            reported = np.zeros(len(rotations), bool)
            for finding in report["findings"]:
                if (finding["figure"], finding["joint"]) == (name, joint):
                    reported[finding["first"] : finding["stop"]] = True
            covered |= flags & ~reported
        outside, missing = outside + int(bad.sum()), missing + int(covered.sum())
    return outside, missing


def _slide(path: Float[np.ndarray, "T 3"], fps: float) -> Float[np.ndarray, " T"]:
    """Metres along the floor in the half second before each frame, if the foot stood in all of it."""
    span = max(1, round(0.5 * fps))
    low = path[:, 1] < np.percentile(path[:, 1], 5.0) + 0.03
    stands = low & (np.abs(np.gradient(path[:, 1])) * fps < 0.1) if len(path) > 1 else low
    slide = np.full(len(path), -np.inf)
    for frame in range(span, len(path)):
        if stands[frame - span : frame + 1].all():
            slide[frame] = np.hypot(*(path[frame] - path[frame - span])[[0, 2]])
    return slide
