"""Generated recordings in the forms of the data sets: their joints, channels and rates, with values that are known."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from a2g_jax.io.audio import write_audio

_FINGERS = ("Thumb", "Index", "Middle", "Ring", "Pinky")


def _arm(side: str, fingers: str, ends: str = "") -> str:
    hand = f"{side}Hand"
    return f"Spine3>{side}Shoulder>{side}Arm>{side}ForeArm>{hand}; {fingers}{ends}".replace("@", hand).replace(
        "#", side
    )


_BEAT_FINGERS = "; ".join(
    f"@>@{name}1>@{name}2>@{name}3>@{name}4"
    if name in ("Middle", "Thumb")
    else f"@>@{name}>@{name}1>@{name}2>@{name}3>@{name}4"
    for name in ("Middle", "Ring", "Pinky", "Index", "Thumb")
)
_TRUNK = "Hips>Spine>Spine1>Spine2>Spine3>Neck>Neck1>Head"
#: Chains of joints, each from one that stands before; in the order of the files.
TREES = {
    "beat": "; ".join(
        [f"{_TRUNK}>HeadEnd", *(_arm(side, _BEAT_FINGERS) for side in ("Right", "Left"))]
        + [f"Hips>{s}UpLeg>{s}Leg>{s}Foot>{s}ForeFoot>{s}ToeBase>{s}ToeBaseEnd" for s in ("Right", "Left")]
    ),
    "trinity": "; ".join(
        [_TRUNK]
        + [_arm(s, "; ".join(f"@>@{name}1>@{name}2>@{name}3" for name in _FINGERS)) for s in ("Right", "Left")]
        + [f"Hips>{s}UpLeg>{s}Leg>{s}Foot>{s}ForeFoot>{s}ToeBase" for s in ("Right", "Left")]
    ),
    "zeroeggs": "; ".join(
        [f"{_TRUNK}>HeadEnd"]
        + [
            _arm(
                s,
                "; ".join(f"@>@{name}1>@{name}2>@{name}3>@{name}4" for name in _FINGERS),
                "; #ForeArm>#ForeArmEnd; #Arm>#ArmEnd",
            )
            for s in ("Right", "Left")
        ]
        + [
            f"Hips>{s}UpLeg>{s}Leg>{s}Foot>{s}ToeBase>{s}ToeBaseEnd; {s}Leg>{s}LegEnd; {s}UpLeg>{s}UpLegEnd"
            for s in ("Right", "Left")
        ]
    ),
    "talking_with_hands": (
        "body_world>b_root>b_spine0>b_spine1>b_spine2>b_spine3>b_neck0>b_head>b_head_null; b_head>b_l_eye; "
        "b_head>b_r_eye; b_head>b_jaw>b_jaw_null; b_jaw>b_teeth; "
        "b_jaw>b_tongue0>b_tongue1>b_tongue2>b_tongue3>b_tongue4>b_l_tongue4_1; b_tongue4>b_r_tongue4_1; "
        "b_tongue3>b_l_tongue3_1; b_tongue3>b_r_tongue3_1; b_tongue2>b_l_tongue2_1; b_tongue2>b_r_tongue2_1; "
        "b_tongue1>b_r_tongue1_1; b_tongue1>b_l_tongue1_1; "
        "b_spine3>b_r_shoulder>p_r_scap>b_r_arm>b_r_arm_twist>b_r_forearm>b_r_wrist_twist>b_r_wrist; "
        + "; ".join(f"b_r_wrist>b_r_{f}1>b_r_{f}2>b_r_{f}3" for f in ("index", "ring", "middle", "pinky"))
        + "; b_r_wrist>b_r_thumb0>b_r_thumb1>b_r_thumb2>b_r_thumb3; b_spine3>b_l_shoulder>p_l_delt; "
        "b_l_shoulder>p_l_scap>b_l_arm>b_l_arm_twist>b_l_forearm>b_l_wrist_twist>b_l_wrist; "
        "b_l_wrist>b_l_thumb0>b_l_thumb1>b_l_thumb2>b_l_thumb3; "
        + "; ".join(f"b_l_wrist>b_l_{f}1>b_l_{f}2>b_l_{f}3" for f in ("index", "middle", "ring", "pinky"))
        + "; b_spine2>p_navel; b_root>b_r_upleg>b_r_leg>b_r_foot_twist>b_r_foot; "
        "b_root>b_l_upleg>b_l_leg>b_l_foot_twist>b_l_foot"
    ),
}
ORDERS = {"beat": "XYZ", "trinity": "ZXY", "zeroeggs": "ZYX", "talking_with_hands": "ZXY"}


def tree(text: str) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Names and parents, in depth-first order."""
    names: list[str] = []
    parents: list[int] = []
    for chain in text.split("; "):
        for parent, child in zip([None, *chain.split(">")], chain.split(">"), strict=False):
            if child not in names:
                parents.append(-1 if parent is None else names.index(parent))
                names.append(child)
    return tuple(names), tuple(parents)


