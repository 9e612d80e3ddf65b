"""The language of edits, and what each does to the bands of a code."""

import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.features.dct import block_dct
from a2g_jax.models.audio2gestures import edit_presets
from a2g_jax.models.audio2gestures.edit_presets import EDIT_PRESETS, expanded
from a2g_jax.models.audio2gestures.edits import Edit, apply_edits, parse_edit
from a2g_jax.models.audio2gestures.sampling import Audio2GesturesSampling

POINTS = 16
CODE = jnp.asarray(np.random.default_rng(0).normal(size=(2, 2 * POINTS, 3)), jnp.float32)
OTHER = jnp.asarray(np.random.default_rng(1).normal(size=CODE.shape), jnp.float32)


def bands(code):
    return np.asarray(block_dct(code, POINTS)).reshape(2, 2, POINTS, 3)


@pytest.mark.parametrize(
    ("text", "edit"),
    [
        ("specific keep 10", Edit("specific", "zero", 10, 16)),
        ("shared zero 3:5", Edit("shared", "zero", 3, 5)),
        ("shared scale :4 -1.5", Edit("shared", "scale", 0, 4, -1.5)),
        ("specific sample 2: 7", Edit("specific", "sample", 2, 16, 7)),
        ("specific swap 0:1", Edit("specific", "swap", 0, 1)),
    ],
)
def test_parse(text, edit):
    assert parse_edit(text, POINTS) == edit


@pytest.mark.parametrize(
    "text",
    [
        "",
        "keep 3",
        "motion keep 3",
        "shared keep 17",
        "shared keep -1",
        "shared keep 3 4",
        "shared blur 0:3",
        "shared zero 3",
        "shared zero 5:3",
        "shared zero 0:17",
        "shared scale 0:3",
        "shared scale 0:3 loud",
        "shared scale 0:3 inf",
        "shared zero 0:3 1",
        "shared sample 0:3 1.5",
    ],
)
def test_refused(text):
    with pytest.raises(InputError, match="for example 'specific keep 10'"):
        parse_edit(text, POINTS)


def test_keep_leaves_the_lowest_bands():
    before, after = bands(CODE), bands(apply_edits(CODE, [parse_edit("shared keep 5", POINTS)], POINTS))
    np.testing.assert_allclose(after[:, :, :5], before[:, :, :5], atol=1e-5)
    np.testing.assert_allclose(after[:, :, 5:], 0, atol=1e-5)


def test_keep_everything_changes_nothing():
    np.testing.assert_allclose(apply_edits(CODE, [parse_edit("shared keep 16", POINTS)], POINTS), CODE, atol=1e-5)


def test_keep_nothing_empties_the_code():
    np.testing.assert_allclose(apply_edits(CODE, [parse_edit("specific keep 0", POINTS)], POINTS), 0, atol=1e-6)


def test_scale_and_zero_one_after_another():
    edits = [parse_edit("shared scale 2:6 3", POINTS), parse_edit("shared zero 4:5", POINTS)]
    before, after = bands(CODE), bands(apply_edits(CODE, edits, POINTS))
    expected = before.copy()
    expected[:, :, 2:6] *= 3
    expected[:, :, 4] = 0
    np.testing.assert_allclose(after, expected, atol=1e-4)


@pytest.mark.parametrize("line", ["specific swap 1:4", "specific sample 1:4 9"])
def test_bands_from_another_code(line):
    values = []

    def other(edit):
        values.append(edit.value)
        return OTHER

    after = bands(apply_edits(CODE, [parse_edit(line, POINTS)], POINTS, other))
    expected = bands(CODE).copy()
    expected[:, :, 1:4] = bands(OTHER)[:, :, 1:4]
    np.testing.assert_allclose(after, expected, atol=1e-5)
    assert values == ([9] if "sample" in line else [0])


def test_another_code_must_be_given():
    with pytest.raises(ValueError, match="give one"):
        apply_edits(CODE, [parse_edit("shared swap 0:2", POINTS)], POINTS)


def test_no_edit_is_the_code_itself():
    assert apply_edits(CODE, [], POINTS) is CODE


def test_presets_are_lines_and_have_forgiving_names():
    for name, lines in EDIT_PRESETS.items():
        assert expanded([name]) == expanded([name.replace(" ", "-").upper()]) == lines
        for line in lines:
            parse_edit(line, 128)
        assert name in edit_presets.__doc__
    assert expanded(["shared keep 3", "calmer"]) == ("shared keep 3", *EDIT_PRESETS["calmer"])
    assert Audio2GesturesSampling(edits=("smoother",)).all_edits == ("shared keep 10",)
    with pytest.raises(InputError, match="or is one of: calmer, livelier"):
        parse_edit("louder", 128)
