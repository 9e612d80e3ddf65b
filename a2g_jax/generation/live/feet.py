"""Standing feet that stay where they are, decided a third of a second ahead."""

from collections import deque
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from a2g_jax.generation.ease import within_bounds
from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.footholds import Leg, bend_legs, find_legs, knee_axis, too_far
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import joint_places, world_rotations
from a2g_jax.geometry.skeleton import BODY_JOINTS
from a2g_jax.training.run_config import RunConfig

#: Width of the Gaussian that smooths the root, seconds, and how far it reaches on either side.
_SMOOTHING, _REACH = 0.1, 0.1
#: Seconds on either side between which the speed of a foot is measured, and of the change between foothold and step.
_SPEED_SPAN, _CHANGE = 0.067, 0.133
#: A foot steps while it moves faster than this, m/s, or is higher than this above its lowest, metres.
_STEP_SPEED, _STEP_HEIGHT = 0.4, 0.05
#: A foothold is left, in as many seconds, when the model's foot is so far from it, metres and degrees.
_FARTHEST, _TURNED, _LEAVING = 0.2, 45.0, 0.6
#: The lowest height of a foot rises at this speed, m/s, and a lowered root with this time constant, seconds.
_RISE, _RAISE = 0.01, 0.4


class _Frame(NamedTuple):
    """A pose with its root above the feet."""

    rotations: Float[np.ndarray, "J 3 3"]
    root: Float[np.ndarray, " 3"]