@dataclass(frozen=True)
class Written:
    """What was written into a BVH file."""

    names: tuple[str, ...]
    positions: np.ndarray
    """(T, J, 3), metres, by our own kinematics."""
    fps: float


def write_motion(path: Path, kind: str, seconds: float, fps: float, seed: int = 0) -> Written:
    """A BVH file of a data set's joints, centimetres, with random smooth rotations."""
    rng = np.random.default_rng(seed)
    names, parents = tree(TREES[kind])
    joints, frames = len(names), round(seconds * fps)
    six = kind == "talking_with_hands"  # every joint has a position too
    offsets = np.round(rng.uniform((-8, -4, -8), (8, 12, 8), (joints, 3)), 6)
    phase = rng.uniform(0, 6, (joints, 3)) + np.arange(frames)[:, None, None] * rng.uniform(0.01, 0.1, (joints, 3))
    angles = np.round(40 * np.sin(phase), 6)  # in the order of the channels
    root = np.round([0, 90, 0] + 20 * np.sin(phase[:, 0]), 6)

    lines, depth = ["HIERARCHY"], [0] * joints
    for joint, name in enumerate(names):
        depth[joint] = depth[parents[joint]] + 1 if joint else 0
        before = depth[joint - 1] if joint else -1
        if joint and depth[joint] <= before:
            lines += ["End Site", "{", "OFFSET 0 2 0", "}"]
        lines += ["}"] * (before - depth[joint] + 1)
        lines += [f"{'JOINT' if joint else 'ROOT'} {name}", "{", "OFFSET {:.6f} {:.6f} {:.6f}".format(*offsets[joint])]
        rotations = " ".join(f"{axis}rotation" for axis in ORDERS[kind])
        places = "Xposition Yposition Zposition " if six or not joint else ""
        lines.append(f"CHANNELS {6 if places else 3} {places}{rotations}")
    lines += ["End Site", "{", "OFFSET 0 2 0", "}", *["}"] * (depth[-1] + 1)]
    lines += ["MOTION", f"Frames: {frames}", f"Frame Time: {1 / fps:.6f}"]
    block = np.concatenate([np.broadcast_to(offsets, (frames, joints, 3)), angles], axis=2) if six else angles
    block = block.reshape(frames, -1)
    block = np.concatenate([root, block[:, 3:] if six else block], axis=1)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="\r\n") as file:
        file.write("\n".join(lines) + "\n")
        np.savetxt(file, block, fmt="%.6f")
    return Written(names, 0.01 * _kinematics(parents, offsets, angles, root, ORDERS[kind]), fps)


def _kinematics(parents, offsets, angles, root, order) -> np.ndarray:
    frames, joints = angles.shape[:2]
    local = Rotation.from_euler(order, angles.reshape(-1, 3), degrees=True).as_matrix().reshape(frames, joints, 3, 3)
    world, places = [local[:, 0]], [root]
    for joint in range(1, joints):
        parent = parents[joint]
        places.append(places[parent] + world[parent] @ offsets[joint])
        world.append(world[parent] @ local[:, joint])
    return np.stack(places, axis=1)


def write_sound(path: Path, seconds: float, rate: int = 16000, seed: int = 0) -> np.ndarray:
    """A 16-bit WAV file of a few tones; the samples that a reader at this rate should find."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate)) / rate
    tones = sum(np.sin(2 * np.pi * (frequency * time + rng.random())) for frequency in rng.uniform(100, 900, 4))
    samples = np.round(0.15 * np.asarray(tones) * 32768).astype(np.float32) / 32768
    path.parent.mkdir(parents=True, exist_ok=True)
    write_audio(path, samples, rate)
    return samples


def check_motion(motion, written: Written) -> None:
    """A motion that was read has the positions that were written."""
    assert motion.fps == written.fps
    assert motion.skeleton.names == written.names
    np.testing.assert_allclose(motion.positions(), written.positions, atol=2e-5)


def check_sound(audio: np.ndarray, samples: np.ndarray) -> None:
    """Audio that was read is what was written, to 16 bit."""
    assert audio.dtype == np.float32
    np.testing.assert_allclose(audio, samples, atol=1 / 32768)


def put(path: Path, content: str | bytes) -> Path:
    """A file, and the folders above it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path
