"""Procedural humanoid rigs and a pose-for-pose truth: every rig shows the same person doing the same thing."""

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh import read_bvh, write_bvh

#: Where the joints of a T-pose are, from the part above, in metres: left side, x left, y up, z forward.
TRUNK = {"Spine": (0.0, 0.3, -0.01), "Neck": (0.0, 0.2, -0.01), "Head": (0.0, 0.09, 0.02)}
ARM = {"Collar": (0.04, 0.12, 0.0), "Shoulder": (0.12, 0.02, 0.0), "Elbow": (0.27, 0, 0), "Wrist": (0.23, 0, 0)}
LEG = {"Hip": (0.09, -0.07, 0.0), "Knee": (0, -0.4, 0), "Ankle": (0, -0.39, 0), "Foot": (0, -0.06, 0.13)}
FINGERS = {
    "Index": (0.09, 0.0, 0.022),
    "Middle": (0.092, 0.0, 0.0),
    "Ring": (0.085, 0.0, -0.02),
    "Pinky": (0.075, 0.0, -0.04),
    "Thumb": (0.03, -0.02, 0.03),
}

#: Parts whose pose does not depend on how many spines and necks a rig has.
PARTS = ["Pelvis", "Chest", "Head"] + [f"{side}_{part}" for side in "LR" for part in (*ARM, *LEG)]

_MIXAMO = {
    "Pelvis": "Hips", "Spine": "Spine{}", "Neck": "Neck{}", "Head": "Head", "Collar": "{side}Shoulder",
    "Shoulder": "{side}Arm", "Elbow": "{side}ForeArm", "Wrist": "{side}Hand", "Hip": "{side}UpLeg", "Knee": "{side}Leg",
    "Ankle": "{side}Foot", "Foot": "{side}ToeBase", "Finger": "{side}Hand{finger}{n}", "Twist": "{part}Twist",
}  # fmt: skip
DIALECTS = {
    "mixamo": {role: "mixamorig:" + name for role, name in _MIXAMO.items()},
    "beat": _MIXAMO,
    "smplx": {
        "Pelvis": "pelvis", "Spine": "spine{}", "Neck": "neck{}", "Head": "head", "Collar": "{side}_collar",
        "Shoulder": "{side}_shoulder", "Elbow": "{side}_elbow", "Wrist": "{side}_wrist", "Hip": "{side}_hip",
        "Knee": "{side}_knee", "Ankle": "{side}_ankle", "Foot": "{side}_foot", "Finger": "{side}_{finger}{n}",
        "Twist": "{part}_twist",
    },
    "unreal": {
        "Pelvis": "pelvis", "Spine": "spine_0{}", "Neck": "neck_0{}", "Head": "head", "Collar": "clavicle_{s}",
        "Shoulder": "upperarm_{s}", "Elbow": "lowerarm_{s}", "Wrist": "hand_{s}", "Hip": "thigh_{s}",
        "Knee": "calf_{s}", "Ankle": "foot_{s}", "Foot": "ball_{s}", "Finger": "{finger}_0{n}_{s}",
        "Twist": "{part}_twist_01",
    },
    "biped": {
        "Pelvis": "Bip01 Pelvis", "Spine": "Bip01 Spine{}", "Neck": "Bip01 Neck{}", "Head": "Bip01 Head",
        "Collar": "Bip01 {S} Clavicle", "Shoulder": "Bip01 {S} UpperArm", "Elbow": "Bip01 {S} Forearm",
        "Wrist": "Bip01 {S} Hand", "Hip": "Bip01 {S} Thigh", "Knee": "Bip01 {S} Calf", "Ankle": "Bip01 {S} Foot",
        "Foot": "Bip01 {S} Toe0", "Finger": "Bip01 {S} {finger} {n}", "Twist": "{part} Twist",
    },
    "hands": {
        "Pelvis": "b_root", "Spine": "b_spine{}", "Neck": "b_neck{}", "Head": "b_head", "Collar": "b_{s}_shoulder",
        "Shoulder": "b_{s}_arm", "Elbow": "b_{s}_forearm", "Wrist": "b_{s}_wrist", "Hip": "b_{s}_upleg",
        "Knee": "b_{s}_leg", "Ankle": "b_{s}_foot", "Foot": "b_{s}_toe", "Finger": "b_{s}_{finger}{n}",
        "Twist": "{part}_twist",
    },
    "blender": {
        "Pelvis": "hips", "Spine": "spine.00{}", "Neck": "neck.00{}", "Head": "head", "Collar": "shoulder.{S}",
        "Shoulder": "upper_arm.{S}", "Elbow": "forearm.{S}", "Wrist": "hand.{S}", "Hip": "thigh.{S}",
        "Knee": "shin.{S}", "Ankle": "foot.{S}", "Foot": "toe.{S}", "Finger": "f_{finger}.0{n}.{S}",
        "Twist": "{part}.twist",
    },
    "nameless": {},
}  # fmt: skip


