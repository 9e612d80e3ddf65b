"""TED Gesture and TED-Expressive: generated databases, and values that real pyarrow has written."""

import os
import tracemalloc

import numpy as np
import pytest
from datasets_ted_tree import made_up_clip, write_ted, write_videos

from a2g_jax.data.datasets import ted, ted_expressive
from a2g_jax.data.datasets.layouts import TED_EXPRESSIVE_LAYOUT, TED_LAYOUT
from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_track import resample_track
from tests.io.untrusted_checks import payloads
from tests.io.untrusted_writers import arrow_payload, write_lmdb

SETS = [(ted.DATASET, TED_LAYOUT, "lmdb_"), (ted_expressive.DATASET, TED_EXPRESSIVE_LAYOUT, "lmdb_"),
        (ted_expressive.DATASET, TED_EXPRESSIVE_LAYOUT, "")]  # fmt: skip


def bone_directions(poses, layout):
    bones = np.stack([poses[:, end] - poses[:, start] for start, end in layout.bones], axis=1).astype(np.float64)
    return bones / np.linalg.norm(bones, axis=-1, keepdims=True)


@pytest.mark.parametrize(("data_set", "layout", "prefix"), SETS)
def test_what_was_written_is_read(tmp_path, data_set, layout, prefix):
    parts = write_ted(tmp_path, len(layout.names), prefix)
    (tmp_path / "lmdb_train_cache").mkdir()
    takes = data_set.find(tmp_path)
    assert [take.split for take in takes] == ["train"] * 4 + ["validation"] * 4 + ["test"] * 4
    assert len({take.name for take in takes}) == 12
    written = [(video["vid"], clip) for videos in parts.values() for video in videos for clip in video["clips"]]
    for take, (vid, clip) in zip(takes, written, strict=True):
        found = data_set.read(take, 16000)
        assert take.name == f"{vid}_{clip['start_frame_no']}_{clip['end_frame_no']}"
        assert (found.speaker, found.motion.kind, found.motion.fps, found.motion.layout) == (
            vid, "directions", 15.0, layout,
        )  # fmt: skip
        np.testing.assert_allclose(found.motion.values, bone_directions(clip["skeletons_3d"], layout), atol=1e-6)
        np.testing.assert_array_equal(found.audio, clip["audio_raw"].astype(np.float32))
        seconds = found.motion.seconds
        texts = [(word.text, word.start, word.end) for word in found.words]
        expected = [("so", 0.0, 0.3), ("here", 0.5, 0.75), ("we go", seconds - 0.25, seconds)]
        assert [text for text, *_ in texts] == [text for text, *_ in expected]
        np.testing.assert_allclose([times for _, *times in texts], [times for _, *times in expected], atol=1e-9)
        assert found.annotations["video_start"] == clip["start_time"]
    assert len(data_set.read(takes[0], 8000).audio) == 16000


def test_names_are_unique(tmp_path):
    """The same clip twice, and a name that no file could have."""
    write_videos(tmp_path, [{"vid": "a/../b", "clips": [CLIP, CLIP]}])
    takes = ted.DATASET.find(tmp_path)
    assert [take.name for take in takes] == ["a____b_186_216", "a____b_186_216-2"]
    assert takes[1].spec["clip"] == 1


def test_one_database_alone(tmp_path):
    write_ted(tmp_path, 10)
    assert {take.split for take in ted.DATASET.find(tmp_path / "lmdb_val")} == {"validation"}
    (tmp_path / "lmdb_test").rename(tmp_path / "talks")
    assert {take.split for take in ted.DATASET.find(tmp_path / "talks")} == {""}
    assert {take.split for take in ted.DATASET.find(tmp_path)} == {"train", "validation"}


@pytest.mark.parametrize("fps", [24.0, 25.0, 30.0, 14.2])
def test_rate_follows_from_the_times(tmp_path, fps):
    clip = made_up_clip(10, 71, fps=fps) | {"start_frame_no": 1, "end_frame_no": 72}
    write_videos(tmp_path, [{"vid": "v", "clips": [clip]}])
    motion = ted.DATASET.read(ted.DATASET.find(tmp_path)[0], 16000).motion
    assert motion.fps == pytest.approx(fps)
    assert resample_track(motion, 15.0, 20).frames == 20


