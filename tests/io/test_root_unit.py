"""Roots in another unit than the offsets are warned of; in-place and moving takes are not."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.errors import InputError, InputWarning
from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.bvh import read_bvh, write_bvh
from a2g_jax.talker.recordings import talk


@pytest.fixture(scope="module")
def take():
    return talk(3.0, 3).motion.clip(0, 60)


def written(path, motion, factor):
    """A BVH file whose root positions are multiplied, and nothing else."""
    write_bvh(path, replace(motion, root=np.asarray(motion.root) * np.float32(factor)))
    return path


@pytest.mark.parametrize(("factor", "words"), [(0.01, "100 times too small"), (0.001, "1000 times too small"),
                                              (0.1, "10 times too small"), (10.0, "10 times too large")])  # fmt: skip
def test_another_unit(tmp_path, take, factor, words):
    path = written(tmp_path / "a.bvh", take, factor)
    with pytest.warns(InputWarning, match=f"a.bvh: positions of the root seem .*: {words} for legs of"):
        read_bvh(path)
    assert "root-unit" in {finding.code for finding in inspect(path).findings}


@pytest.mark.parametrize("root", ["as it is", "zero", "walking in place", "sitting", "crouching"])
def test_no_false_alarm(tmp_path, take, root):
    places = np.array(take.root)
    if root == "zero":
        places[:] = 0
    elif root == "walking in place":
        places -= places.mean(axis=0)
    elif root == "sitting":
        places[:, 1] *= 0.5
    elif root == "crouching":
        places[:, 1] *= np.linspace(1.0, 0.1, len(places))
    write_bvh(tmp_path / "a.bvh", replace(take, root=places))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_bvh(tmp_path / "a.bvh")


@pytest.mark.parametrize(("number", "hint"), [("33.3333", "milliseconds? Write 0.033333"), ("30", "frames per s")])
def test_frame_times_in_other_units(tmp_path, take, number, hint):
    path = written(tmp_path / "a.bvh", take, 1.0)
    path.write_text(re.sub(r"(?<=Frame Time: )\S+", number, path.read_text()))
    with pytest.raises(InputError, match=re.escape(hint)):
        read_bvh(path)
