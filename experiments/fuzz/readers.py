"""The readers of files, each with sound files to start from and the way to change them."""

import io
import pickle
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from experiments.fuzz.mutations import Change, change_bytes, change_json, change_text, change_zip


class Reader(NamedTuple):
    """A reader of the campaign."""

    name: str
    file: str
    """Name of the files that are read, which may be in a folder of further files."""
    seeds: Callable[[Path], list[bytes]]
    """Makes sound files, given a folder for what lies beside them."""
    read: Callable[[Path], Any]
    change: Change


def _motion() -> Any:
    from a2g_jax.talker.recordings import talk

    return talk(2.0, 3, fingers=True).motion.clip(0, 40)


def _bvh(folder: Path) -> list[bytes]:
    from a2g_jax.io.bvh import write_bvh
    from a2g_jax.talker.recordings import talk

    plain = talk(2.0, 3).motion
    write_bvh(folder / "plain.bvh", plain.clip(0, 12))
    write_bvh(folder / "fingers.bvh", _motion())
    text = (folder / "plain.bvh").read_text()
    small = (
        "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n"
        " CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
        " JOINT Spine\n {\n  OFFSET 0 10 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n"
        "  End Site\n  {\n   OFFSET 0 10 0\n  }\n }\n}\n"
        "MOTION\nFrames: 2\nFrame Time: 0.033333\n0 90 0 1 2 3 4 5 6\n0 91 0 2 3 4 5 6 7\n"
    )
    wide = text.replace("\n", "\r\n").encode("utf-16")
    return [text.encode(), (folder / "fingers.bvh").read_bytes(), small.encode(), wide]


def _read_bvh(path: Path) -> None:
    from a2g_jax.io.bvh import read_bvh

    motion = read_bvh(path)
    assert motion.frames > 0
    assert 0 < motion.fps < np.inf
    assert np.isfinite(motion.rotations).all()
    assert np.isfinite(motion.root).all()


def _inspect(path: Path) -> None:
    from a2g_jax.inspection.inspect import inspect

    report = inspect(path)
    report.text()
    import json

    json.dumps(report.to_json(), allow_nan=False)


def _retarget(path: Path) -> None:
    from a2g_jax.generation.clips import read_motion, without_calibration
    from a2g_jax.geometry.retarget.onto import on_skeleton
    from a2g_jax.talker.skeleton import TALKER_SKELETON

    whole = read_motion(path)
    motion = on_skeleton(without_calibration(whole)[0], TALKER_SKELETON, 30.0, str(path), whole)
    assert np.isfinite(motion.rotations).all()


def _sounds(*formats: tuple[str, str | None]) -> Callable[[Path], list[bytes]]:
    def make(folder: Path) -> list[bytes]:
        import soundfile

        from a2g_jax.talker.recordings import talk

        speech = talk(2.0, 3).audio[:24000]
        two = np.stack([speech, 0.5 * speech], axis=1)
        found = []
        for number, (name, subtype) in enumerate(formats):
            path = folder / f"{number}.{name.lower()}"
            soundfile.write(path, two if number % 2 else speech, 16000, subtype=subtype, format=name)
            found.append(path.read_bytes())
        return found

    return make


def _read_audio(path: Path) -> None:
    from a2g_jax.io.audio import audio_info, read_audio

    assert np.isfinite(read_audio(path)).all()
    audio_info(path)


def _grid(folder: Path) -> list[bytes]:
    from a2g_jax.io.textgrid import write_words
    from a2g_jax.io.words import Word

    words = [Word("one", 0.5, 1.0), Word('"two"', 1.5, 2.0), Word("drei", 2.0, 2.5)]
    write_words(folder / "a.TextGrid", words, 3.0, tiers={"phones": [Word("w", 0.5, 0.6), Word("spn", 0.6, 0.7)]})
    text = (folder / "a.TextGrid").read_text()
    short = (
        'File type = "ooTextFile"\nObject class = "TextGrid"\n\n0\n3\n<exists>\n1\n"IntervalTier"\n"words"\n0\n3\n2\n'
    )
    return [text.encode(), text.encode("utf-16"), (short + '0\n1\n"a"\n1\n3\n"b"\n').encode()]


def _transcripts(path: Path) -> None:
    from a2g_jax.io.transcripts import transcript_notes

    words, notes = transcript_notes(path)
    assert all(np.isfinite([word.start, word.end]).all() and word.text for word in words)
    assert all("\n" not in str(note) for note in notes)


def _rows(_folder: Path) -> list[bytes]:
    return [b"0.0\t0.5\tone\n0.5\t1.25\ttwo\n2\t3\tthree\n", b"start\tend\tword\n0.0\t0.5\tone\n0.6\t0.9\ttwo\n"]


def _words(_folder: Path) -> list[bytes]:
    one = b'{"alternatives": [{"words": [{"word": "one", "start_time": "0.1s", "end_time": "0.4s"}, '
    return [
        b"[" + one + b'{"word": "two", "start_time": "0.5s", "end_time": "1.0s"}]}]}]',
        b"[" + one + b'{"word": "two", "start_time": "0.5s", "end_time": "1.0s"}], "transcript": "one two"}]}, {}]',
    ]