@pytest.mark.parametrize("version", ["0.11.1", "0.15.1", "0.17.1", "1.0.1", "11.0.0"])
def test_values_by_real_pyarrow(tmp_path, version):
    """What ``untrusted_arrow_values.py`` says was serialized."""
    write_lmdb(tmp_path, {b"0000000000": payloads("arrow")[f"{version}-ted"]})
    first, second = ted.DATASET.find(tmp_path)
    assert (first.name, second.name) == ("abcDEF_-123_3_7", "abcDEF_-123_3_5")
    found = ted.DATASET.read(first, 16000)
    wave = np.sin(np.arange(120) * 0.7).reshape(4, 10, 3).astype(np.float32)
    np.testing.assert_allclose(found.motion.values, bone_directions(wave, TED_LAYOUT), atol=1e-6)
    np.testing.assert_allclose(found.audio, np.sin(np.arange(80) * 0.7), atol=1e-6)
    assert found.motion.fps == 15.0
    assert found.words == ()  # all after its end


def test_gaps_are_bridged_and_long_ones_refused(tmp_path):
    poses = np.tile(made_up_clip(10, 1)["skeletons_3d"], (30, 1, 1))
    poses[8:15] = 0.0
    poses[20, 3] = np.nan
    short = made_up_clip(10, skeletons_3d=poses)
    poses = np.array(poses)
    poses[8:16] = 0.0
    write_videos(tmp_path, [{"vid": "v", "clips": [short, made_up_clip(10, skeletons_3d=poses)]}])
    good, bad = ted.DATASET.find(tmp_path)
    found = ted.DATASET.read(good, 16000).motion.values
    np.testing.assert_allclose(found, np.tile(found[:1], (30, 1, 1)), atol=1e-6)
    with pytest.raises(InputError, match="clip 1, skeletons_3d, frame 8: point or bone 0 has no value for 0.53 s"):
        ted.DATASET.read(bad, 16000)


def test_a_database_larger_than_memory(tmp_path):
    """64 GiB as the file system counts; 12 videos of a megabyte, of which one or two are held at a time."""
    clip = made_up_clip(10, audio_raw=np.random.default_rng(0).uniform(-1, 1, 250_000).astype(np.float32))
    path = write_videos(tmp_path, [{"vid": f"v{number}", "clips": [clip]} for number in range(12)])
    os.truncate(path, 2**36)
    tracemalloc.start()
    takes = ted.DATASET.find(tmp_path)
    found = ted.DATASET.read(takes[-1], 16000)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(takes) == 12
    assert found.speaker == "v11"
    assert peak < 8e6


CLIP = made_up_clip(10)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"skeletons_3d": np.zeros((30, 43, 3))}, r"skeletons_3d: expected numbers of shape \(T, 10, 3\)"),
        ({"skeletons_3d": [[1.0], [2.0, 3.0]]}, r"skeletons_3d: expected numbers of shape"),
        ({"skeletons_3d": np.zeros((30, 10, 3))}, "frame 0: point or bone 0 has no value for 2.00 s"),
        ({"skeletons_3d": np.zeros((1, 10, 3))}, "skeletons_3d: has 1 frames"),
        ({"audio_raw": np.zeros(32000)}, "audio_raw: is silent"),
        ({"audio_raw": [0.5]}, "audio_raw: expected an array of samples; got list"),
        ({"audio_raw": np.full(32000, np.inf)}, "audio_raw: holds NaN or infinity at 0.000 s"),
        ({"end_time": 12.4}, "lasts from 12.4 to 12.4 s"),
        ({"end_time": float("nan")}, "end_time: expected a time in seconds"),
        ({"words": [["a", 1.0]]}, "word 0: expected a word, its start and its end"),
        ({"words": [["a", 1.0, "b"]]}, "word 0: expected a time in seconds; got str"),
        ({"words": "a"}, "word 0: expected a word"),
        ({"audio_raw": None}, "audio_raw: expected an array of samples; got NoneType"),
    ],
)
def test_wrong_clips(tmp_path, changes, message):
    write_videos(tmp_path / "lmdb_train", [{"vid": "v", "clips": [made_up_clip(10), CLIP | changes]}])
    good, bad = ted.DATASET.find(tmp_path)
    ted.DATASET.read(good, 16000)
    with pytest.raises(InputError, match=message) as caught:
        ted.DATASET.read(bad, 16000)
    assert f"{tmp_path / 'lmdb_train' / 'data.mdb'}, key 0000000000, clip 1" in str(caught.value)


