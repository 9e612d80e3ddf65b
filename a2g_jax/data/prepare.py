"""From recordings to a corpus: features at the motion's frame times, statistics, splits, a manifest."""

import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax import __version__
from a2g_jax.data.corpus import ARRAYS, FORMAT, MANIFEST, VERSION, Corpus, Entry, mel_to_json, skeleton_to_json
from a2g_jax.data.recording import Recording
from a2g_jax.data.splits import Splits, split_recordings
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.features.statistics import RunningStatistics
from a2g_jax.geometry.body import find_body
from a2g_jax.geometry.motion import resample
from a2g_jax.geometry.select import select_joints
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.files import make_folder, sha256_file, write_json

#: Standard deviations are raised to these before anything is divided by them.
_FLOORS = {"audio": 1.0, "pose": 0.01, "root": 0.01}
#: Rows read at once when statistics are taken.
_ROWS = 65536


@dataclass(frozen=True, eq=False)
class Prepared:
    """One recording as rows of a corpus."""

    name: str
    audio: Float[np.ndarray, "T bands"]
    pose: Float[np.ndarray, "T J 6"]
    root: Float[np.ndarray, "T 3"]
    skeleton: Skeleton
    speaker: str
    emotion: str
    sources: tuple[str, ...]
    annotations: dict[str, Any]


def prepare_recording(recording: Recording, fps: float, mel: MelConfig, joints: str = "body") -> Prepared:
    """Features and motion of one recording at ``fps``, as many frames as both have.

    Args:
        joints: ``"body"`` keeps the 22 body joints where they can be found by name (and all joints otherwise),
            ``"all"`` keeps the rig as it is.

    Raises:
        InputError: audio and motion differ in length by more than a second and 5 %, or the audio has another rate.
    """
    where = " and ".join(recording.sources) or recording.name
    if recording.sample_rate != mel.sample_rate:
        raise InputError(f"{where}: has {recording.sample_rate} Hz audio; expected {mel.sample_rate} Hz.")
    heard, seen = len(recording.audio) / recording.sample_rate, recording.motion.seconds
    if abs(heard - seen) > max(1.0, 0.05 * max(heard, seen)):
        raise InputError(
            f"{where}: audio lasts {heard:.2f} s and motion {seen:.2f} s; cut them to the same take, or correct the"
            " motion's frame time."
        )
    motion = recording.motion
    if joints == "body" and (body := find_body(motion.skeleton)) is not None:
        motion = select_joints(motion, body)
    frames = min(round(heard * fps), round(seen * fps))
    if frames < 2:
        raise InputError(f"{where}: gives {frames} frames at {fps:g} fps; use longer recordings or a higher --fps.")
    motion = resample(motion, fps, frames)
    rotations = np.asarray(motion.rotations, np.float32)
    return Prepared(
        name=recording.name,
        audio=log_mel(recording.audio, mel, fps, frames),
        pose=np.swapaxes(rotations[..., :2], -1, -2).reshape(*rotations.shape[:2], 6),
        root=np.asarray(motion.root, np.float32),
        skeleton=motion.skeleton,
        speaker=recording.speaker,
        emotion=recording.emotion,
        sources=recording.sources,
        annotations={"words": [asdict(word) for word in recording.words], **recording.annotations},
    )


def write_corpus(
    path: str | os.PathLike[str],
    prepared: Iterable[Prepared],
    *,
    fps: float,
    mel: MelConfig,
    recipe: dict[str, Any],
    seed: int = 0,
    report: Callable[[str], None] = lambda line: None,
) -> Corpus:
    """Write recordings to a corpus folder, one at a time, so memory holds a single recording.

    The folder appears under its name only when it is complete.

    Args:
        recipe: how the recordings were made; kept in the manifest.
        seed: of the split.
        report: called with a line for the user about anything noteworthy.

    Raises:
        InputError: the folder exists, nothing was prepared, or recordings have different joints.
    """
    path = Path(path)
    refuse_existing(path)
    make_folder(path.parent)
    # What a killed run left behind.
    for stale in path.parent.glob(f".{path.name}.unfinished-*"):
        shutil.rmtree(stale, ignore_errors=True)
    work = Path(tempfile.mkdtemp(prefix=f".{path.name}.unfinished-", dir=path.parent))
    try:
        entries, skeleton = _write_rows(work, prepared, report)
        _finish_arrays(work, entries, mel.bands, skeleton.joints)
        splits = split_recordings([entry.frames for entry in entries], seed)
        _write_statistics(work, entries, splits)
        hashes = {name: sha256_file(work / name) for name in (*ARRAYS, "statistics.npz")}
        manifest = {
            "format": FORMAT,
            "version": VERSION,
            "package": __version__,
            "fingerprint": hashlib.sha256("".join(hashes.values()).encode()).hexdigest(),
            "recipe": recipe,
            "fps": fps,
            "mel": mel_to_json(mel),
            "seconds": sum(entry.frames for entry in entries) / fps,
            "skeleton": skeleton_to_json(skeleton),
            "recordings": [asdict(entry) for entry in entries],
            "splits": {name: [list(segment) for segment in segments] for name, segments in splits.items()},
            "arrays": hashes,
        }
        write_json(work / MANIFEST, manifest)
        # mkdtemp makes folders private; a corpus is an ordinary folder.
        work.chmod(0o755)
        work.replace(path)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return Corpus.open(path)