def _motions(folder: Path) -> list[bytes]:
    from a2g_jax.io.npz import write_motion_npz

    write_motion_npz(folder / "a.npz", _motion())
    poses = {
        "poses": np.zeros((9, 165)),
        "trans": np.zeros((9, 3)),
        "betas": np.zeros(300),
        "gender": np.array("neutral"),
    }
    np.savez(folder / "smplx.npz", **poses, mocap_frame_rate=np.array(30.0), expressions=np.zeros((9, 100)))
    np.savez_compressed(folder / "objects.npz", a=np.array([{"a": 1}, None], object), b=np.arange(5))
    return [(folder / name).read_bytes() for name in ("a.npz", "smplx.npz", "objects.npz")]


def _read_npz(path: Path) -> None:
    from a2g_jax.errors import InputError
    from a2g_jax.io.npz import read_motion_npz
    from a2g_jax.io.untrusted import read_npz

    try:
        read_motion_npz(path)
    except InputError:
        read_npz(path, objects=True)


def _pickles(_folder: Path) -> list[bytes]:
    rng = np.random.default_rng(0)
    show = {
        "joints": rng.normal(size=(20, 3)),
        "pose": {name: rng.normal(size=(9, 3)).astype(np.float32) for name in ("body", "jaw", "leye")},
        "names": ["a", "b", ("c", 1.5, None)],
        "objects": np.array([1, "a", None], object),
        "set": {1, 2},
        "bytes": b"\0\1",
    }
    return [pickle.dumps(show, protocol) for protocol in (0, 2, 4, 5)]


def read_pickle_file(path: Path) -> None:
    """Read a pickle, and what was refused in it."""
    from a2g_jax.io.untrusted import check_read, read_pickle

    value = read_pickle(path)
    for part in value.values() if isinstance(value, dict) else [value]:
        check_read(part)


def _arrows(_folder: Path) -> list[bytes]:
    from tests.io.untrusted_arrow_values import clip
    from tests.io.untrusted_writers import arrow_payload

    values = [{"vid": "a", "clips": [clip(3, 4)]}, [1, 2.5, "a", (1, {2}), {"a": np.arange(6.0)}, b"ab"]]
    return [arrow_payload(value) for value in values]


def _read_arrow(path: Path) -> None:
    from a2g_jax.io.untrusted import decode_arrow

    decode_arrow(path.read_bytes(), str(path))


def _databases(folder: Path) -> list[bytes]:
    from tests.io.untrusted_writers import write_lmdb

    entries = {b"%06d" % n: _arrows(folder)[0] if n % 40 == 0 else b"value" * (n % 50) for n in range(120)}
    return [
        write_lmdb(folder / "many", entries).read_bytes(),
        write_lmdb(folder / "one", {b"a": b"b"}, 512).read_bytes(),
    ]


def _read_database(path: Path) -> None:
    from a2g_jax.io.untrusted import LmdbFile, decode_arrow

    with LmdbFile(path) as database:
        for key, value in database.items():
            if len(value) > 500:
                decode_arrow(value, f"{path}, key {key!r}")


def _hdf5(folder: Path) -> list[bytes]:
    import h5py

    for number, options in enumerate(({}, {"chunks": (3, 2), "compression": "gzip", "shuffle": True})):
        with h5py.File(folder / f"{number}.h5", "w") as file:
            file.create_dataset("pose/data", data=np.arange(40.0).reshape(10, 4), **options)
            file["audio/log_mel_512"] = np.float16([[1.5]])
            file["meta/intervals"] = np.array([b"ab", b"cd"])
    return [(folder / f"{number}.h5").read_bytes() for number in range(2)]


def _read_hdf5(path: Path) -> None:
    from a2g_jax.io.hdf5 import read_hdf5

    read_hdf5(path, ["pose/data", "audio/log_mel_512", "meta/intervals"])


def _run(part: str) -> Callable[[Path], list[bytes]]:
    def make(folder: Path) -> list[bytes]:
        from a2g_jax.training.run import run_folder

        source = run_folder("demo")
        for name in ("run.json", "weights.safetensors"):
            shutil.copy(source / name, folder / name)
        return [(source / part).read_bytes()]

    return make


def _read_run(path: Path) -> None:
    from a2g_jax.training.run import load_run

    load_run(path.parent)


def _corpus(part: str) -> Callable[[Path], list[bytes]]:
    def make(folder: Path) -> list[bytes]:
        from a2g_jax.data.corpus_writer import Item, Plan, prepare_corpus, prepare_recording
        from a2g_jax.data.settings import Features
        from a2g_jax.talker.recordings import talk

        features = Features(waveform=True)
        items = [prepare_recording(talk(2.0, n, name=f"take{n}", emotion="anger"), features) for n in range(3)]
        again = [replace(item, sources=()) for item in items]
        made = folder / "made"

        def rest(done: int) -> Iterator[Any]:
            yield from again[done:]

        prepare_corpus(made, [Item(one.name, ()) for one in items], rest, Plan(features, {"reader": "folder"}))
        for path in made.iterdir():
            path.rename(folder / path.name)
        return [(folder / part).read_bytes()]

    return make


