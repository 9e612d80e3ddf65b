"""The parts of a person, placed on the joints of a skeleton."""

import numpy as np

from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.viz.player.hands import find_fingers, finger_radii, relaxed_hand
from a2g_jax.viz.player.parts import Anchor, Shape
from a2g_jax.viz.player.roles import Limb, Roles, rest_positions

#: Cosine of the largest lean of a head at rest, 25 degrees, from which on its face is not made level.
_UPRIGHT = 0.906
#: Pitch of the face at rest, radians.
_RAISED = 0.07


class Mannequin:
    """Adds the parts of a person to a shape; sizes are those of a 1.7 m adult times ``size``."""

    def __init__(self, shape: Shape, skeleton: Skeleton, roles: Roles, ends: dict[int, int]) -> None:
        self.shape, self.skeleton, self.roles, self.ends = shape, skeleton, roles, ends
        self.rest = rest_positions(skeleton)
        self.drawn: set[int] = set()
        """Joints whose bone to the parent needs no capsule of its own."""
        arms = [self._length(limb) / 0.51 for limb in roles.arms.values()]
        legs = [self._length(limb) / 0.80 for limb in roles.legs.values()]
        self.size = float(np.mean(arms + legs)) or 1.0
        left, right = roles.arms["left"].top, roles.arms["right"].top
        self.left = _unit(self.rest[left] - self.rest[right], np.array([1.0, 0, 0]))
        above = self.rest[left] + self.rest[right] - 2 * self.rest[roles.pelvis]
        if roles.pelvis == roles.chest and roles.head is not None:
            above = self.rest[roles.head] - self.rest[roles.chest]
        above = above - self.left * (above @ self.left)
        self.up = _unit(above, np.array([0, 1.0, 0]))
        self.front = np.cross(self.left, self.up)
        self.inset = 0.0

    def _length(self, limb: Limb) -> float:
        offsets = np.linalg.norm(np.asarray(self.skeleton.offsets), axis=1)
        # Some rigs have joints along the bones of a limb.
        return float(sum(offsets[joint] for joint in self._path(limb.tip, limb.top)))

    def _path(self, joint: int, stop: int) -> list[int]:
        """``joint`` and its ancestors below ``stop``."""
        path = []
        while joint not in (stop, -1):
            path.append(joint)
            joint = self.skeleton.parents[joint]
        return path

    def torso(self) -> None:
        """Add chest, belly and hips with clothes; shoulders and the muscles from there to the neck."""
        shape, roles, size, rest = self.shape, self.roles, self.size, self.rest
        left, right = roles.arms["left"].top, roles.arms["right"].top
        top = roles.neck if roles.neck is not None else left
        chest = shape.frame(roles.chest, top, left, right)
        axis = _unit(rest[top] - rest[roles.chest], self.up)
        height = float(((rest[left] + rest[right]) / 2 - rest[roles.chest]) @ axis)
        half = float(np.linalg.norm(rest[left] - rest[right])) / 2
        broad = float(np.clip(0.82 * half, 0.115 * size, 0.157 * size))
        oval = {"frame": chest, "flat": 0.70}
        ribs: Anchor = (chest, 0.0, height - 0.10 * size, 0.0)
        if roles.chest == roles.pelvis:
            shape.add((chest, 0, height - 0.3 * size, 0), ribs, (0.8 * broad, broad), shades=True, **oval)
        elif roles.legs:
            shape.add(self.hips(), ribs, (0.116 * size, broad), shades=True, **oval)
        else:
            shape.add((roles.pelvis,), ribs, (0.124 * size, broad), shades=True, **oval)
        # The shoulder girdle: across the chest, and sloping up to the neck.
        across = max(half - 0.075 * size, 0.03 * size)
        girdle = [(chest, sign * across, height - 0.045 * size, -0.006 * size) for sign in (1.0, -1.0)]
        shape.add(girdle[0], girdle[1], (0.068 * size, 0.068 * size), frame=chest, flat=0.95)
        for side, sign in (("left", 1.0), ("right", -1.0)):
            shoulder = roles.arms[side].top
            collar: Anchor = (chest, sign * 0.028 * size, height + 0.040 * size, -0.012 * size)
            shape.add(collar, (shoulder,), (0.047 * size, 0.054 * size))
            self.drawn.update(self._path(shoulder, roles.chest))
        if roles.neck is not None:
            low, high = (chest, 0, height + 0.03 * size, -0.008 * size), (chest, 0, height + 0.06 * size, -0.006 * size)
            shape.add(low, high, (0.068 * size, 0.055 * size))
        for joint in (roles.chest, *(leg.top for leg in roles.legs.values())):
            self.drawn.update(self._path(joint, roles.pelvis))

    def hips(self) -> Anchor:
        """Add the upper part of the trousers; returns the anchor where the shirt begins."""
        shape, roles, size, rest = self.shape, self.roles, self.size, self.rest
        hips = [roles.legs[side].top for side in ("left", "right")]
        pelvis = shape.frame(roles.pelvis, roles.chest, hips[0], hips[1])
        apart = max(float(np.linalg.norm(rest[hips[0]] - rest[hips[1]])) / 2, 1e-6)
        # Rigs differ in how far apart they put the hips; thighs start no further out than this.
        self.inset = float(np.clip((1 - 0.08 * size / apart) / 2, 0.0, 0.4))
        oval = {"tint": "legs", "frame": pelvis}
        low, high = (pelvis, 0, -0.045 * size, 0), (pelvis, 0, 0.05 * size, 0)
        shape.add(low, high, (0.140 * size, 0.122 * size), flat=0.79, shades=True, **oval)
        seat = [(pelvis, sign * 0.055 * size, -0.068 * size, -0.004 * size) for sign in (1.0, -1.0)]
        shape.add(seat[0], seat[1], (0.095 * size, 0.095 * size), flat=1.0, **oval)
        return (pelvis, 0, 0.065 * size, 0)

    def head(self) -> None:
        """Add neck, skull and jaw, hair, and a face that shows the direction of the head from afar."""
        shape, roles, size = self.shape, self.roles, self.size
        if roles.head is None or roles.neck is None:
            return
        head = roles.head
        below = self._path(head, roles.chest)[::-1]
        self.drawn.update(below, self._under(head))
        for first, second in zip(below, below[1:], strict=False):
            shape.add((first,), (second,), (0.048 * size, 0.047 * size), tint="skin")
        frame, top = self.head_frame(head)

        def at(x: float | int, y: float | int, z: float | int) -> Anchor:
            """Metres to the left, below the crown, and to the front."""
            return (frame, x * size, top - y * size, z * size)

        def part(start: Anchor, end: Anchor, radii: tuple[float, float], tint: str, **more) -> None:
            shape.add(start, end, (radii[0] * size, radii[1] * size), tint=tint, **more)

        oval = {"frame": frame, "axis": 0}
        part((head,), at(0, 0.13, -0.01), (0.05, 0.05), "skin")
        part(at(0, 0.174, 0.030), at(0, 0.094, -0.002), (0.049, 0.090), "skin", flat=0.86, shades=True, **oval)
        part(at(0, 0.094, -0.018), at(0, 0.084, -0.012), (0.094, 0.088), "hair", flat=0.90, **oval)
        part(at(0, 0.135, -0.034), at(0, 0.09, -0.018), (0.066, 0.09), "hair", flat=0.93, **oval)
        part(at(0, 0.118, 0.086), at(0, 0.139, 0.097), (0.007, 0.0125), "skin")
        for sign in (1.0, -1.0):
            ear = [at(sign * 0.076, 0.129, 0.004), at(sign * 0.079, 0.112, 0.0)]
            part(ear[0], ear[1], (0.012, 0.017), "skin", flat=0.5, **oval)
            part(at(sign * 0.030, 0.1145, 0.0755), at(sign * 0.030, 0.1125, 0.0755), (0.0088, 0.0088), "eye")
            # Brows that arch and a mouth whose corners are up: level ones look sad from above.
            arch = at(sign * 0.032, 0.0885, 0.0790)
            part(at(sign * 0.020, 0.0915, 0.0815), arch, (0.0036, 0.0036), "hair")
            part(arch, at(sign * 0.045, 0.0915, 0.0725), (0.0036, 0.0032), "hair")
            corner = at(sign * 0.0205, 0.1645, 0.0740)
            part(at(0, 0.1690, 0.0790), corner, (0.0058, 0.0036), "lips", frame=frame, axis=1, flat=0.6)

    def head_frame(self, head: int) -> tuple[int, float]:
        """A frame at the head's joint, and the height of the crown above it, metres."""
        shape, size = self.shape, self.size
        up = self.up
        top = 0.205 * size
        end = self.ends.get(head)
        if end is None:
            # Some rigs have the top of the head as a joint ("HeadEnd").
            end = next((j for j in self._under(head) if "end" in self.skeleton.names[j].lower()), None)
        if end is not None:
            offset = (
                np.asarray(shape.points[end][1]) if end >= self.skeleton.joints else self.rest[end] - self.rest[head]
            )
            length = float(np.linalg.norm(offset))
            if length > 0.05 * size:
                up = offset / length
                top = float(np.clip(length, 0.15 * size, 0.24 * size))
            else:
                end = None
        level = np.array([0.0, 1.0, 0.0])
        if up @ level > _UPRIGHT:
            # Backs lean, and tops of heads are not above their joints: at rest the face is nearly level nevertheless.
            # It is a little raised, as people whose heads are lowered look up with their eyes, and these cannot turn.
            front = np.cross(self.left, level)
            up, end = np.cos(_RAISED) * level - np.sin(_RAISED) * front, None
        if end is None:
            end = shape.point(head, up * top)
        left = _unit(self.left - up * (self.left @ up), np.array([1.0, 0, 0]))
        return shape.frame(head, end, shape.point(head, left * 0.1 * size), head), top

    def arm(self, side: str, arm: Limb) -> None:
        """Add sleeves and a hand."""
        shape, size = self.shape, self.size
        shape.add((arm.top,), (arm.middle,), (0.055 * size, 0.043 * size), shades=True)
        shape.add((arm.middle,), (arm.tip,), (0.043 * size, 0.031 * size), shades=True)
        self.drawn.update(self._path(arm.middle, arm.top), self._path(arm.tip, arm.middle))
        self.drawn.update(j for j in self._under(arm.top) if np.allclose(self.skeleton.offsets[j], 0))
        under = self._under(arm.tip)
        self.drawn.update(under)
        fingers = find_fingers(self.skeleton, arm.tip, self.rest)
        knuckles = [self.rest[finger.joints[0]] - self.rest[arm.tip] for finger in fingers if not finger.thumb]
        forearm = _unit(self.rest[arm.tip] - self.rest[arm.middle], self.left)
        along = _unit(np.mean(knuckles, axis=0), forearm) if knuckles else forearm
        tip = self.ends.get(arm.tip)
        if tip is None:
            tip = shape.point(arm.tip, along * 0.18 * size)
        elif np.linalg.norm(shape.points[tip][1]) > 0.02 * size:
            along = _unit(np.asarray(shape.points[tip][1]), along)
        # At rest the thumbs of every common rig point forward: palms down in a T-pose, inward with arms at the sides.
        thumbs = [self.rest[finger.joints[-1]] - self.rest[arm.tip] for finger in fingers if finger.thumb]
        thumbs += [self.rest[j] - self.rest[arm.tip] for j in under if "thumb" in self.skeleton.names[j].lower()]
        toward = thumbs[0] if thumbs else self.front
        toward = _unit(toward - along * (toward @ along), self.front)
        frame = shape.frame(arm.tip, tip, shape.point(arm.tip, toward * 0.1 * size), arm.tip)
        palm_side = -1.0 if side == "left" else 1.0
        digits: list[tuple[list[Anchor], list[float], bool]] = []
        for finger in fingers:
            anchors: list[Anchor] = [(joint,) for joint in finger.joints]
            digits.append(([*anchors, (self.fingertip(finger.joints),)], finger_radii(finger, size), finger.thumb))
        for points, radii, thumb in relaxed_hand(size, palm_side) if not fingers else []:
            digits.append(([(frame, *(float(x) for x in point)) for point in points], radii, thumb))
        self.hand(frame, palm_side, digits)

    def hand(self, frame: int, palm_side: float, digits: list[tuple[list[Anchor], list[float], bool]]) -> None:
        """Add a wrist, the bones of the palm to each knuckle, the ball of the thumb, and the fingers."""
        shape, size = self.shape, self.size

        def at(x: float | int, y: float | int, z: float | int) -> Anchor:
            return (frame, x * size, y * size, palm_side * z * size)

        flat = {"tint": "skin", "frame": frame, "axis": 2}
        shape.add(at(0, -0.004, 0), at(0, 0.024, 0), (0.026 * size, 0.025 * size), flat=0.8, **flat)
        shape.add(at(0, 0.022, 0), at(-0.006, 0.066, 0), (0.026 * size, 0.034 * size), flat=0.42, **flat)
        rays = [anchors[0] for anchors, _, thumb in digits if not thumb]
        for number, knuckle in enumerate(rays):
            spread = (0.5 - number / max(len(rays) - 1, 1)) * 0.024
            start = at(spread, 0.016, 0) if len(knuckle) == 4 else at(0, 0.016, 0)
            shape.add(start, knuckle, (0.0135 * size, 0.0118 * size), tint="skin")
        for anchors, radii, thumb in digits:
            if thumb:
                shape.add(at(0.004, 0.018, 0.004), anchors[0], (0.018 * size, 0.0165 * size), tint="skin")
            for index in range(len(anchors) - 1):
                shape.add(anchors[index], anchors[index + 1], (radii[index], radii[index + 1]), tint="skin")

    def fingertip(self, joints: tuple[int, ...]) -> int:
        """The point at the end of a finger's last bone; a guess where the skeleton has none."""
        last = joints[-1]
        end = self.ends.get(last)
        if end is not None and np.linalg.norm(self.shape.points[end][1]) > 0.004 * self.size:
            return end
        before = np.asarray(self.skeleton.offsets[last], np.float64)
        return self.shape.point(last, before * min(0.85, 0.022 * self.size / max(float(np.linalg.norm(before)), 1e-6)))

    def leg(self, leg: Limb) -> None:
        """Add a trouser leg and a shoe."""
        shape, size, rest = self.shape, self.size, self.rest
        other = next(limb.top for limb in self.roles.legs.values() if limb.top != leg.top)
        shape.add((leg.top, other, self.inset), (leg.middle,), (0.086 * size, 0.058 * size), tint="legs", shades=True)
        shape.add((leg.middle,), (leg.tip,), (0.058 * size, 0.046 * size), tint="legs", shades=True)
        self.drawn.update(self._path(leg.middle, leg.top), self._path(leg.tip, leg.middle))
        under = self._under(leg.tip)
        self.drawn.update(under, (j for j in self._under(leg.top) if np.allclose(self.skeleton.offsets[j], 0)))
        solid = [j for j in under if not np.allclose(self.skeleton.offsets[j], 0)]
        ahead = {j: float((rest[j] - rest[leg.tip]) @ self.front) for j in solid}
        toe = max(ahead, key=ahead.__getitem__) if ahead else None
        low = 0.07 * size
        if toe is not None:
            low = float(np.clip((rest[leg.tip] - rest[toe]) @ self.up, 0.035 * size, 0.09 * size))
        heel = shape.point(leg.tip, -self.front * 0.028 * size - self.up * low)
        if toe is None or ahead[toe] < 0.08 * size:
            ball = shape.point(leg.tip, self.front * 0.135 * size - self.up * (low + 0.004 * size))
        else:
            ball = toe
        end = self.ends.get(toe) if toe is not None else None
        far = end is not None and np.linalg.norm(shape.points[end][1]) > 0.02 * size
        reach = ahead[toe] if toe is not None else 0.0
        tip: Anchor = (end,) if far and end is not None else (heel, ball, 1.0 if reach > 0.17 * size else 1.32)
        shape.add((leg.tip,), (heel,), (0.038 * size, 0.037 * size), tint="shoe")
        shape.add((heel,), (heel, ball, 0.85), (0.037 * size, 0.041 * size), tint="shoe")
        shape.add((heel, ball, 0.8), tip, (0.041 * size, 0.03 * size), tint="shoe")
        shape.add((leg.tip,), (heel, ball, 0.75), (0.036 * size, 0.036 * size), tint="shoe")

    def _under(self, joint: int) -> list[int]:
        """Descendants of ``joint``."""
        found = {joint}
        for child, parent in enumerate(self.skeleton.parents):
            if parent in found:
                found.add(child)
        return sorted(found - {joint})


def _unit(vector: np.ndarray, fallback: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-6 else fallback