@dataclass(frozen=True)
class Spec:
    """What makes one rig differ from another."""

    dialect: str = "beat"
    spines: int = 4
    necks: int = 1
    fingers: bool = False
    lowered: float = 0.0
    """How far the arms of the reference pose hang below a T-pose, degrees."""
    twists: str = "none"
    """Twist bones: none, beside the bone (leaves), or in the chain."""
    frames: str = "world"
    """Local axes at rest: along the world's, permuted, or turned at random (then frame 0 shows the reference pose)."""
    up: str = "Y"
    scale: float = 1.0
    above_root: bool = False
    leaf_ends: bool = False
    proportions: int = 0
    tips: bool = False
    """Whether every leaf has an end site, as exporters write them into files."""

    def build(self, poses: "Poses") -> tuple[Motion, dict[str, int]]:
        """The motion on the rig, and the joints of its parts."""
        return _Builder(self).motion(poses)


def specs() -> st.SearchStrategy[Spec]:
    """Any rig."""
    return st.builds(
        Spec,
        dialect=st.sampled_from(sorted(DIALECTS)),
        spines=st.integers(2, 6),
        necks=st.integers(1, 3),
        fingers=st.booleans(),
        lowered=st.sampled_from([0.0, 30.0, 45.0, 60.0]),
        twists=st.sampled_from(["none", "beside", "chain"]),
        frames=st.sampled_from(["world", "permuted", "random"]),
        up=st.sampled_from(["Y", "Z", "-Y", "X"]),
        scale=st.sampled_from([1.0, 0.01, 39.37, 0.6]),
        above_root=st.booleans(),
        leaf_ends=st.booleans(),
        proportions=st.integers(0, 1000),
    ).filter(lambda spec: not (spec.dialect == "nameless" and spec.twists == "chain"))


@dataclass(frozen=True)
class Layout:
    """How a motion is written as BVH."""

    order: str = "ZXY"
    unit: float = 100.0
    """Units of the file in a metre."""


def layouts() -> st.SearchStrategy[Layout]:
    """Any order of the rotations; centimetres and metres."""
    return st.builds(Layout, st.permutations("XYZ").map("".join), st.sampled_from([100.0, 1.0]))