def _read_corpus(path: Path) -> None:
    from a2g_jax.data.corpus import Corpus
    from a2g_jax.data.corpus_integrity import verify_corpus

    corpus = Corpus.open(next(parent for parent in path.parents if (parent / "audio.npy").exists()))
    verify_corpus(corpus)
    np.asarray(corpus.waveform[0:100])


def _inspect_corpus(path: Path) -> None:
    from a2g_jax.inspection.inspect import inspect

    inspect(path.parent).text()


def _vectors(_folder: Path) -> list[bytes]:
    return [b"3 4\none 1 2 3 4\ntwo 0.5 -1 2e-3 4\nthree 1 1 1 1\n", b"one 1 2 3 4\nTwo 5 6 7 8\n"]


def _read_vectors(path: Path) -> None:
    from a2g_jax.io.word_vectors import read_word_vectors

    assert all(np.isfinite(one).all() for one in read_word_vectors(path, ["one", "two"], 4).values())


def _table(_folder: Path) -> list[bytes]:
    return [b"recording,start,end,emotion\ntake0,0,1.5,anger\ntake1,0.5,2,joy\n", b"a;b\n1;2\n"]


def _read_table(path: Path) -> None:
    from a2g_jax.data.datasets.csv_tables import read_cells
    from a2g_jax.data.emotion_table import read_table
    from a2g_jax.errors import InputError

    try:
        read_table(path)
    except InputError:
        read_cells(path)


def _arrays(_folder: Path) -> list[bytes]:
    found = []
    for array in (np.arange(12.0).reshape(3, 4), np.array(["ab", "c"]), np.array([{"a": [1]}, None], object)):
        file = io.BytesIO()
        np.save(file, array)
        found.append(file.getvalue())
    return found


def _read_array(path: Path) -> None:
    from a2g_jax.io.untrusted import read_npy

    read_npy(path, objects=True)


WAVE = (("WAV", "PCM_16"), ("WAV", "FLOAT"), ("WAVEX", "PCM_24"), ("RF64", "PCM_16"), ("W64", "PCM_16"))
OTHERS = (("FLAC", "PCM_16"), ("OGG", "VORBIS"), ("AIFF", "PCM_16"), ("MP3", None), ("CAF", "PCM_16"), ("AU", "PCM_16"))
READERS = (
    Reader("BVH", "a.bvh", _bvh, _read_bvh, change_text),
    Reader("BVH, inspected", "a.bvh", _bvh, _inspect, change_text),
    Reader("BVH, retargeted", "a.bvh", _bvh, _retarget, change_text),
    Reader("WAV, RF64, W64", "a.wav", _sounds(*WAVE), _read_audio, change_bytes),
    Reader("WAV, inspected", "a.wav", _sounds(*WAVE), _inspect, change_bytes),
    Reader("FLAC, OGG, MP3 and others", "a.flac", _sounds(*OTHERS), _read_audio, change_bytes),
    Reader("TextGrid", "a.TextGrid", _grid, _transcripts, change_text),
    Reader("transcripts in JSON", "a.json", _words, _transcripts, change_text),
    Reader("transcripts in rows", "a.tsv", _rows, _transcripts, change_text),
    Reader("NPZ", "a.npz", _motions, _read_npz, change_zip),
    Reader("NPZ, inspected", "a.npz", _motions, _inspect, change_zip),
    Reader("NPY", "a.npy", _arrays, _read_array, change_bytes),
    Reader("pickle", "a.pkl", _pickles, read_pickle_file, change_bytes),
    Reader("Arrow", "a.arrow", _arrows, _read_arrow, change_bytes),
    Reader("LMDB", "data.mdb", _databases, _read_database, change_bytes),
    Reader("HDF5", "a.h5", _hdf5, _read_hdf5, change_bytes),
    Reader("run.json", "run.json", _run("run.json"), _read_run, change_json),
    Reader("weights", "weights.safetensors", _run("weights.safetensors"), _read_run, change_bytes),
    Reader("manifest.json", "manifest.json", _corpus("manifest.json"), _read_corpus, change_json),
    Reader("manifest.json, inspected", "manifest.json", _corpus("manifest.json"), _inspect_corpus, change_json),
    Reader("statistics of a corpus", "statistics.npz", _corpus("statistics.npz"), _read_corpus, change_zip),
    Reader("arrays of a corpus", "pose.npy", _corpus("pose.npy"), _read_corpus, change_bytes),
    Reader("word vectors", "a.vec", _vectors, _read_vectors, change_text),
    Reader("tables", "a.csv", _table, _read_table, change_text),
)
