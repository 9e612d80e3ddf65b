"""The readers of files, each with valid files to start from and the way to change them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from experiments.fuzz.mutations import Change, change_bytes, change_json, change_text, change_zip
from experiments.fuzz.seeds import (
    arrow_payloads,
    audio_files,
    bvh_files,
    corpus_part,
    databases,
    hdf5_files,
    npy_files,
    npz_files,
    pickles,
    run_part,
    tables,
    textgrids,
    transcript_json,
    transcript_rows,
    word_vectors,
)


class Reader(NamedTuple):
    """A reader of the campaign."""

    name: str
    file: str
    """Name of the files that are read, which may be in a folder of further files."""
    seeds: Callable[[Path], list[bytes]]
    """Makes valid files, given a folder for what lies beside them."""
    read: Callable[[Path], Any]
    change: Change


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


def _read_audio(path: Path) -> None:
    from a2g_jax.io.audio import audio_info, read_audio

    assert np.isfinite(read_audio(path)).all()
    audio_info(path)


def _transcripts(path: Path) -> None:
    from a2g_jax.io.transcripts import transcript_notes

    words, notes = transcript_notes(path)
    assert all(np.isfinite([word.start, word.end]).all() and word.text for word in words)
    assert all("\n" not in str(note) for note in notes)


def _read_npz(path: Path) -> None:
    from a2g_jax.errors import InputError
    from a2g_jax.io.npz import read_motion_npz
    from a2g_jax.io.untrusted import read_npz

    try:
        read_motion_npz(path)
    except InputError:
        read_npz(path, objects=True)


def read_pickle_file(path: Path) -> None:
    """Read a pickle, and what was refused in it."""
    from a2g_jax.io.untrusted import check_read, read_pickle

    value = read_pickle(path)
    for part in value.values() if isinstance(value, dict) else [value]:
        check_read(part)


def _read_arrow(path: Path) -> None:
    from a2g_jax.io.untrusted import decode_arrow

    decode_arrow(path.read_bytes(), str(path))


def _read_database(path: Path) -> None:
    from a2g_jax.io.untrusted import LmdbFile, decode_arrow

    with LmdbFile(path) as database:
        for key, value in database.items():
            if len(value) > 500:
                decode_arrow(value, f"{path}, key {key!r}")


def _read_hdf5(path: Path) -> None:
    from a2g_jax.io.hdf5 import read_hdf5

    read_hdf5(path, ["pose/data", "audio/log_mel_512", "meta/intervals"])


def _read_run(path: Path) -> None:
    from a2g_jax.training.run import load_run

    load_run(path.parent)


def _read_corpus(path: Path) -> None:
    from a2g_jax.data.corpus import Corpus
    from a2g_jax.data.corpus_integrity import verify_corpus

    corpus = Corpus.open(next(parent for parent in path.parents if (parent / "audio.npy").exists()))
    verify_corpus(corpus)
    np.asarray(corpus.waveform[0:100])


def _inspect_corpus(path: Path) -> None:
    from a2g_jax.inspection.inspect import inspect

    inspect(path.parent).text()


def _read_vectors(path: Path) -> None:
    from a2g_jax.io.word_vectors import read_word_vectors

    assert all(np.isfinite(one).all() for one in read_word_vectors(path, ["one", "two"], 4).values())


def _read_table(path: Path) -> None:
    from a2g_jax.data.datasets.csv_tables import read_cells
    from a2g_jax.data.emotion_table import read_table
    from a2g_jax.errors import InputError

    try:
        read_table(path)
    except InputError:
        read_cells(path)


def _read_array(path: Path) -> None:
    from a2g_jax.io.untrusted import read_npy

    read_npy(path, objects=True)


WAVE = (("WAV", "PCM_16"), ("WAV", "FLOAT"), ("WAVEX", "PCM_24"), ("RF64", "PCM_16"), ("W64", "PCM_16"))
OTHERS = (("FLAC", "PCM_16"), ("OGG", "VORBIS"), ("AIFF", "PCM_16"), ("MP3", None), ("CAF", "PCM_16"), ("AU", "PCM_16"))
READERS = (
    Reader("BVH", "a.bvh", bvh_files, _read_bvh, change_text),
    Reader("BVH, inspected", "a.bvh", bvh_files, _inspect, change_text),
    Reader("BVH, retargeted", "a.bvh", bvh_files, _retarget, change_text),
    Reader("WAV, RF64, W64", "a.wav", audio_files(*WAVE), _read_audio, change_bytes),
    Reader("WAV, inspected", "a.wav", audio_files(*WAVE), _inspect, change_bytes),
    Reader("FLAC, OGG, MP3 and others", "a.flac", audio_files(*OTHERS), _read_audio, change_bytes),
    Reader("TextGrid", "a.TextGrid", textgrids, _transcripts, change_text),
    Reader("transcripts in JSON", "a.json", transcript_json, _transcripts, change_text),
    Reader("transcripts in rows", "a.tsv", transcript_rows, _transcripts, change_text),
    Reader("NPZ", "a.npz", npz_files, _read_npz, change_zip),
    Reader("NPZ, inspected", "a.npz", npz_files, _inspect, change_zip),
    Reader("NPY", "a.npy", npy_files, _read_array, change_bytes),
    Reader("pickle", "a.pkl", pickles, read_pickle_file, change_bytes),
    Reader("Arrow", "a.arrow", arrow_payloads, _read_arrow, change_bytes),
    Reader("LMDB", "data.mdb", databases, _read_database, change_bytes),
    Reader("HDF5", "a.h5", hdf5_files, _read_hdf5, change_bytes),
    Reader("run.json", "run.json", run_part("run.json"), _read_run, change_json),
    Reader("weights", "weights.safetensors", run_part("weights.safetensors"), _read_run, change_bytes),
    Reader("manifest.json", "manifest.json", corpus_part("manifest.json"), _read_corpus, change_json),
    Reader("manifest.json, inspected", "manifest.json", corpus_part("manifest.json"), _inspect_corpus, change_json),
    Reader("statistics of a corpus", "statistics.npz", corpus_part("statistics.npz"), _read_corpus, change_zip),
    Reader("arrays of a corpus", "pose.npy", corpus_part("pose.npy"), _read_corpus, change_bytes),
    Reader("word vectors", "a.vec", word_vectors, _read_vectors, change_text),
    Reader("tables", "a.csv", tables, _read_table, change_text),
)
