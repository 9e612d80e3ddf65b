"""BVH text as people have it: encodings, numbers in rows of any length, commas, headers that do not fit."""

import re

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.geometry.retarget import find_rig
from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.bvh import read_bvh

JOINTS = (
    ("Hips", "", (0, 95, 0)), ("Spine", "Hips", (0, 10, 0)), ("Chest", "Spine", (0, 14, 0)),
    ("Neck", "Chest", (0, 20, 0)), ("Head", "Neck", (0, 10, 2)),
    *((f"{side}{name}", f"{side}{above}" if above in ("Shoulder", "Arm", "ForeArm", "UpLeg", "Leg", "Foot") else above,
       (sign * x, y, z))
      for side, sign in (("Left", 1), ("Right", -1))
      for name, above, (x, y, z) in (
          ("Shoulder", "Chest", (4, 14, 0)), ("Arm", "Shoulder", (14, 0, 0)), ("ForeArm", "Arm", (28, 0, 0)),
          ("Hand", "ForeArm", (26, 0, 0)), ("UpLeg", "Hips", (9, -3, 0)), ("Leg", "UpLeg", (0, -43, 0)),
          ("Foot", "Leg", (0, -42, 0)), ("ToeBase", "Foot", (0, -6, 14)))),
)  # fmt: skip
FRAMES, CHANNELS = 40, 3 + 3 * len(JOINTS)


def document(names=None, rows=None):
    """A person of 21 joints who waves, as lines of text."""
    names = names or {}
    children = {name: [one for one, above, _ in JOINTS if above == name] for name, _, _ in JOINTS}
    offsets = {name: offset for name, _, offset in JOINTS}
    lines = ["HIERARCHY"]

    def block(name, keyword):
        lines.extend([f"{keyword} {names.get(name, name)}", "{"])
        lines.append("OFFSET " + " ".join(f"{x:.6f}" for x in offsets[name]))
        place = "6 Xposition Yposition Zposition" if keyword == "ROOT" else "3"
        lines.append(f"CHANNELS {place} Zrotation Xrotation Yrotation")
        for child in children[name]:
            block(child, "JOINT")
        if not children[name]:
            lines.extend(["End Site", "{", "OFFSET 0.000000 0.000000 5.000000", "}"])
        lines.append("}")

    block("Hips", "ROOT")
    rows = numbers() if rows is None else rows
    return lines, ["MOTION", f"Frames: {len(rows)}", "Frame Time: 0.033333"], [
        " ".join(f"{x:.6f}" for x in row) for row in rows
    ]  # fmt: skip


def numbers():
    time = np.arange(FRAMES)[:, None] / 30
    values = 15 * np.sin(2 * time + np.arange(CHANNELS)[None] / 7)
    values[:, :3] = [0, 95, 0]
    return values