ANYTHING = [
    *(None, True, 2**62, -1.0, float("nan"), 1e308, "", "x\0y\n", b"\xff", [], {}, (), [[1, [2]], None], {"a": [1]}),
    *(np.zeros(0), np.zeros((0, 10, 3)), np.full((30, 10, 3), 1e300), np.full((30, 30), np.inf), np.zeros((2, 2, 2))),
    *(np.arange(30, dtype=np.int8), np.float32(2), [["a", 13.0, 12.5]], [["a", None, 13.0]], [None] * 30),
]


def read_or_refuse(path):
    try:
        return ted.DATASET.read(ted.DATASET.find(path.parent)[0], 16000)
    except InputError as error:
        return error


@pytest.mark.parametrize("entry", sorted({*CLIP} - {"audio_feat"}))
def test_whatever_a_clip_holds(tmp_path, entry):
    """It is read to finite numbers, or refused with one line that names the database."""
    videos = [{"vid": "v", "clips": [CLIP | {entry: value}]} for value in ANYTHING]
    for number, video in enumerate(videos):
        path = write_videos(tmp_path / str(number), [video])
        found = read_or_refuse(path)
        if isinstance(found, InputError):
            assert str(found).startswith(str(path))
            assert "\n" not in str(found)
        else:
            assert np.isfinite(found.motion.values).all()
            assert all(0 <= word.start <= word.end for word in found.words)


@pytest.mark.parametrize(
    ("video", "message"),
    [
        ([1, 2], "key 0000000000: expected a video with 'vid' and 'clips'"),
        ({"vid": "v", "clips": [1]}, "key 0000000000: expected a video"),
        ({"vid": "v", "clips": [{"words": []}]}, "clip 0: has no 'start_frame_no'"),
        ({"vid": "v", "clips": [CLIP | {"end_frame_no": 2.5}]}, "clip 0, end_frame_no: expected a whole number"),
        ({"vid": "v", "clips": []}, "has no LMDB database with clips; name a folder that is TED Gesture's"),
    ],
)
def test_wrong_videos(tmp_path, video, message):
    write_videos(tmp_path / "lmdb_train", [video])
    with pytest.raises(InputError, match=message):
        ted.DATASET.find(tmp_path)


def test_missing_and_damaged_databases(tmp_path):
    with pytest.raises(InputError, match="is not a folder.*TED Gesture's"):
        ted.DATASET.find(tmp_path / "none")
    with pytest.raises(InputError, match="has no LMDB database with clips.*lmdb_train"):
        ted.DATASET.find(tmp_path)
    payload = arrow_payload({"vid": "v", "clips": [CLIP]})
    write_lmdb(tmp_path / "lmdb_train", {b"0000000000": payload[:3000]})
    with pytest.raises(InputError, match=r"data.mdb, key 0000000000, byte \d+: is damaged"):
        ted.DATASET.find(tmp_path)
    path = write_lmdb(tmp_path / "lmdb_train", {b"0000000000": payload})
    (take,) = ted.DATASET.find(tmp_path)
    write_lmdb(tmp_path / "lmdb_train", {b"0000000001": payload})
    with pytest.raises(InputError, match="has no key 0000000000; prepare again"):
        ted.DATASET.read(take, 16000)
    path.write_bytes(b"not a database" * 1000)
    with pytest.raises(InputError, match="data.mdb: is not an LMDB database"):
        ted.DATASET.find(tmp_path)
    path.unlink()
    with pytest.raises(InputError, match="data.mdb: there is no such file"):
        ted.DATASET.read(take, 16000)
