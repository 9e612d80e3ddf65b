"""Damaged files give a report or the package's own error, never another, and a report is always JSON."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recordings_for_tests import clean, write_pair

from a2g_jax.errors import InputError
from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.npz import write_motion_npz


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    folder = tmp_path_factory.mktemp("originals")
    short = replace(clean(0), motion=clean(0).motion.clip(0, 12), audio=clean(0).audio[:4000])
    bvh, wav = write_pair(folder, short)
    write_motion_npz(folder / "m.npz", short.motion)
    poses = {"poses": np.zeros((5, 165)), "trans": np.zeros((5, 3)), "mocap_frame_rate": np.array(30)}
    np.savez(folder / "s.npz", **poses)
    return [path.read_bytes() for path in (bvh, wav, folder / "m.npz", folder / "s.npz")]


def look(path, audio=None):
    refused = ""
    try:
        report = inspect(path, audio)
    except InputError as error:
        refused = str(error)
    if refused:
        assert "\n" not in refused
        return
    json.dumps(report.to_json(), allow_nan=False)
    assert report.text()


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damaged_files(originals, tmp_path, data):
    kind = data.draw(st.integers(0, 3))
    content = bytearray(originals[kind])
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        match data.draw(st.sampled_from(["cut", "flip", "drop", "insert"])):
            case "cut":
                del content[max(at, 1) :]
            case "flip":
                content[at] ^= 1 << data.draw(st.integers(0, 7))
            case "drop":
                del content[at : at + data.draw(st.integers(1, 40))]
            case "insert":
                content[at:at] = data.draw(st.sampled_from([b"nan ", b"-", b"1e30 ", b"\n", b"\0", b"} ", b"9"]))
        if not content:
            content = bytearray(b"x")
    path = tmp_path / ("a.bvh", "a.wav", "a.npz", "a.npz")[kind]
    path.write_bytes(bytes(content))
    look(path)


@pytest.mark.parametrize(
    "arrays",
    [
        {"poses": np.zeros((5, 165)), "trans": np.zeros((4, 3)), "mocap_frame_rate": np.array(30)},
        {"poses": np.zeros((0, 165)), "trans": np.zeros((0, 3)), "mocap_frame_rate": np.array(30)},
        {"poses": np.zeros((5, 3)), "trans": np.zeros((5, 3)), "mocap_frame_rate": np.array([30, 30])},
        {"poses": np.full((5, 165), np.nan), "trans": np.zeros((5, 3)), "mocap_frame_rate": np.array(30)},
        {"rotations": 1, "root": 1, "joint_names": 1, "parents": 1, "offsets": 1, "fps": 1},
        {"empty": np.zeros((0, 3), np.float16)},
        {},
    ],
)
def test_odd_arrays(arrays, tmp_path):
    np.savez(tmp_path / "a.npz", **arrays)
    look(tmp_path / "a.npz")


def test_motions_of_one_and_two_frames(tmp_path):
    for frames in (1, 2, 5):
        bvh, wav = write_pair(tmp_path, replace(clean(0), motion=clean(0).motion.clip(0, frames)))
        look(bvh)
        look(bvh, wav)