class Feet:
    """The motion of local rotations that arrive a few frames at a time: a root over the feet, and feet that stand.

    The causal form of :func:`~a2g_jax.geometry.ground.plant_feet` and :func:`~a2g_jax.geometry.footholds.lock_feet`:
    the root is smoothed over 0.2 s; a foothold is the mean of the first moments of a stand, and a foot moves over to
    it, or to its own path before it steps, in 0.13 s. Spine, arms and head are kept within the bounds of the body.
    """

    def __init__(self, config: RunConfig, hop: int) -> None:
        """
        Args:
            hop: frames of every call.
        """
        self.config, self.hop = config, hop
        self._bounds = config.body_bounds
        self._skeleton, fps = config.skeleton, config.fps
        self._mean = config.space.mean_rotations(config.statistics["pose"].mean)
        self._start = np.array([0.0, float(np.asarray(config.statistics["root"].mean)[1]), 0.0])
        still = Motion(self._mean[None], self._start[None].astype(np.float32), self._skeleton, fps)
        body = find_body_joints(self._skeleton)
        self._ankles = [] if body is None else [body[BODY_JOINTS.index(f"{side}_Ankle")] for side in "LR"]
        legs = find_legs(still)
        self._axes = {leg: knee_axis(still, leg) for leg in legs}
        places = self._places(np.asarray(self._mean, np.float64)[None], self._start[None])[1]
        self._middle = places[0, self._ankles].mean(axis=0) if self._ankles else self._start
        reach = max(1, round(_REACH * fps)) if self._ankles else 0
        self._reach = reach
        weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (_SMOOTHING * fps)) ** 2)
        self._weights = weights / weights.sum()
        self._span = max(1, round(_SPEED_SPAN * fps))
        self._lead = max(1, round(_CHANGE * fps))
        self._tracks = [_Foot(leg, float(places[0, leg.ankle, 1]), fps, self._lead) for leg in legs]
        #: Frames between the last pose that arrived and the last one of the motion.
        self.delay = reach + (self._span + self._lead if legs else 0)
        self._lower = 0.0
        # Roots before smoothing, and frames with smoothed ones, as many as later frames need.
        self._rough: deque[_Frame] = deque(maxlen=2 * reach + 1)
        self._planted: deque[tuple[_Frame, np.ndarray, np.ndarray]] = deque(maxlen=2 * self._span + self._lead + 1)
        self._skipped = 0

    def push(self, rotations: Float[np.ndarray, "hop J 3 3"]) -> Motion:
        """The next frames of the motion: as many as have arrived, and ``delay`` fewer at the start."""
        frames = []
        eased = within_bounds(rotations, self._bounds)
        under = self._places(eased, np.zeros((len(eased), 3)))[1]
        for turned, joints in zip(eased, under, strict=True):
            root = self._middle - joints[self._ankles].mean(axis=0) if self._ankles else self._start
            frames.append(_Frame(turned, root))
        planted = [self._smoothed(frame) for frame in frames]
        goals = [self._goals(frame) for frame in planted]
        motion = self._bent(goals) if self._tracks else self._motion(planted)
        dropped = min(self.delay - self._skipped, self.hop)
        self._skipped += dropped
        return motion.clip(dropped, self.hop)

    def _places(self, rotations: np.ndarray, root: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        parents = self._skeleton.parents
        world = world_rotations(rotations, parents)
        offsets = np.asarray(self._skeleton.offsets, np.float64)
        return world, joint_places(world, offsets, parents) + root[:, None]

    def _smoothed(self, frame: _Frame) -> _Frame:
        """The frame in the middle of those that its root is smoothed over; before the first frame is the same."""
        while len(self._rough) < 2 * self._reach:
            self._rough.append(frame)
        self._rough.append(frame)
        root = self._weights @ np.stack([one.root for one in self._rough])
        return _Frame(self._rough[len(self._rough) // 2].rotations, root)

    def _goals(self, frame: _Frame) -> tuple[_Frame, np.ndarray, np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
        """The frame that the feet are decided for, its joints, and where each ankle goes."""
        world, places = (array[0] for array in self._places(frame.rotations[None], frame.root[None]))
        while len(self._planted) < 2 * self._span + self._lead:
            self._planted.append((frame, world, places))
        self._planted.append((frame, world, places))
        goals = []
        for foot in self._tracks:
            ankle = foot.leg.ankle
            ahead = list(self._planted)
            path = np.stack([joints[ankle] for _, _, joints in ahead])
            turns = np.stack([turned[ankle] for _, turned, _ in ahead])
            goals.append(foot.goal(path, turns, self._span))
        return (*self._planted[self._span], goals)

    def _bent(self, goals: list) -> Motion:
        """The frames with their legs bent for the goals."""
        planted = self._motion([frame for frame, *_ in goals])
        world, places = np.stack([one[1] for one in goals]), np.stack([one[2] for one in goals])
        wanted = {
            foot.leg: (np.stack([one[3][n][0] for one in goals]), np.stack([one[3][n][1] for one in goals]))
            for n, foot in enumerate(self._tracks)
        }
        needed = np.max([too_far(planted, leg, places[:, leg.hip], to) for leg, (to, _) in wanted.items()], axis=0)
        stays = float(np.exp(-1.0 / (_RAISE * self.config.fps)))
        lower = np.zeros(len(goals))
        for number, value in enumerate(needed):
            self._lower = lower[number] = max(float(value), self._lower * stays)
        return bend_legs(planted, places, world, wanted, lower, self._axes)

    def _motion(self, frames: list[_Frame]) -> Motion:
        rotations = np.stack([frame.rotations for frame in frames]).astype(np.float32)
        root = np.stack([frame.root for frame in frames]).astype(np.float32)
        return Motion(rotations, root, self._skeleton, self.config.fps)


class _Foot:
    """A foot that stands or steps."""

    def __init__(self, leg: Leg, lowest: float, fps: float, lead: int) -> None:
        self.leg, self._fps, self._lead = leg, fps, lead
        self._lowest = lowest
        #: Weight of the foothold, from 0 to 1, before it is smoothed.
        self._weight = 1.0
        self._place: np.ndarray | None = None
        self._turn: np.ndarray | None = None
        self._leaves = False

    def goal(
        self, path: Float[np.ndarray, "frames 3"], turns: Float[np.ndarray, "frames 3 3"], span: int
    ) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "3 3"]]:
        """Where the ankle goes in frame ``span`` of a path, and how it is turned.

        Args:
            path: of the model's ankle, ``lead + span`` frames after that one included.
            turns: its orientations.
        """
        height = path[span, 1]
        self._lowest = min(height, self._lowest + _RISE / self._fps)
        ahead = path[span : span + self._lead + 1]
        moved = (path[2 * span :] - path[: len(path) - 2 * span])[:, [0, 2]]
        speed = np.linalg.norm(moved, axis=-1).max() * self._fps / (2 * span)
        stands = speed <= _STEP_SPEED and ahead[:, 1].max() <= self._lowest + _STEP_HEIGHT
        if self._place is None or (self._weight == 0.0 and stands):
            self._place = ahead.mean(axis=0)
            self._turn = Rotation.from_matrix(turns[span : span + self._lead + 1]).mean().as_matrix()
            self._leaves = False
        own = Rotation.from_matrix(turns[span])
        turn = (Rotation.from_matrix(self._turn) * own.inv()).as_rotvec()
        off, turned = self._place - path[span], np.degrees(np.linalg.norm(turn))
        self._leaves |= bool(np.linalg.norm(off) > _FARTHEST or turned > _TURNED)
        step = 1.0 / self._lead
        if stands and self._leaves:
            step = -1.0 / (_LEAVING * self._fps)
        elif not stands:
            step = -step
        u = self._weight = float(np.clip(self._weight + step, 0.0, 1.0))
        share = u * u * (3.0 - 2.0 * u)
        return path[span] + share * off, (Rotation.from_rotvec(share * turn) * own).as_matrix()
