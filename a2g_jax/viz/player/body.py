"""A drawable body over a skeleton: points that move with the joints, and capsules between them.

The page knows no skeletons. It gets world positions of points and a list of shapes; everything that depends on names,
proportions and the rest pose is decided here.
"""

from dataclasses import dataclass, field

import numpy as np

from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.viz.player.roles import Limb, Roles, find_roles, is_finger, rest_positions

#: How an anchor names its place: a point ``(p,)``, between two points ``(p, q, weight)``, or metres along the axes of
#: a frame ``(frame, x, y, z)``.
Anchor = tuple[float | int, ...]


@dataclass(frozen=True)
class Shape:
    """A round cone between two anchors with a radius at each, flattened along one axis of a frame."""

    start: Anchor
    end: Anchor
    start_radius: float | int
    end_radius: float | int
    tint: str = "body"
    """``body``, ``skin`` (lighter), ``visor`` or ``shoe`` (both darker)."""
    frame: int = -1
    """Frame whose ``axis`` the shape is flattened along; -1 for a round one."""
    axis: int = 2
    flat: float = 1.0
    """Thickness along the axis, as a fraction of the radius."""
    shades: bool = False
    """Whether it casts soft ambient shadow on the rest of the body."""

    def encoded(self) -> list:
        """As JSON for the page."""
        numbers = [self.start_radius, self.end_radius, self.frame, self.axis, self.flat, int(self.shades)]
        return [_short(self.start), _short(self.end), *_short(numbers), self.tint]


@dataclass
class Body:
    """Points, frames and shapes of one skeleton."""

    points: list[tuple[int, tuple[float, float, float]]]
    """(joint, offset in that joint's frame), metres; the first J are the joints themselves."""
    frames: list[tuple[int, int, int, int]] = field(default_factory=list)
    """Axes from points (origin, up, left, right): Y from origin to up, X from right to left, Z = X x Y."""
    shapes: list[Shape] = field(default_factory=list)
    wrists: tuple[int, ...] = ()
    """Points whose trails and speeds are drawn."""

    def point(self, joint: int, offset: np.ndarray) -> int:
        """Add a point that is rigid to ``joint``."""
        self.points.append((joint, (float(offset[0]), float(offset[1]), float(offset[2]))))
        return len(self.points) - 1

    def frame(self, origin: int, up: int, left: int, right: int) -> int:
        """Add a frame."""
        self.frames.append((origin, up, left, right))
        return len(self.frames) - 1

    def add(self, start: Anchor, end: Anchor, radii: tuple[float, float], **more) -> None:
        """Add a shape."""
        self.shapes.append(Shape(start, end, radii[0], radii[1], **more))


def build_body(skeleton: Skeleton) -> Body:
    """The body to draw for ``skeleton``: a mannequin where arms are found by name, plain capsules otherwise."""
    body = Body(points=[(joint, (0.0, 0.0, 0.0)) for joint in range(skeleton.joints)])
    ends: dict[int, int] = {}
    for joint, offset in skeleton.ends:
        ends.setdefault(joint, body.point(joint, np.asarray(offset)))
    roles = find_roles(skeleton)
    if roles is None:
        _generic(body, skeleton, set(), 1.0)
        for joint, end in ends.items():
            _bone(body, joint, end, float(np.linalg.norm(body.points[end][1])), 1.0)
        body.wrists = _leaves(skeleton)
        return body
    maker = _Mannequin(body, skeleton, roles, ends)
    maker.torso()
    maker.head()
    for side, arm in roles.arms.items():
        maker.arm(side, arm)
    for leg in roles.legs.values():
        maker.leg(leg)
    _generic(body, skeleton, maker.drawn, maker.size)
    body.wrists = tuple(roles.arms[side].tip for side in ("left", "right"))
    return body


