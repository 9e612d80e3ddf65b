"""From the channels of a BVH file to bones of fixed length, rotations, and the path of the root."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.euler import euler_matrices
from a2g_jax.geometry.joint_names import named_joints, parse_name
from a2g_jax.geometry.retarget.poses import joint_places, world_rotations
from a2g_jax.io.bvh_hierarchy import Joint, Stretch

#: A position channel below the root moves if it varies by more than this share of the size of the skeleton (a
#: millimetre of a person).
_MOVES = 6e-4
#: Position channels of this share of the bones are differences to OFFSET.
_RELATIVE = 0.01
#: Frames in which the joint that carries the path is chosen, and joints down from the root that may be it.
_SAMPLE, _DEEPEST = 200, 6
#: A branch of fewer joints beside the body is a helper: ground contact, targets.
_HELPER = 3


@dataclass(frozen=True, eq=False)
class Poses:
    """A motion in the unit of the file."""

    offsets: Float[np.ndarray, "J 3"]
    rotations: Float[np.ndarray, "T J 3 3"]
    root: Float[np.ndarray, "T 3"]
    carrier: int
    """The joint whose position channels hold the path of the body; that path is in ``root``."""
    still_root: tuple[float, float, float] | None
    """Position of a root that does not move in the file; None if it moves."""
    stretch: Stretch | None
    """In units of the file in place of metres."""


def poses_of(joints: list[Joint], values: Float[np.ndarray, "T C"]) -> Poses:
    """Bones, rotations and root path of the numbers of a file.

    Position channels of the root are its place. Those of other joints that stay the same are bones. Of those that move,
    one joint's may be the path of the whole body, as the hips' below a root that stays on the floor: the root then
    takes over the path, and everything below the joint is exactly where it is in the file. Other bones that move have
    their mean length, and :attr:`Poses.stretch` tells how far that is from the file.
    """
    rest = np.array([joint.offset for joint in joints], np.float64)
    offsets = rest.copy()
    root = np.tile(rest[0], (len(values), 1))
    angles: dict[str, list[tuple[int, list[int]]]] = {}
    positions: dict[int, dict[int, int]] = {}
    column = 0
    for index, joint in enumerate(joints):
        order, columns = "", []
        for channel in joint.channels or ():
            axis = "XYZ".index(channel[0])
            if channel.endswith("rotation"):
                order += channel[0]
                columns.append(column)
            elif index == 0:
                root[:, axis] = values[:, column]
            else:
                positions.setdefault(index, {})[axis] = column
            column += 1
        if order:
            angles.setdefault(order, []).append((index, columns))
    rotations = np.broadcast_to(np.eye(3, dtype=np.float32), (len(values), len(joints), 3, 3)).copy()
    for order, members in angles.items():
        indices = [index for index, _ in members]
        rotations[:, indices] = euler_matrices(values[:, [columns for _, columns in members]], order)

    moving = _set_bones(joints, values, rest, offsets, positions)
    still = root[0] if np.ptp(root, axis=0).max(initial=0.0) <= _MOVES * extent(joints, rest) else None
    carrier, stretch = 0, None
    if moving:
        moves = _Moves(joints, values, rotations, root, positions, moving)
        carrier, offsets, root, stretch = moves.solve(rest, offsets)
    still_root = None if still is None or not carrier else (float(still[0]), float(still[1]), float(still[2]))
    return Poses(offsets, rotations, root, carrier, still_root, stretch)


def _set_bones(joints, values, rest, offsets, positions) -> list[int]:
    """Set ``offsets`` to the means of position channels, and return the joints whose channels move."""
    if not positions:
        return []
    near_zero = [
        bool(np.abs(values[:, list(columns.values())]).max() <= _RELATIVE * np.abs(rest[index]).max())
        for index, columns in positions.items()
        if np.any(rest[index])
    ]
    if near_zero and np.mean(near_zero) > 0.5:
        # Differences to OFFSET: a skeleton whose bones have no length makes no sense.
        for index, columns in positions.items():
            for axis, column in columns.items():
                values[:, column] += rest[index, axis]
    moves = _MOVES * extent(joints, rest)
    moving = []
    for index, columns in positions.items():
        block = values[:, list(columns.values())]
        offsets[index, list(columns)] = block.mean(axis=0)
        if np.ptp(block, axis=0).max() > max(moves, 1e-9):
            moving.append(index)
    return moving


class _Moves:
    """Motion with bones that move, against bones that do not."""

    def __init__(self, joints, values, rotations, root, positions, moving) -> None:
        self.joints, self.values, self.root, self.positions, self.moving = joints, values, root, positions, moving
        self.parents = tuple(joint.parent for joint in joints)
        self.world = world_rotations(rotations.astype(np.float64), self.parents)

    def solve(self, rest, means) -> tuple[int, Float[np.ndarray, "J 3"], Float[np.ndarray, "T 3"], Stretch | None]:
        """The joint that carries the path, bones, root path, and the error of the joints' places."""
        chain = self._chain()
        rows = np.unique(np.linspace(0, len(self.values) - 1, _SAMPLE).astype(int))
        true = self._true(means)
        best, least = 0, np.inf
        for carrier in [0, *(joint for joint in chain if joint in self.moving and self._holds_body(chain, joint))]:
            bones = self._bones(chain, carrier, rest, means)
            total = float(np.linalg.norm(self._errors(true, bones, carrier, rows), axis=-1).mean(axis=0).sum())
            if total < 0.95 * least:
                best, least = carrier, total
        bones = self._bones(chain, best, rest, means)
        errors = np.linalg.norm(self._errors(true, bones, best, slice(None)), axis=-1)
        errors[:, self._helpers(chain, best)] = 0.0
        frame, joint = np.unravel_index(int(np.argmax(errors)), errors.shape)
        others = [one for one in self.moving if one not in chain[: chain.index(best) + 1]]
        root = true[:, best] - joint_places(self.world, bones, self.parents)[:, best]
        largest = float(errors[frame, joint])
        stretch = Stretch(self.joints[joint].name, int(frame), largest, len(others)) if others else None
        return best, bones, root, stretch

    def _chain(self) -> list[int]:
        """Joints from the root down the largest branch."""
        count = np.ones(len(self.parents), int)
        for joint in range(len(self.parents) - 1, 0, -1):
            count[self.parents[joint]] += count[joint]
        chain = [0]
        while len(chain) < _DEEPEST:
            below = [joint for joint, parent in enumerate(self.parents) if parent == chain[-1]]
            if not below:
                break
            chain.append(max(below, key=lambda joint: count[joint]))
        return chain

    def _true(self, means) -> Float[np.ndarray, "T J 3"]:
        """Places of all joints as the file has them."""
        places = np.zeros((len(self.values), len(self.joints), 3))
        places[:, 0] = self.root
        for joint, parent in enumerate(self.parents[1:], start=1):
            bone = np.tile(means[joint], (len(places), 1))
            if joint in self.moving:
                for axis, column in self.positions[joint].items():
                    bone[:, axis] = self.values[:, column]
            places[:, joint] = places[:, parent] + (self.world[:, parent] @ bone[:, :, None])[..., 0]
        return places

    def _bones(self, chain, carrier, rest, means) -> Float[np.ndarray, "J 3"]:
        # The mean of a bone that carries a path depends on the path; OFFSET does not.
        bones = means.copy()
        for joint in chain[1 : chain.index(carrier) + 1]:
            if joint in self.moving:
                bones[joint] = rest[joint]
        return bones

    def _errors(self, true, bones, carrier, rows) -> Float[np.ndarray, "T J 3"]:
        places = joint_places(self.world[rows], bones, self.parents)
        places += (true[rows, carrier] - places[:, carrier])[:, None]
        return places - true[rows]

    def _inside(self, carrier) -> set[int]:
        """The carrier and all joints below it."""
        inside = {carrier}
        for joint, parent in enumerate(self.parents):
            if parent in inside:
                inside.add(joint)
        return inside

    def _holds_body(self, chain, carrier) -> bool:
        """Whether a joint's path is that of the body: arms and legs hang below it, or nothing but helpers beside it."""
        inside, roles = self._inside(carrier), named_joints([joint.name for joint in self.joints])
        limbs = [roles.get(f"{side}_{part}", -1) for side in "LR" for part in ("Shoulder", "Hip")]
        if min(limbs) >= 0:
            return set(limbs) <= inside
        return len(inside) + len(self._helpers(chain, carrier)) == len(self.parents)

    def _helpers(self, chain, carrier) -> list[int]:
        """Joints above the carrier, and small or helper branches beside it."""
        inside = self._inside(carrier)
        branch: dict[int, int] = {}
        for joint, parent in enumerate(self.parents):
            if joint not in inside and joint not in chain:
                branch[joint] = branch.get(parent, joint)
        sizes = {top: list(branch.values()).count(top) for top in branch.values()}
        small = [
            joint
            for joint, top in branch.items()
            if sizes[top] < _HELPER or parse_name(self.joints[top].name).is_helper
        ]
        return small + chain[: chain.index(carrier)]


def extent(joints: list[Joint], offsets: Float[np.ndarray, "J 3"]) -> float:
    """The longest side of the box around the joints and End Sites at rest."""
    places = np.zeros((len(joints), 3))
    for index, joint in enumerate(joints[1:], start=1):
        places[index] = places[joint.parent] + offsets[index]
    tips = [places[index] + end for index, joint in enumerate(joints) for end in joint.ends]
    points = np.concatenate([places, np.reshape(tips, (-1, 3))])
    return float(np.max(points.max(axis=0) - points.min(axis=0)))