def through_file(motion: Motion, layout: Layout) -> Motion:
    """The motion as it comes back from a BVH file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.bvh"
        write_bvh(path, motion, order=layout.order, scale=layout.unit)
        return read_bvh(path)


def file_name(motion: Motion, joint: int) -> str:
    """Name of a joint in a file."""
    return motion.skeleton.names[joint].replace(" ", "_")


@dataclass(frozen=True)
class Poses:
    """Orientations of a person's parts over time, each from its T-pose, in the person's world; and the hips' path."""

    parts: dict[str, np.ndarray]
    hips: np.ndarray

    @classmethod
    def random(cls, frames: int, seed: int) -> "Poses":
        """Smooth poses within what a standing talker does; each part turns against the one above."""
        rng = np.random.default_rng(seed)

        def turns(degrees):
            knots = rng.normal(size=(3, 3)) * np.radians(degrees)
            phase = np.linspace(0, 2 * np.pi, frames)[:, None]
            return Rotation.from_rotvec(knots[0] + knots[1] * np.sin(phase) + knots[2] * np.cos(phase)).as_matrix()

        parts = {"Pelvis": turns(6)}
        parts["Chest"] = parts["Pelvis"] @ turns(8)
        parts["Neck"] = parts["Chest"] @ turns(8)
        parts["Head"] = parts["Neck"] @ turns(10)
        for side in "LR":
            above = parts["Chest"]
            for part, degrees in (("Collar", 5), ("Shoulder", 40), ("Elbow", 40), ("Wrist", 20)):
                parts[f"{side}_{part}"] = above = above @ turns(degrees)
            for finger in FINGERS:
                bone = parts[f"{side}_Wrist"]
                for number in (1, 2, 3):
                    parts[f"{side}_{finger}{number}"] = bone = bone @ turns(15)
            above = parts["Pelvis"]
            for part, degrees in (("Hip", 10), ("Knee", 10), ("Ankle", 8), ("Foot", 4)):
                parts[f"{side}_{part}"] = above = above @ turns(degrees)
        hips = np.array([0.1, 0.9, 0.2]) + 0.05 * rng.normal(size=(1, 3)) * np.linspace(0, 1, frames)[:, None]
        return cls(parts, hips)


