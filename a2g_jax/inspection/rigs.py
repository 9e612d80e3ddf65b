"""Comparison of the skeletons of several recordings: joints, bones, rest poses."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from a2g_jax.geometry.retarget.poses import angle_between
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.inspection.finding import Finding, Place

#: Degrees between directions of a bone at rest: exporters round, and calibration moves a bone by a few degrees.
REST_ANGLE = 15.0
#: Ratio of the sizes of a skeleton and the median one from which another unit is likelier than another person.
OTHER_UNIT = 1.6
#: Share by which the bones of one person may differ between takes.
SAME_BONES = 0.02
#: Bones shorter than this have no direction worth comparing, metres (of a person of usual size).
_SHORT = 0.01


def check_skeletons(
    skeletons: Sequence[Skeleton], names: Sequence[str], speakers: Sequence[str] | None = None
) -> list[Finding]:
    """Findings on differences between the skeletons of recordings for one training.

    Args:
        names: names of the recordings.
        speakers: speaker of each, empty where unknown; bones may differ between people.
    """
    if len(skeletons) < 2:
        return []
    trees = Counter((one.names, one.parents) for one in skeletons)
    usual, count = trees.most_common(1)[0]
    findings: list[Finding] = []
    for one, name in zip(skeletons, names, strict=True):
        if (one.names, one.parents) != usual:
            message = f"has other joints than {count} of the {len(skeletons)} recordings{_difference(one, usual[0])}."
            fix = "Retarget it, or prepare the 22 body joints only."
            findings.append(Finding("warning", "skeleton", message, fix, Place(recording=name)))
    alike = [at for at, one in enumerate(skeletons) if (one.names, one.parents) == usual]
    sizes = [float(np.linalg.norm(np.asarray(skeletons[at].offsets)[1:], axis=1).sum()) for at in alike]
    for at, size in zip(list(alike), sizes, strict=True):
        ratio = size / max(float(np.median(sizes)), 1e-9)
        if not 1 / OTHER_UNIT < ratio < OTHER_UNIT:
            alike.remove(at)
            message = f"is {ratio:.3g} times as large as the usual skeleton here."
            fix = "If it is in another unit, name it when reading (scale of read_bvh)."
            findings.append(Finding("warning", "unit", message, fix, Place(recording=names[at]), ratio))
    return findings + _offsets(
        [skeletons[at] for at in alike],
        [names[at] for at in alike],
        [speakers[at] for at in alike] if speakers else [""] * len(alike),
    )


def _difference(skeleton: Skeleton, usual: tuple[str, ...]) -> str:
    missing = [name for name in usual if name not in skeleton.names]
    new = [name for name in skeleton.names if name not in usual]
    parts = [f"lacks {', '.join(missing[:5])}"] * bool(missing) + [f"has {', '.join(new[:5])}"] * bool(new)
    return f" ({'; '.join(parts)})" if parts else " (the same in another order or tree)"


def _offsets(skeletons: Sequence[Skeleton], names: Sequence[str], speakers: Sequence[str]) -> list[Finding]:
    if len(skeletons) < 2:
        return []
    offsets = np.stack([np.asarray(one.offsets, np.float64)[1:] for one in skeletons])
    if offsets.shape[1] == 0:
        return []
    joints = skeletons[0].names[1:]
    lengths = np.linalg.norm(offsets, axis=-1)
    sizes = lengths.sum(axis=1)
    size = float(np.median(sizes))
    middle = np.median(offsets / np.maximum(sizes, 1e-9)[:, None, None], axis=0) * size
    long = np.linalg.norm(middle, axis=-1) > _SHORT * size / 4
    findings = []
    for at, name in enumerate(names):
        angles = np.where(long & (lengths[at] > 1e-6), angle_between(offsets[at], middle), 0.0)
        worst = int(np.argmax(angles))
        if angles[worst] > REST_ANGLE:
            message = (
                f"its rest pose differs: {int((angles > REST_ANGLE).sum())} bones point elsewhere than in most "
                f"recordings here, {joints[worst]} by {angles[worst]:.0f} degrees."
            )
            fix = "Retarget it to the usual skeleton; equal rotations mean other poses on it."
            place = Place(recording=name, joint=joints[worst])
            findings.append(Finding("warning", "rest-pose", message, fix, place, float(angles[worst])))
    return findings + _bones(lengths, names, speakers, joints, long)


def _bones(lengths, names: Sequence[str], speakers: Sequence[str], joints: Sequence[str], long) -> list[Finding]:
    findings = []
    spread = 0.0
    for speaker in dict.fromkeys(speakers):
        rows = np.flatnonzero(np.asarray(speakers) == speaker)
        usual = np.median(lengths[rows], axis=0)
        off = np.where(long, np.abs(lengths[rows] / np.maximum(usual, 1e-9) - 1), 0.0)
        spread = max(spread, float(off.max()))
        for row in rows[off.max(axis=1) > SAME_BONES] if speaker else []:
            worst = int(np.argmax(np.where(long, np.abs(lengths[row] / np.maximum(usual, 1e-9) - 1), 0.0)))
            share = float(lengths[row, worst] / usual[worst])
            message = f"bones are not those of {speaker}'s other recordings: {joints[worst]} {share:.2f} times as long."
            fix = "Check the calibration and the name of the speaker."
            findings.append(Finding("warning", "bones", message, fix, Place(recording=names[row]), share))
    if spread > SAME_BONES and not findings and not any(speakers):
        message = f"bones differ by up to {100 * spread:.0f} % between the recordings, as between people."
        findings.append(Finding("info", "bones", message, value=spread))
    return findings