class _Mannequin:
    """Adds the parts of a human body; sizes are those of a 1.7 m adult times ``size``."""

    def __init__(self, body: Body, skeleton: Skeleton, roles: Roles, ends: dict[int, int]) -> None:
        self.body, self.skeleton, self.roles, self.ends = body, skeleton, roles, ends
        self.rest = rest_positions(skeleton)
        self.drawn: set[int] = set()
        """Joints whose bone to their parent needs no capsule of its own."""
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
        return float(offsets[limb.middle] + offsets[limb.tip])

    def _path(self, joint: int, stop: int) -> list[int]:
        """``joint`` and its ancestors below ``stop``."""
        path = []
        while joint not in (stop, -1):
            path.append(joint)
            joint = self.skeleton.parents[joint]
        return path

    def torso(self) -> None:
        body, roles, size, rest = self.body, self.roles, self.size, self.rest
        left, right = roles.arms["left"].top, roles.arms["right"].top
        top = roles.neck if roles.neck is not None else left
        chest = body.frame(roles.chest, top, left, right)
        axis = _unit(rest[top] - rest[roles.chest], self.up)
        height = float(((rest[left] + rest[right]) / 2 - rest[roles.chest]) @ axis)
        half = float(np.linalg.norm(rest[left] - rest[right])) / 2
        broad = float(np.clip(0.84 * half, 0.115 * size, 0.155 * size))
        upper: Anchor = (chest, 0.0, height - 0.085 * size, 0.0)
        oval = {"frame": chest, "flat": 0.76}
        if roles.chest == roles.pelvis:
            body.add((chest, 0, height - 0.3 * size, 0), upper, (0.8 * broad, broad), shades=True, **oval)
        else:
            waist: Anchor = (roles.pelvis, roles.chest, 0.5)
            body.add(waist, upper, (0.12 * size, broad), shades=True, **oval)
            body.add((roles.pelvis,), waist, (0.128 * size, 0.12 * size), **oval)
            if roles.legs:
                hips = [roles.legs[side].top for side in ("left", "right")]
                pelvis = body.frame(roles.pelvis, roles.chest, hips[0], hips[1])
                apart = max(float(np.linalg.norm(rest[hips[0]] - rest[hips[1]])) / 2, 1e-6)
                # Rigs differ in how far apart they put the hips; thighs start no further out than this.
                self.inset = float(np.clip((1 - 0.08 * size / apart) / 2, 0.0, 0.4))
                inner = float(np.clip((1 - 0.045 * size / apart) / 2, 0.0, 0.5))
                ends = ((hips[0], hips[1], inner), (hips[0], hips[1], 1 - inner))
                body.add(*ends, (0.094 * size, 0.094 * size), frame=pelvis, flat=0.92, shades=True)
        for side, sign in (("left", 1.0), ("right", -1.0)):
            shoulder = roles.arms[side].top
            collar: Anchor = (chest, sign * 0.045 * size, height + 0.012 * size, -0.01 * size)
            body.add(collar, (shoulder,), (0.06 * size, 0.056 * size))
            self.drawn.update(self._path(shoulder, roles.chest))
        for joint in (roles.chest, *(leg.top for leg in roles.legs.values())):
            self.drawn.update(self._path(joint, roles.pelvis))

    def head(self) -> None:
        body, roles, size = self.body, self.roles, self.size
        if roles.head is None or roles.neck is None:
            return
        head = roles.head
        below = self._path(head, roles.chest)[::-1]
        self.drawn.update(below, self._under(head))
        for first, second in zip(below, below[1:], strict=False):
            body.add((first,), (second,), (0.052 * size, 0.048 * size), tint="skin")
        up = self.up
        top = 0.205 * size
        end = self.ends.get(head)
        if end is None:
            # Some rigs carry the top of the head as a joint ("HeadEnd").
            end = next((j for j in self._under(head) if "end" in self.skeleton.names[j].lower()), None)
        if end is not None:
            offset = (
                np.asarray(body.points[end][1]) if end >= self.skeleton.joints else self.rest[end] - self.rest[head]
            )
            length = float(np.linalg.norm(offset))
            if length > 0.05 * size:
                up = offset / length
                top = float(np.clip(length, 0.15 * size, 0.24 * size))
            else:
                end = None
        if end is None:
            end = body.point(head, up * top)
        left = _unit(self.left - up * (self.left @ up), np.array([1.0, 0, 0]))
        frame = body.frame(head, end, body.point(head, left * 0.1 * size), head)
        crown: Anchor = (frame, 0.0, top - 0.092 * size, -0.004 * size)
        jaw: Anchor = (frame, 0.0, top - 0.166 * size, 0.024 * size)
        body.add((roles.head,), (frame, 0, top - 0.13 * size, -0.01 * size), (0.05 * size, 0.052 * size), tint="skin")
        body.add(jaw, crown, (0.062 * size, 0.092 * size), tint="skin", frame=frame, axis=0, flat=0.88, shades=True)
        # A visor around the eyes shows from afar where the head looks: it follows the head's oval at their height.
        turns = np.deg2rad([-62, -31, 0, 31, 62])
        band = [(frame, 0.067 * size * np.sin(t), top - 0.108 * size, 0.076 * size * np.cos(t)) for t in turns]
        for back, fore in zip(band, band[1:], strict=False):
            body.add(back, fore, (0.021 * size, 0.021 * size), tint="visor")
        nose = [(frame, 0, top - y * size, z * size) for y, z in ((0.128, 0.084), (0.146, 0.095))]
        body.add(nose[0], nose[1], (0.008 * size, 0.014 * size), tint="skin")

    def arm(self, side: str, arm: Limb) -> None:
        body, size = self.body, self.size
        body.add((arm.top,), (arm.middle,), (0.052 * size, 0.04 * size), shades=True)
        body.add((arm.middle,), (arm.tip,), (0.041 * size, 0.029 * size), shades=True)
        self.drawn.update(self._path(arm.middle, arm.top), self._path(arm.tip, arm.middle))
        self.drawn.update(j for j in self._under(arm.top) if np.allclose(self.skeleton.offsets[j], 0))
        fingers = [j for j in self._under(arm.tip) if is_finger(self.skeleton.names[j])]
        knuckles = [j for j in fingers if self.skeleton.parents[j] == arm.tip or "1" in self.skeleton.names[j]]
        forearm = _unit(self.rest[arm.tip] - self.rest[arm.middle], self.left)
        reach = [self.rest[j] - self.rest[arm.tip] for j in knuckles if "thumb" not in self.skeleton.names[j].lower()]
        along = _unit(np.mean(reach, axis=0), forearm) if reach else forearm
        tip = self.ends.get(arm.tip)
        if tip is None:
            tip = body.point(arm.tip, along * 0.18 * size)
        elif np.linalg.norm(body.points[tip][1]) > 0.02 * size:
            along = _unit(np.asarray(body.points[tip][1]), along)
        # At rest the thumbs of every common rig point forward: palms down in a T-pose, inward with arms at the sides.
        thumbs = [self.rest[j] - self.rest[arm.tip] for j in fingers if "thumb" in self.skeleton.names[j].lower()]
        toward = thumbs[0] if thumbs else self.front
        toward = _unit(toward - along * (toward @ along), self.front)
        frame = body.frame(arm.tip, tip, body.point(arm.tip, toward * 0.1 * size), arm.tip)
        flat = {"tint": "skin", "frame": frame, "axis": 2}
        if fingers:
            length = float(np.mean([vector @ along for vector in reach])) if reach else 0.08 * size
            wide = 0.036 * size
            body.add(
                (frame, 0, 0.012 * size, 0), (frame, 0, length - wide * 0.7, 0), (0.028 * size, wide), flat=0.42, **flat
            )
            body.add((arm.tip,), (frame, 0, 0.03 * size, 0), (0.026 * size, 0.026 * size), flat=0.7, **flat)
            self.drawn.update(j for j in fingers if j in knuckles and "thumb" not in self.skeleton.names[j].lower())
            self.drawn.update(j for j in fingers if not re_digit(self.skeleton.names[j]))
            return
        radii = (0.03 * size, 0.041 * size)
        body.add(
            (frame, -0.002 * size, 0.016 * size, 0), (frame, -0.003 * size, 0.07 * size, 0), radii, flat=0.46, **flat
        )
        fore = (frame, -0.004 * size, 0.15 * size, 0.006 * size * (1 if side == "left" else -1))
        body.add((frame, -0.003 * size, 0.075 * size, 0), fore, (0.04 * size, 0.027 * size), flat=0.36, **flat)
        thumb = [(frame, x * size, y * size, 0.0) for x, y in ((0.022, 0.03), (0.058, 0.088))]
        body.add(thumb[0], thumb[1], (0.016 * size, 0.0115 * size), tint="skin")

    def leg(self, leg: Limb) -> None:
        body, size, rest = self.body, self.size, self.rest
        other = next(limb.top for limb in self.roles.legs.values() if limb.top != leg.top)
        body.add((leg.top, other, self.inset), (leg.middle,), (0.087 * size, 0.055 * size), shades=True)
        body.add((leg.middle,), (leg.tip,), (0.055 * size, 0.037 * size), shades=True)
        self.drawn.update(self._path(leg.middle, leg.top), self._path(leg.tip, leg.middle))
        under = self._under(leg.tip)
        self.drawn.update(under, (j for j in self._under(leg.top) if np.allclose(self.skeleton.offsets[j], 0)))
        solid = [j for j in under if not np.allclose(self.skeleton.offsets[j], 0)]
        ahead = {j: float((rest[j] - rest[leg.tip]) @ self.front) for j in solid}
        toe = max(ahead, key=ahead.__getitem__) if ahead else None
        low = 0.07 * size
        if toe is not None:
            low = float(np.clip((rest[leg.tip] - rest[toe]) @ self.up, 0.035 * size, 0.09 * size))
        heel = body.point(leg.tip, -self.front * 0.028 * size - self.up * low)
        if toe is None or ahead[toe] < 0.08 * size:
            ball = body.point(leg.tip, self.front * 0.135 * size - self.up * (low + 0.004 * size))
        else:
            ball = toe
        end = self.ends.get(toe) if toe is not None else None
        far = end is not None and np.linalg.norm(body.points[end][1]) > 0.02 * size
        reach = ahead[toe] if toe is not None else 0.0
        tip: Anchor = (end,) if far and end is not None else (heel, ball, 1.0 if reach > 0.17 * size else 1.32)
        body.add((leg.tip,), (heel,), (0.038 * size, 0.037 * size), tint="shoe")
        body.add((heel,), (heel, ball, 0.85), (0.037 * size, 0.041 * size), tint="shoe")
        body.add((heel, ball, 0.8), tip, (0.041 * size, 0.03 * size), tint="shoe")
        body.add((leg.tip,), (heel, ball, 0.75), (0.036 * size, 0.036 * size), tint="shoe")

    def _under(self, joint: int) -> list[int]:
        """Descendants of ``joint``."""
        found = {joint}
        for child, parent in enumerate(self.skeleton.parents):
            if parent in found:
                found.add(child)
        return sorted(found - {joint})


