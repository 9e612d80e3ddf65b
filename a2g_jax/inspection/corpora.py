"""Inspection of a corpus made by ``a2g prepare``."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_integrity import damaged_files
from a2g_jax.data.corpus_layout import Entry
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.rig import Rig
from a2g_jax.inspection.audio_checks import Speech, check_audio
from a2g_jax.inspection.copies import Fingerprint, bands_fingerprint, check_copies, poses_fingerprint
from a2g_jax.inspection.describe import try_rig
from a2g_jax.inspection.finding import Finding, Place, located
from a2g_jax.inspection.motion_checks import check_finite, check_motion
from a2g_jax.inspection.report import Report
from a2g_jax.inspection.sync import Offset, at_rate, check_offset, measure_offset, wrist_positions
from a2g_jax.inspection.tree import body_facts
from a2g_jax.progress import progress_bar

#: Ratio to the median standard deviation from which a feature has outliers.
_WIDE = 20.0


def inspect_corpus(path: Path, verify: bool = False) -> Report:
    """Recordings, splits and statistics of a corpus, with faults of its arrays and leaks between its splits.

    Args:
        verify: read all files to compare their hashes, also those that seem unchanged since last time.

    Raises:
        InputError: not a corpus, or one whose manifest or statistics are damaged.
    """
    corpus = Corpus.open(path)
    findings = check_hashes(corpus, verify) + check_overlaps(corpus) + check_sources(corpus) + check_statistics(corpus)
    audio_prints: list[Fingerprint] = []
    motion_prints: list[Fingerprint] = []
    offsets: list[Offset] = []
    rig: Rig | None = None
    with progress_bar(len(corpus.recordings), "inspecting", "recording") as bar:
        for entry, audio, pose, root in _rows(corpus):
            faults = check_finite(audio, "audio features") + check_finite(pose, "poses") + check_finite(root, "root")
            usable = 0 if faults else len(pose)
            audio_prints.append(bands_fingerprint(audio[:usable, : corpus.mel.bands], corpus.fps))
            motion_prints.append(poses_fingerprint(pose.reshape(len(pose), -1)[:usable], corpus.fps))
            if not faults and corpus.space.has_rotations:
                motion = corpus.motion(entry.first, entry.first + entry.frames)
                if rig is None:
                    rig = try_rig(motion, str(path))[0]
                faults = check_motion(motion, rig)
                if rig is not None and (offset := _offset(motion, rig, audio[:, : corpus.mel.bands])) is not None:
                    offsets.append(offset)
                    faults += check_offset(offset)
            if entry.samples:
                samples = corpus.waveform[entry.first_sample : entry.first_sample + entry.samples]
                faults += check_audio(Speech(samples.astype(np.float32) / 32768, corpus.mel.sample_rate))
            findings += located(faults, recording=entry.name)
            bar.update()
    names, parts = [entry.name for entry in corpus.recordings], _splits_of(corpus)
    findings += check_copies("audio", audio_prints, names, parts) + check_copies("motion", motion_prints, names, parts)
    facts = corpus_facts(corpus, rig)
    if measured := [offset.seconds for offset in offsets if offset.significant]:
        median = round(float(np.median(measured)), 3)
        facts["offset"] = {
            "measured in": f"{len(measured)} of {len(names)} recordings",
            "motion is late by (s)": median,
        }
    return Report(str(path), "corpus", facts, findings)


def check_hashes(corpus: Corpus, verify: bool) -> list[Finding]:
    """Findings on files that differ from their hashes."""
    findings = []
    for message in damaged_files(corpus, verify):
        name, _, reason = message.removeprefix(f"{corpus.path}/").partition(": ")
        findings.append(Finding("warning", "damaged", reason, place=Place(path=name)))
    return findings


def _rows(corpus: Corpus) -> Iterator[tuple[Entry, np.ndarray, np.ndarray, np.ndarray]]:
    for entry in corpus.recordings:
        rows = slice(entry.first, entry.first + entry.frames)
        yield entry, np.asarray(corpus.audio[rows]), np.asarray(corpus.pose[rows]), np.asarray(corpus.root[rows])


def _offset(motion: Motion, rig: Rig, bands: Float[np.ndarray, "T B"]) -> Offset | None:
    energy = 10 * np.log10(np.sum(10 ** (bands.astype(np.float64) / 10), axis=1))
    return measure_offset(at_rate(energy, motion.fps), at_rate(wrist_positions(motion, rig), motion.fps))


def _splits_of(corpus: Corpus) -> list[frozenset[str]]:
    found: list[set[str]] = [set() for _ in corpus.recordings]
    for name, segments in corpus.splits.items():
        for segment in segments:
            found[segment.recording].add(name)
    return [frozenset(names) for names in found]


def check_overlaps(corpus: Corpus) -> list[Finding]:
    """Findings on frames of one recording that lie in two splits."""
    by_recording: dict[int, list[tuple[int, int, str]]] = {}
    for name, segments in corpus.splits.items():
        for index, start, stop in segments:
            by_recording.setdefault(index, []).append((start, stop, name))
    findings = []
    for index, parts in by_recording.items():
        parts.sort()
        for (_, stop, name), (start, _, other) in zip(parts, parts[1:], strict=False):
            if start < stop and name != other:
                message = f"its frames {start} to {stop} lie in both {name} and {other}."
                place = Place(recording=corpus.recordings[index].name, frame=start, seconds=start / corpus.fps)
                findings.append(
                    Finding("warning", "leak", message, "Prepare the corpus again.", place, (stop - start) / corpus.fps)
                )
    return findings


def check_sources(corpus: Corpus) -> list[Finding]:
    """Findings on recordings made from the same files."""
    parts = _splits_of(corpus)
    groups: dict[frozenset[str], list[int]] = {}
    for index, entry in enumerate(corpus.recordings):
        if entry.sources:
            groups.setdefault(frozenset(entry.sources.values()), []).append(index)
    findings = []
    for members in groups.values():
        if len(members) < 2:
            continue
        splits = frozenset[str]().union(*(parts[index] for index in members))
        names = [corpus.recordings[index].name for index in members]
        message = f"{len(names)} recordings were made from the same files ({', '.join(names[:4])}"
        message += f"{', ...' if len(names) > 4 else ''})"
        if len(members) == 2 and len(splits) > 1:
            fix = "Put both into one split; otherwise the model is tested on training data."
            message += f", and they are in different splits ({' and '.join(sorted(splits))})."
            findings.append(Finding("warning", "leak", message, fix, Place(recording=names[1])))
        else:
            # Databases hold many clips in one file; common stretches are found by content.
            findings.append(Finding("info", "same-files", f"{message}.", value=float(len(names))))
    return findings


def check_statistics(corpus: Corpus) -> list[Finding]:
    """Findings on standard deviations that are unfit for normalisation."""
    findings = []
    for name, statistics in corpus.statistics.items():
        std = np.asarray(statistics.std, np.float64)
        if (wide := std > _WIDE * np.median(std)).any() and name == "audio":
            count = f"{int(wide.sum())} of {std.size} values of {name}"
            message = f"the standard deviation of {count} is over {_WIDE:g} times the median."
            findings.append(Finding("warning", "statistics", message, "Look for outliers in the recordings."))
        findings += check_finite(std, f"the standard deviation of {name}")
    return findings


def corpus_facts(corpus: Corpus, rig: Rig | None) -> dict[str, Any]:
    """The facts of a corpus."""
    seconds = {name: sum(segment.frames for segment in parts) / corpus.fps for name, parts in corpus.splits.items()}
    facts: dict[str, Any] = {
        "corpus": {
            "recordings": len(corpus.recordings),
            "minutes": round(corpus.frames / corpus.fps / 60, 2),
            "fps": corpus.fps,
            "pose": f"{corpus.space.kind}, {corpus.space.rows} rows",
            "audio": f"{corpus.mel.width} values a frame ({corpus.mel.bands} bands at {corpus.mel.sample_rate} Hz)",
            "fingerprint": corpus.fingerprint,
            "made by": {name: value for name, value in corpus.recipe.items() if name in ("reader", "source", "seed")},
        },
        "splits": {
            name: {"recordings": len({segment.recording for segment in parts}), "seconds": round(seconds[name], 1)}
            for name, parts in corpus.splits.items()
        },
        "speakers": _minutes(corpus, "speaker"),
        "emotions": _minutes(corpus, "emotion"),
        "statistics": {
            name: {"mean": _spread(np.asarray(statistics.mean)), "std": _spread(np.asarray(statistics.std))}
            for name, statistics in corpus.statistics.items()
        },
    }
    if corpus.on_demand:
        facts["corpus"]["generated in training"] = f"{corpus.parts - 1} more parts"
    return facts | body_facts(corpus.body, rig)


def _minutes(corpus: Corpus, label: str) -> dict[str, float]:
    frames: Counter[str] = Counter()
    for entry in corpus.recordings:
        frames[getattr(entry, label) or "unknown"] += entry.frames
    return {name: round(count / corpus.fps / 60, 2) for name, count in frames.most_common()}


def _spread(values: Float[np.ndarray, "..."]) -> list[float]:
    return [round(float(np.min(values)), 4), round(float(np.max(values)), 4)]