def refuse_existing(path: Path) -> None:
    """A corpus is never written over: raise ``InputError`` if something has its name."""
    if os.path.lexists(path):
        raise InputError(f"{path}: exists already; choose another folder or remove it.")


def _write_rows(
    work: Path, prepared: Iterable[Prepared], report: Callable[[str], None]
) -> tuple[list[Entry], Skeleton]:
    entries: list[Entry] = []
    skeleton: Skeleton | None = None
    spread = 0.0
    (work / "annotations").mkdir()
    with (
        (work / "audio.raw").open("wb") as audio,
        (work / "pose.raw").open("wb") as pose,
        (work / "root.raw").open("wb") as root,
    ):
        for item in prepared:
            if skeleton is None:
                skeleton = item.skeleton
            elif not skeleton.same_tree(item.skeleton):
                raise InputError(
                    f"{' and '.join(item.sources) or item.name}: has other joints ({item.skeleton.joints} of them) than"
                    f" the recordings before it ({skeleton.joints}); prepare rigs of one kind together."
                )
            else:
                spread = max(spread, float(np.abs(item.skeleton.offsets[1:] - skeleton.offsets[1:]).max(initial=0)))
            rows = sum(entry.frames for entry in entries)
            for file, values in ((audio, item.audio), (pose, item.pose), (root, item.root)):
                np.ascontiguousarray(values, np.float32).tofile(file)
            write_json(work / "annotations" / f"{len(entries):05d}.json", item.annotations)
            sources = {str(source): sha256_file(source) for source in item.sources}
            entries.append(Entry(item.name, rows, len(item.audio), item.speaker, item.emotion, sources))
    if skeleton is None:
        raise InputError("no recordings to prepare; check the source.")
    if spread > 0.001:
        report(
            f"bone lengths differ between recordings by up to {spread * 100:.1f} cm;"
            f" rotations are kept, positions use those of {entries[0].name}"
        )
    return entries, skeleton


def _finish_arrays(work: Path, entries: list[Entry], bands: int, joints: int) -> None:
    """Put .npy headers before the raw rows, now that their number is known."""
    frames = sum(entry.frames for entry in entries)
    for name, shape in zip(ARRAYS, ((frames, bands), (frames, joints, 6), (frames, 3)), strict=True):
        raw = (work / name).with_suffix(".raw")
        with (work / name).open("wb") as target, raw.open("rb") as rows:
            header = {
                "descr": np.lib.format.dtype_to_descr(np.dtype(np.float32)),
                "fortran_order": False,
                "shape": shape,
            }
            np.lib.format.write_array_header_1_0(target, header)
            shutil.copyfileobj(rows, target, 1 << 24)
        raw.unlink()


def _write_statistics(work: Path, entries: list[Entry], splits: Splits) -> None:
    """Means and standard deviations over the training split only."""
    values: dict[str, Any] = {}
    for name in ARRAYS:
        key = name.removesuffix(".npy")
        array = np.load(work / name, mmap_mode="r", allow_pickle=False)
        running = RunningStatistics()
        for recording, start, stop in splits["train"]:
            first = entries[recording].first
            for row in range(first + start, first + stop, _ROWS):
                running.add(array[row : min(row + _ROWS, first + stop)])
        statistics = running.result(_FLOORS[key])
        values[f"{key}_mean"], values[f"{key}_std"] = statistics.mean, statistics.std
    np.savez(work / "statistics.npz", **values)