class _Builder:
    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self.rng = np.random.default_rng(spec.proportions)
        self.size = 1 + 0.1 * np.clip(self.rng.normal(size=4), -1.5, 1.5) * (spec.proportions > 0)
        self.names: list[str] = []
        self.parents: list[int] = []
        self.parts: list[str] = []
        self.bones: list[np.ndarray] = []
        self.turns: list[np.ndarray] = []
        self.weight: list[float] = []
        self.joints: dict[str, int] = {}
        self.rolled: dict[int, np.ndarray] = {}
        #: Joints that only mark an end.
        self.marks: set[int] = set()

    def add(self, name: str, parent: int, part: str, bone, turn: np.ndarray, weight: float = 1.0) -> int:
        """A joint that moves as ``part``; ``bone`` from the joint above in a T-pose; ``turn`` from T-pose to rest."""
        if name.lower().endswith("end"):
            self.marks.add(len(self.names))
        if self.spec.dialect == "nameless":
            name = f"joint{len(self.names)}"
        self.names.append(name)
        self.parents.append(parent)
        self.parts.append(part)
        self.bones.append(np.asarray(bone, float))
        self.turns.append(turn)
        self.weight.append(weight)
        return len(self.names) - 1

    def label(self, role: str, number: int = 0, side: str = "", finger: str = "") -> str:
        names = DIALECTS[self.spec.dialect]
        if not names:
            return ""
        word = {"L": "left", "R": "right", "": ""}[side]
        word = word.title() if self.spec.dialect in ("mixamo", "beat") else word
        finger = finger if self.spec.dialect in ("mixamo", "beat") else finger.lower()
        return names[role].format(number or "", side=word, s=side.lower(), S=side, finger=finger, n=number)

    def grow(self) -> None:
        level, none = np.eye(3), -1
        if self.spec.above_root:
            none = self.add("Reference", -1, "", (0, 0, 0), level)
        pelvis = self.add(self.label("Pelvis"), none, "Pelvis", (0, 0, 0), level)
        self.joints["Pelvis"] = joint = pelvis
        count = self.spec.spines
        for at in range(count):
            bone = np.array(TRUNK["Spine"]) / count * self.size[0]
            # Spines before the chest move a part of the way, by their place.
            name = self.label("Spine", at)
            joint = self.add(name, joint, "Chest", bone, level, (at + 1) / count)
        self.joints["Chest"] = chest = joint
        for at in range(self.spec.necks):
            bone = np.array(TRUNK["Neck"] if at == 0 else TRUNK["Head"]) * (1.0 if at == 0 else 0.5)
            joint = self.add(self.label("Neck", at), joint, "Neck", bone * self.size[0], level)
        bone = np.array(TRUNK["Head"]) * self.size[0] * (1.0 if self.spec.necks == 1 else 0.5)
        self.joints["Head"] = joint = self.add(self.label("Head"), joint, "Head", bone, level)
        if self.spec.leaf_ends:
            self.add("HeadEnd", joint, "Head", (0, 0.18, 0.0), level)
        for side, sign in (("R", -1.0), ("L", 1.0)):
            lowered = Rotation.from_euler("z", -sign * self.spec.lowered, degrees=True).as_matrix()
            spread = Rotation.from_euler("z", sign * self.spec.lowered / 10, degrees=True).as_matrix()
            wrist = self.limb(side, sign, chest, ARM, lowered, self.size[1])
            if self.spec.fingers:
                self.hand(side, sign, wrist, lowered)
            self.limb(side, sign, pelvis, LEG, spread, self.size[2])

    def limb(self, side: str, sign: float, joint: int, bones: dict, turn: np.ndarray, size: float) -> int:
        for part, bone in bones.items():
            flat = part in ("Collar", "Ankle", "Foot")
            name = self.label(part, side=side)
            bone = np.array(bone) * size * (sign, 1, 1)
            role = f"{side}_{part}"
            self.joints[role] = top = self.add(name, joint, role, bone, np.eye(3) if flat else turn)
            joint = top
            if part in ("Shoulder", "Elbow", "Hip", "Knee") and self.spec.twists != "none":
                following = list(bones.values())[list(bones).index(part) + 1]
                half = np.array(following) * size * (sign, 1, 1) * 0.5
                twist = DIALECTS[self.spec.dialect].get("Twist", "").format(part=name)
                helper = self.add(twist, top, role, half, turn)
                if self.spec.twists == "chain":
                    # The bone itself is rolled less: the twist bone has the rest of the roll.
                    self.rolled[top] = np.radians(-25) * half / np.linalg.norm(half)
                    joint = helper
        if self.spec.leaf_ends:
            last = list(bones)[-1]
            tip = (0.17 * sign, 0, 0) if last == "Wrist" else (0, -0.02, 0.06)
            turn = turn if last == "Wrist" else np.eye(3)
            if not (self.spec.fingers and last == "Wrist"):
                self.add(f"{self.names[joint]}_end", joint, f"{side}_{last}", tip, turn)
        return joint

    def hand(self, side: str, sign: float, wrist: int, turn: np.ndarray) -> None:
        for finger, base in FINGERS.items():
            joint, bone = wrist, np.array(base) * (sign, 1, 1)
            for number in (1, 2, 3):
                role = f"{side}_{finger}{number}"
                name = self.label("Finger", number, side, finger)
                self.joints[role] = joint = self.add(name, joint, role, bone, turn)
                along = (0.03, -0.012, 0.03) if finger == "Thumb" else (0.035 + 0.005 * (finger == "Middle"), 0.0, 0.0)
                bone = np.array(along) * (sign, 1, 1)

    def tips(self) -> list[tuple[int, np.ndarray]]:
        """Leaves, and where their bones end in a T-pose."""
        found = []
        for joint in sorted(set(range(len(self.names))) - set(self.parents)):
            along = {"Head": (0, 0.18, 0), "L_Foot": (0, -0.02, 0.06), "R_Foot": (0, -0.02, 0.06)}.get(
                self.parts[joint]
            )
            tip = self.bones[joint] * 0.5 if along is None else np.array(along)
            found.append((joint, tip * self.spec.scale * (joint not in self.marks)))
        return found

    def local_axes(self) -> np.ndarray:
        """``R_rest_joint`` of every joint."""
        if self.spec.frames == "world":
            return np.tile(np.eye(3), (len(self.names), 1, 1))
        turned = Rotation.random(len(self.names), rng=self.rng)
        if self.spec.frames == "random":
            return turned.as_matrix()
        group = Rotation.create_group("O").as_matrix()
        return np.round(group[self.rng.integers(24, size=len(self.names))])

    def motion(self, poses: Poses) -> tuple[Motion, dict[str, int]]:
        self.grow()
        count, frames = len(self.names), len(poses.hips)
        stand = {
            "Y": np.eye(3),
            "Z": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
            "-Y": np.diag([-1.0, -1, 1]),
            "X": np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
        }[self.spec.up]
        axes = self.local_axes()
        turns = np.stack([stand @ turn for turn in self.turns])
        rest_bones = np.einsum("jab,jb->ja", turns[[max(p, 0) for p in self.parents]], np.stack(self.bones))
        offsets = np.stack([axes[max(p, 0)].T @ bone for p, bone in zip(self.parents, rest_bones, strict=True)])
        # R_world_joint = stand G A^T with A = R_rest_joint^T R_rest_anatomy.
        align = np.swapaxes(axes, -1, -2) @ turns
        world = np.empty((frames + 1, count, 3, 3))
        world[0] = axes
        for joint, part in enumerate(self.parts):
            pose = poses.parts[part] if part else np.tile(np.eye(3), (frames, 1, 1))
            if self.weight[joint] < 1:
                low, high = Rotation.from_matrix(poses.parts["Pelvis"]), Rotation.from_matrix(pose)
                step = (low.inv() * high).as_rotvec() * self.weight[joint]
                pose = (low * Rotation.from_rotvec(step)).as_matrix()
            if joint in self.rolled:
                pose = pose @ Rotation.from_rotvec(self.rolled[joint]).as_matrix()
            world[1:, joint] = stand @ pose @ align[joint].T
        local = world.copy()
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                local[:, joint] = np.swapaxes(world[:, parent], -1, -2) @ world[:, joint]
        crown = align[self.joints["Head"]] @ np.array([0, 0.18, 0]) * self.spec.scale
        ends = () if self.spec.leaf_ends else ((self.joints["Head"], tuple(crown.tolist())),)
        if self.spec.tips:
            ends = tuple((joint, tuple((align[joint] @ tip).tolist())) for joint, tip in self.tips())
        lengths = (offsets * self.spec.scale).astype(np.float32)
        skeleton = Skeleton(lengths, tuple(self.names), tuple(self.parents), ends)
        root = np.concatenate([poses.hips[:1], poses.hips]) @ stand.T * self.spec.scale * self.size[2]
        moving = Motion(local.astype(np.float32), root.astype(np.float32), skeleton, 30.0)
        return moving, self.joints