def re_digit(name: str) -> bool:
    """Whether a name ends in a digit, as those of phalanges do and those of metacarpals do not."""
    return name[-1:].isdigit()


def _generic(body: Body, skeleton: Skeleton, drawn: set[int], size: float) -> None:
    """A capsule for every bone that has none yet."""
    lengths = np.linalg.norm(np.asarray(skeleton.offsets), axis=1)
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0 and joint not in drawn:
            _bone(body, parent, joint, float(lengths[joint]), size, is_finger(skeleton.names[joint]))


def _bone(body: Body, parent: int, joint: int, length: float, size: float, finger: bool = False) -> None:
    if length < 0.004 * size:
        return
    if finger:
        body.add((parent,), (joint,), (0.0105 * size, 0.009 * size), tint="skin")
    else:
        thick = float(np.clip(0.16 * length, 0.008 * size, 0.05 * size))
        body.add((parent,), (joint,), (thick, 0.8 * thick))


def _leaves(skeleton: Skeleton) -> tuple[int, ...]:
    """The two joints farthest from the root: a guess at hands for a tree without names."""
    return tuple(sorted(np.argsort(-np.linalg.norm(rest_positions(skeleton), axis=1))[:2].tolist()))


def _unit(vector: np.ndarray, fallback: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-6 else fallback


def _short(numbers) -> list:
    """Numbers as JSON keeps them small: whole ones as integers, the others with five decimals."""
    return [int(number) if float(number).is_integer() else round(float(number), 5) for number in numbers]