def write(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "a.bvh"
    path.write_bytes(text.encode(encoding))
    return path


def whole(parts):
    return "\n".join([*parts[0], *parts[1], *parts[2]]) + "\n"


def expect_same(path):
    plain = write(path.parent / "plain", whole(document())) if (path.parent / "plain").mkdir() is None else None
    motion, expected = read_bvh(path), read_bvh(plain)
    np.testing.assert_allclose(motion.rotations, expected.rotations, atol=1e-6)
    np.testing.assert_allclose(motion.root, expected.root, atol=1e-6)
    report = inspect(path)
    assert report.warnings == 0, report.text()
    assert report.facts["motion"]["frames"] == FRAMES


@pytest.mark.parametrize(
    "encoding",
    ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le", "ascii"],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_encodings_of_unicode(encoding, end, tmp_path):
    expect_same(write(tmp_path, whole(document()).replace("\n", end), encoding))


SIDES = {"Left": ("左", "왼쪽 "), "Right": ("右", "오른쪽 ")}
JAPANESE = {
    "Hips": "センター", "Spine": "上半身", "Chest": "上半身2", "Neck": "首", "Head": "頭", "Shoulder": "肩",
    "Arm": "腕", "ForeArm": "ひじ", "Hand": "手首", "UpLeg": "足", "Leg": "ひざ", "Foot": "足首", "ToeBase": "つま先",
}  # fmt: skip
CHINESE = {
    "Hips": "骨盆", "Spine": "脊柱1", "Chest": "脊柱2", "Neck": "颈", "Head": "头", "Shoulder": "锁骨", "Arm": "上臂",
    "ForeArm": "前臂", "Hand": "手", "UpLeg": "大腿", "Leg": "小腿", "Foot": "脚", "ToeBase": "脚趾",
}  # fmt: skip
KOREAN = {
    "Hips": "골반", "Spine": "척추1", "Chest": "척추2", "Neck": "목", "Head": "머리", "Shoulder": "어깨", "Arm": "팔",
    "ForeArm": "팔꿈치", "Hand": "손목", "UpLeg": "허벅지", "Leg": "무릎", "Foot": "발목", "ToeBase": "발가락",
}  # fmt: skip


def translated(words, language):
    names = {}
    for name, _, _ in JOINTS:
        side = next((side for side in SIDES if name.startswith(side)), "")
        names[name] = (SIDES[side][language] if side else "") + words[name.removeprefix(side)]
    return names


@pytest.mark.parametrize(
    ("words", "language", "encoding"),
    [
        (JAPANESE, 0, "shift-jis"), (JAPANESE, 0, "euc-jp"), (JAPANESE, 0, "utf-8"), (JAPANESE, 0, "utf-16"),
        (CHINESE, 0, "gbk"), (CHINESE, 0, "utf-16-le"), (KOREAN, 1, "cp949"), (KOREAN, 1, "utf-8"),
    ],
)  # fmt: skip
def test_names_in_other_scripts(words, language, encoding, tmp_path):
    names = translated(words, language)
    path = write(tmp_path, whole(document(names)), encoding)
    motion = read_bvh(path)
    assert set(motion.skeleton.names) == {" ".join(name.split()) for name in names.values()}
    rig, plain = find_rig(motion), find_rig(read_bvh(write(tmp_path, whole(document()))))
    assert not rig.by_shape
    assert rig.roles == plain.roles
    assert inspect(path).warnings == 0


def test_western_names_and_unknown_ones(tmp_path):
    path = write(tmp_path, whole(document({"Head": "Kopf_für_Töne"})), "cp1252")
    assert "Kopf_für_Töne" in read_bvh(path).skeleton.names
    path = write(tmp_path, whole(document({"Head": "Голова"})), "cp1251")
    assert read_bvh(path).skeleton.joints == len(JOINTS)


@pytest.mark.parametrize("width", [1, 7, 12, CHANNELS - 1, CHANNELS + 1, 2 * CHANNELS, 10**9])
def test_rows_of_any_width(width, tmp_path):
    head, header, rows = document()
    tokens = " ".join(rows).split()
    lines = [" ".join(tokens[at : at + width]) for at in range(0, len(tokens), width)]
    expect_same(write(tmp_path, whole((head, header, lines))))


@pytest.mark.parametrize("width", [5, 12, 40])
def test_each_frame_over_several_lines(width, tmp_path):
    head, header, rows = document()
    lines = [" ".join(row.split()[at : at + width]) for row in rows for at in range(0, CHANNELS, width)]
    expect_same(write(tmp_path, whole((head, header, lines))))


def test_everything_on_one_line(tmp_path):
    expect_same(write(tmp_path, " ".join(whole(document()).split())))


@pytest.mark.parametrize("frames", [1, 2, 5])
def test_few_key_frames_a_second_apart(frames, tmp_path):
    head, header, rows = document(rows=numbers()[:: FRAMES // frames][:frames])
    path = write(tmp_path, whole((head, [*header[:2], "Frame Time: 1.0"], rows)))
    motion = read_bvh(path)
    assert (motion.frames, motion.fps) == (frames, 1.0)
    report = inspect(path)
    assert {finding.code for finding in report.findings if finding.severity == "warning"} <= {"frozen"}


def refusal(path):
    with pytest.raises(InputError) as caught:
        read_bvh(path)
    text = str(caught.value)
    assert "\n" not in text
    assert str(path) in text
    return text


@pytest.mark.parametrize("cut", [1, 20, CHANNELS, CHANNELS + 3])
@pytest.mark.parametrize("width", [12, 10**9])
def test_fewer_numbers_than_promised(cut, width, tmp_path):
    head, header, rows = document()
    tokens = " ".join(rows).split()[:-cut]
    lines = [" ".join(tokens[at : at + width]) for at in range(0, len(tokens), width)]
    path = write(tmp_path, whole((head, header, lines)))
    text = refusal(path)
    assert ("missing" in text and f"{FRAMES * CHANNELS - cut} in" in text) or f"the file has {FRAMES - 1}" in text
    assert "cut short" in text
    report = inspect(path)
    assert report.warnings >= 1


def test_more_numbers_than_promised(tmp_path):
    head, header, rows = document()
    text = refusal(write(tmp_path, whole((head, header, [" ".join(rows) + " 1 2 3"]))))
    assert "3 are too many" in text
    assert "Frames: 41" in refusal(write(tmp_path, whole((head, header, [" ".join([*rows, rows[0]])]))))


def test_rows_that_count_the_frames(tmp_path):
    head, header, rows = document()
    counted = [f"{at} {row}" for at, row in enumerate(rows)]
    assert "the first counts the frames; remove that column" in refusal(write(tmp_path, whole((head, header, counted))))


def commas(text):
    return re.sub(r"(?<=[0-9])\.(?=[0-9])", ",", text)


@pytest.mark.parametrize("part", ["OFFSET", "Frame Time", "MOTION", "all", "one line"])
def test_decimal_commas(part, tmp_path):
    head, header, rows = document()
    if part in ("OFFSET", "all"):
        head = [commas(line) for line in head]
    if part in ("Frame Time", "all"):
        header = [commas(line) for line in header]
    if part in ("MOTION", "all", "one line"):
        rows = [commas(row) for row in rows]
    rows = [" ".join(rows)] if part == "one line" else rows
    path = write(tmp_path, whole((head, header, rows)))
    assert "a decimal comma" in refusal(path)
    try:
        text = inspect(path).text()
    except InputError as error:
        text = str(error)
    assert "a decimal comma" in text


@pytest.mark.parametrize("separator", [", ", ",", ";", "; "])
@pytest.mark.parametrize("part", ["OFFSET", "CHANNELS", "MOTION"])
def test_separators(separator, part, tmp_path):
    head, header, rows = document()

    def separated(line):
        first, _, rest = line.partition(" ")
        return f"{first} {rest.replace(' ', separator)}"

    if part == "MOTION":
        rows = [row.replace(" ", separator) for row in rows]
    else:
        head = [separated(line) if line.startswith(part) else line for line in head]
    text = refusal(write(tmp_path, whole((head, header, rows))))
    assert ("semicolons" if ";" in separator else "commas") + " separate the values" in text


def test_a_header_of_another_rate(tmp_path):
    """Every eighth frame under the old header: the frame time is wrong as well as the number."""
    head, _, rows = document()
    path = write(tmp_path, whole((head, ["MOTION", "Frames: 319", "Frame Time: 0.00833333"], rows)))
    for text in (refusal(path), inspect(path).text()):
        assert "Frames: 40" in text
        assert "Frame Time: 0.066667' (15 fps)" in text
    path = write(tmp_path, whole((head, ["MOTION", "Frames: 43", "Frame Time: 0.00833333"], rows)))
    assert "is the file cut short? Restore it, or write 'Frames: 40'." in refusal(path)
    path = write(tmp_path, whole((head, ["MOTION", "Frames: 20", "Frame Time: 0.033333"], rows)))
    assert "(60 fps)" in refusal(path)
