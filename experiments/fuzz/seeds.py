"""Valid files of every kind, which the campaign changes; each function takes a folder for what lies beside them."""

import io
import pickle
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np


def _motion() -> Any:
    from a2g_jax.talker.recordings import talk

    return talk(2.0, 3, fingers=True).motion.clip(0, 40)


def bvh_files(folder: Path) -> list[bytes]:
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


def audio_files(*formats: tuple[str, str | None]) -> Callable[[Path], list[bytes]]:
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


def textgrids(folder: Path) -> list[bytes]:
    from a2g_jax.io.textgrid import write_words
    from a2g_jax.io.words import Word

    words = [Word("one", 0.5, 1.0), Word('"two"', 1.5, 2.0), Word("drei", 2.0, 2.5)]
    write_words(folder / "a.TextGrid", words, 3.0, tiers={"phones": [Word("w", 0.5, 0.6), Word("spn", 0.6, 0.7)]})
    text = (folder / "a.TextGrid").read_text()
    short = (
        'File type = "ooTextFile"\nObject class = "TextGrid"\n\n0\n3\n<exists>\n1\n"IntervalTier"\n"words"\n0\n3\n2\n'
    )
    return [text.encode(), text.encode("utf-16"), (short + '0\n1\n"a"\n1\n3\n"b"\n').encode()]


def transcript_rows(_folder: Path) -> list[bytes]:
    return [b"0.0\t0.5\tone\n0.5\t1.25\ttwo\n2\t3\tthree\n", b"start\tend\tword\n0.0\t0.5\tone\n0.6\t0.9\ttwo\n"]


def transcript_json(_folder: Path) -> list[bytes]:
    one = b'{"alternatives": [{"words": [{"word": "one", "start_time": "0.1s", "end_time": "0.4s"}, '
    return [
        b"[" + one + b'{"word": "two", "start_time": "0.5s", "end_time": "1.0s"}]}]}]',
        b"[" + one + b'{"word": "two", "start_time": "0.5s", "end_time": "1.0s"}], "transcript": "one two"}]}, {}]',
    ]


def npz_files(folder: Path) -> list[bytes]:
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


def pickles(_folder: Path) -> list[bytes]:
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


def arrow_payloads(_folder: Path) -> list[bytes]:
    from tests.io.untrusted_arrow_values import clip
    from tests.io.untrusted_writers import arrow_payload

    values = [{"vid": "a", "clips": [clip(3, 4)]}, [1, 2.5, "a", (1, {2}), {"a": np.arange(6.0)}, b"ab"]]
    return [arrow_payload(value) for value in values]


def databases(folder: Path) -> list[bytes]:
    from tests.io.untrusted_writers import write_lmdb

    entries = {b"%06d" % n: arrow_payloads(folder)[0] if n % 40 == 0 else b"value" * (n % 50) for n in range(120)}
    return [
        write_lmdb(folder / "many", entries).read_bytes(),
        write_lmdb(folder / "one", {b"a": b"b"}, 512).read_bytes(),
    ]


def hdf5_files(folder: Path) -> list[bytes]:
    import h5py

    for number, options in enumerate(({}, {"chunks": (3, 2), "compression": "gzip", "shuffle": True})):
        with h5py.File(folder / f"{number}.h5", "w") as file:
            file.create_dataset("pose/data", data=np.arange(40.0).reshape(10, 4), **options)
            file["audio/log_mel_512"] = np.float16([[1.5]])
            file["meta/intervals"] = np.array([b"ab", b"cd"])
    return [(folder / f"{number}.h5").read_bytes() for number in range(2)]


def run_part(part: str) -> Callable[[Path], list[bytes]]:
    def make(folder: Path) -> list[bytes]:
        from a2g_jax.training.run import run_folder

        source = run_folder("demo")
        for name in ("run.json", "weights.safetensors"):
            shutil.copy(source / name, folder / name)
        return [(source / part).read_bytes()]

    return make


def corpus_part(part: str) -> Callable[[Path], list[bytes]]:
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


def word_vectors(_folder: Path) -> list[bytes]:
    return [b"3 4\none 1 2 3 4\ntwo 0.5 -1 2e-3 4\nthree 1 1 1 1\n", b"one 1 2 3 4\nTwo 5 6 7 8\n"]


def tables(_folder: Path) -> list[bytes]:
    return [b"recording,start,end,emotion\ntake0,0,1.5,anger\ntake1,0.5,2,joy\n", b"a;b\n1;2\n"]


def npy_files(_folder: Path) -> list[bytes]:
    found = []
    for array in (np.arange(12.0).reshape(3, 4), np.array(["ab", "c"]), np.array([{"a": [1]}, None], object)):
        file = io.BytesIO()
        np.save(file, array)
        found.append(file.getvalue())
    return found
