"""Cases of BVH files."""

from pathlib import Path

import numpy as np

from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.retarget import body_skeleton, find_rig, retarget
from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.bvh import read_bvh
from experiments.cases.runner import Case, Outcome, finds, refuses, reported

#: Degrees and metres within which a file gives the motion of the sound one.
_SAME = 1e-4


def _hips_travel(path: Path) -> Outcome:
    motion = read_bvh(path)
    hips = motion.positions()[:, motion.skeleton.index("Hips")]
    source = find_rig(motion)
    moved = retarget(motion, body_skeleton(source), source=source)
    travels = [float(places[-1, 2] - places[0, 2]) for places in (hips, np.asarray(moved.root))]
    right = abs(travels[0] - 3.985) < 0.01 and abs(travels[1] - travels[0]) < 0.01 * travels[0]
    return right, f"Hips travel {travels[0]:.3f} m in z, retargeted {travels[1]:.3f} m"


def _cmu(path: Path) -> Outcome:
    report = inspect(path)
    motion = read_bvh(path)
    hips = float(motion.root[1:, 1].mean())
    thigh = float(np.linalg.norm(motion.skeleton.offsets[motion.skeleton.index("LeftLeg")]))
    first = any(finding.code == "calibration" and finding.place.frame == 0 for finding in report.findings)
    right = 0.9 < hips < 1.0 and 0.33 < thigh < 0.43 and first
    return right, f"hips {hips:.3f} m high, thigh {100 * thigh:.1f} cm; {reported(report, ('unit', 'calibration'))}"


def _same_as(other: str):
    def check(path: Path) -> Outcome:
        motion, expected = read_bvh(path), read_bvh(path.parent / other)
        if motion.frames != expected.frames:
            return False, f"{motion.frames} frames instead of {expected.frames}"
        turn = float(np.abs(motion.rotations - expected.rotations).max())
        away = float(np.abs(motion.root - expected.root).max())
        report = inspect(path)
        right = turn < _SAME and away < _SAME and report.warnings == 0
        return right, f"{motion.frames} frames, as {other}; {reported(report)}"

    return check


def _parts(path: Path) -> Outcome:
    roles = find_rig(read_bvh(path)).roles
    report = inspect(path)
    return len(roles) >= 20 and report.warnings == 0, f"{len(roles)} body parts; {reported(report)}"


def _body_joints(path: Path) -> bool:
    return find_body_joints(read_bvh(path).skeleton) is not None


def _no_body(path: Path) -> Outcome:
    report = inspect(path)
    found = [finding for finding in report.findings if finding.code == "no-body"]
    right = bool(found) and "no human body" in found[0].message and not _body_joints(path)
    return right, reported(report, ("no-body",))


CASES: tuple[Case, ...] = (
    Case("bvh/ref.bvh", "nothing reported", finds()),
    Case("bvh/good_30fps.bvh", "nothing reported", finds()),
    Case("bvh/static_root_hips_translate.bvh", "Hips travel 3.985 m in z, kept by retargeting", _hips_travel),
    Case("bvh/cmu_units_walk.bvh", "a unit of 5.644 cm, and the T-pose of frame 0", _cmu),
    Case("bvh/tpose_first.bvh", "a finding that names frame 0", finds("calibration", words="frame 0")),
    Case("bvh/dog_walk.bvh", "no human body", _no_body),
    Case("bvh/jitter_1p5deg.bvh", "jitter, with a number", finds("jitter")),
    Case("bvh/feet_shake_2cm.bvh", "feet that shake, with a number", finds("foot-shake")),
    Case("bvh/header_24_is_29p476.bvh", "29.5 fps proposed", finds("frame-time", words="29.5", audio="../wav/ref.wav")),
    Case("bvh/wrapped_frames.bvh", "90 frames, as ref.bvh", _same_as("ref.bvh")),
    Case("bvh/one_line_motion.bvh", "90 frames, as ref.bvh", _same_as("ref.bvh")),
    Case("bvh/decimal_commas.bvh", "the decimal comma named", refuses("decimal comma")),
    Case("bvh/frame_time_comma.bvh", "the decimal comma named", refuses("decimal comma")),
    Case("bvh/utf16_le_bom.bvh", "read, as ref.bvh", _same_as("ref.bvh")),
    Case("bvh/mmd_japanese_names_sjis.bvh", "20 body parts", _parts),
)
