"""Inspection of a folder of raw recordings: each pair of files, and all compared with each other."""

from pathlib import Path
from typing import Any

from a2g_jax.data.folder import find_pairs, find_sounds
from a2g_jax.errors import InputError
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.inspection.copies import Fingerprint, audio_fingerprint, check_copies, motion_fingerprint
from a2g_jax.inspection.files import SAMPLE_RATE, Inspected, inspect_file, inspect_together
from a2g_jax.inspection.finding import Finding, Place
from a2g_jax.inspection.report import Report
from a2g_jax.inspection.rigs import check_skeletons
from a2g_jax.progress import progress_bar


def inspect_folder(folder: Path) -> Report:
    """Inspect WAV and BVH files of equal names under a folder; files without a partner alone.

    Raises:
        InputError: no such files.
    """
    pairs, findings = _find(folder)
    rows: list[dict[str, Any]] = []
    prints: dict[str, tuple[list[Fingerprint], list[str]]] = {"audio": ([], []), "motion": ([], [])}
    skeletons: list[Skeleton] = []
    names: list[str] = []
    with progress_bar(len(pairs), "inspecting", "recording") as bar:
        for name, paths in pairs:
            found = _one(paths, findings)
            for item in found:
                findings += item.findings
                if item.audio is not None:
                    prints["audio"][0].append(audio_fingerprint(item.audio, SAMPLE_RATE))
                    prints["audio"][1].append(name)
                if item.motion is not None:
                    prints["motion"][0].append(motion_fingerprint(item.motion))
                    prints["motion"][1].append(name)
                    skeletons.append(item.motion.skeleton)
                    names.append(name)
                rows.append({"name": name, **_row(item)})
            bar.update()
    for what, (words, owners) in prints.items():
        findings += check_copies(what, words, owners)
    findings += check_skeletons(skeletons, names)
    return Report(str(folder), "folder", _facts(rows, len(pairs), len(names)), findings)


def _find(folder: Path) -> tuple[list[tuple[str, list[Path]]], list[Finding]]:
    """The files of each recording, and findings on the layout of the folder."""
    try:
        pairs = find_pairs(folder)
        return [(str(bvh.relative_to(folder).with_suffix("")), [bvh, audio]) for audio, bvh in pairs], []
    except InputError as error:
        files = [path for path in sorted(folder.rglob("*")) if not path.name.startswith(".")]
        files = sorted([*find_sounds(files), *(path for path in files if path.suffix.lower() == ".bvh")])
        if not files:
            raise
        found = Finding("warning", "pairs", str(error), "Until then each file is inspected alone.")
        return [(str(path.relative_to(folder)), [path]) for path in files], [found]


def _one(paths: list[Path], findings: list[Finding]) -> list[Inspected]:
    found = []
    for path in paths:
        try:
            found.append(inspect_file(path))
        except InputError as error:
            message = str(error).removeprefix(f"{path}")
            findings.append(Finding("warning", "unreadable", message.lstrip(":, "), place=Place(path=str(path))))
    if len(found) == 2 and found[0].motion is not None:
        return [inspect_together(*found)]
    return found


def _row(item: Inspected) -> dict[str, Any]:
    motion, audio = item.facts.get("motion", {}), item.facts.get("audio", {})
    return {
        "motion": motion.get("seconds"),
        "fps": motion.get("fps"),
        "audio": audio.get("seconds"),
        "level": audio.get("active level (dBFS)"),
    }


def _facts(rows: list[dict[str, Any]], count: int, moving: int) -> dict[str, Any]:
    def some(key: str) -> list[float]:
        return [row[key] for row in rows if row[key] is not None]

    facts: dict[str, Any] = {
        "recordings": {
            "count": count,
            "motions": moving,
            "minutes of motion": round(sum(some("motion")) / 60, 2),
            "minutes of audio": round(sum(some("audio")) / 60, 2),
            "frame rates": sorted(set(some("fps"))),
        }
    }
    if some("level"):
        facts["recordings"]["active levels (dBFS)"] = [min(some("level")), max(some("level"))]
    shown = rows[:40]
    facts["each"] = {
        row["name"]: {name: value for name, value in row.items() if name != "name" and value is not None}
        for row in shown
    }
    return facts