def carrier(spec: Spec, joints: dict[str, int], part: str) -> int:
    """The joint that has the whole pose of a part: its twist bone where that is in the chain."""
    return joints[part] + (spec.twists == "chain" and part[2:] in ("Shoulder", "Elbow", "Hip", "Knee"))


def world(motion: Motion) -> np.ndarray:
    """Orientations in the world; in NumPy, since a rig met once is not worth compiling for."""
    turns = np.asarray(motion.rotations, float).copy()
    for joint, parent in enumerate(motion.skeleton.parents):
        if parent >= 0:
            turns[:, joint] = turns[:, parent] @ turns[:, joint]
    return turns


def places(motion: Motion) -> np.ndarray:
    """Positions in the world."""
    turns, found = world(motion), np.zeros((motion.frames, motion.skeleton.joints, 3))
    found[:, 0] = motion.root
    for joint, parent in enumerate(motion.skeleton.parents):
        if parent >= 0:
            found[:, joint] = found[:, parent] + turns[:, parent] @ np.asarray(motion.skeleton.offsets)[joint]
    return found


def angle(first: np.ndarray, second: np.ndarray) -> float:
    """Largest angle between rotations, degrees."""
    chord = np.linalg.norm(np.asarray(first, float) - second, axis=(-2, -1)) / math.sqrt(8)
    return float(np.degrees(2 * np.arcsin(np.clip(chord, 0, 1))).max())
