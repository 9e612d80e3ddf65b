"""A corpus that several machines prepare: each writes a shard, and the merged shards are the corpus, byte for byte.

A shard holds the rows of consecutive recordings, their annotations and hashes. Statistics and splits are of all
recordings, so they are computed when the shards are merged, from the same rows in the same order.
"""

import os
import re
import shutil
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from a2g_jax.config import from_json
from a2g_jax.data.body_json import body_from_json, body_to_json
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_layout import ANNOTATIONS, ARRAYS, SHARD, WAVEFORM, Entry
from a2g_jax.data.corpus_writer import Plan, finish_corpus, place, plan_to_json, write_rows
from a2g_jax.data.featurise import Prepared, Skipped
from a2g_jax.data.journal import Unfinished
from a2g_jax.data.prepare import Work
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.io.files import read_json, sha256_file
from a2g_jax.io.sealed import read_sealed, write_sealed
from a2g_jax.progress import say

_FORMAT = "a2g_jax corpus shard"


class Share(NamedTuple):
    """Which of the shards of a corpus."""

    number: int
    """From 1 on."""
    shards: int

    @classmethod
    def parse(cls, text: str) -> "Share":
        """The share that ``"2/4"`` means.

        Raises:
            InputError: other text, or a number that is not among them.
        """
        found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text.strip())
        if not found or not 1 <= int(found[1]) <= int(found[2]):
            raise InputError(f"--shard: expected I/N with I from 1 to N, such as 2/4; got {text!r}.")
        return cls(int(found[1]), int(found[2]))

    def of(self, total: int) -> slice:
        """Its recordings among all; consecutive ones."""
        return slice(total * (self.number - 1) // self.shards, total * self.number // self.shards)


class Made(NamedTuple):
    """A shard that was prepared."""

    path: Path
    recordings: int
    seconds: float


def prepare_shard(
    out: str | os.PathLike[str],
    work: Work,
    share: Share,
    workers: int | None = None,
    report: Callable[[str], None] = say,
) -> Made:
    """Write one shard of a corpus. Interruptible: the same call resumes.

    Args:
        work: of the whole corpus.
        workers: number of processes; one for every core if None.

    Raises:
        InputError: the folder exists, there are fewer recordings than shards, or one cannot be prepared.
        Interrupted: by Ctrl-C; the same call resumes.
    """
    total = len(work.items)
    if total < share.shards:
        raise InputError(f"--shard {share.number}/{share.shards}: there are {total} recordings; use at most as many.")
    rows = share.of(total)
    mine = work._replace(items=work.items[rows], inputs=work.inputs[rows])
    finish = partial(_finish_shard, share=share, names=[item.name for item in work.items])
    more = {"shard": f"{share.number}/{share.shards}"}
    write_rows(out, mine.items, mine.maker(workers), work.plan, report, finish, more)
    entries = [Entry(**entry) for entry in read_sealed(Path(out) / SHARD)["recordings"]]
    return Made(Path(out), len(entries), sum(entry.frames for entry in entries) / work.plan.features.fps)


def _finish_shard(
    work: Unfinished,
    path: Path,
    plan: Plan,
    _report: Callable[[str], None],
    share: Share,
    names: list[str],
) -> None:
    """Write what merging needs, and give the shard its name."""
    files: list[str] = []
    if work.body is not None:
        work.finish_arrays()
        files = [*ARRAYS, *([WAVEFORM] if plan.features.waveform else [])]
    about = {
        "format": _FORMAT,
        "shard": share.number,
        "of": share.shards,
        "names": names,
        "plan": plan_to_json(plan),
        "features": plan.features.to_json(),
        "recipe": plan.recipe,
        "seed": plan.seed,
        "parts": plan.parts,
        "official": plan.official,
        "groups": dict(plan.groups),
        "skip_broken": plan.skip_broken,
        "body": None if work.body is None else body_to_json(work.body),
        "spread": work.spread,
        "recordings": [entry.to_json() for entry in work.entries],
        "skipped": [{**asdict(item), "hashes": work.hashes_of(item.sources)} for item in work.skipped],
        "arrays": {name: sha256_file(work.corpus / name) for name in files},
        "annotations": work.annotation_hashes,
    }
    write_sealed(work.corpus / SHARD, about)
    work.corpus.replace(path)
    shutil.rmtree(work.folder, ignore_errors=True)


def merge_shards(
    shards: Sequence[str | os.PathLike[str]], out: str | os.PathLike[str], report: Callable[[str], None] = say
) -> Corpus:
    """Write the corpus whose shards these are: what preparing it on one machine writes, byte for byte.

    Args:
        shards: in any order. They stay.

    Raises:
        InputError: no shards, shards of different corpora, missing, repeated or damaged ones, or the folder exists.
    """
    found = _in_order([(Path(path), _read(Path(path))) for path in shards])
    plan = _plan(*found[0])
    out = Path(out)
    with place(out) as folder:
        shutil.rmtree(folder, ignore_errors=True)
        work = Unfinished(folder, plan.features)
        try:
            work.recover([])
            for path, about in found:
                _append(work, path, about)
            finish_corpus(work, out, plan, report)
        finally:
            work.close()
            shutil.rmtree(folder, ignore_errors=True)
    return Corpus.open(out)


def _read(path: Path) -> dict[str, Any]:
    if not (path / SHARD).is_file():
        raise InputError(f"{path}: is no shard (no {SHARD} in it); make one with 'a2g prepare ... --shard I/N'.")
    about = read_sealed(path / SHARD, ("annotations",))
    if not isinstance(about, dict) or about.get("format") != _FORMAT:
        raise InputError(f"{path / SHARD}: does not describe a shard; prepare it anew.")
    return about


def _in_order(shards: list[tuple[Path, dict[str, Any]]]) -> list[tuple[Path, dict[str, Any]]]:
    """All shards of one corpus by their numbers."""
    if not shards:
        raise InputError("--merge: expected the folders of all shards.")
    first, about = shards[0]
    by_number: dict[int, tuple[Path, dict[str, Any]]] = {}
    for path, other in shards:
        if other["of"] != about["of"]:
            raise InputError(
                f"{path}: is one of {other['of']} shards, {first} one of {about['of']}; merge those of one."
            )
        plans = about["plan"], other["plan"]
        changed = [name for name in {**plans[0], **plans[1]} if plans[0].get(name) != plans[1].get(name)]
        if changed or about["names"] != other["names"]:
            what = ", ".join(changed) or "recordings"
            raise InputError(
                f"{path}: was prepared with other settings than {first} ({what}); prepare one of them anew."
            )
        if other["shard"] in by_number:
            raise InputError(
                f"{path}: is shard {other['shard']}, as {by_number[other['shard']][0]} is; name each once."
            )
        by_number[other["shard"]] = path, other
    missing = [str(number) for number in range(1, about["of"] + 1) if number not in by_number]
    if missing:
        raise InputError(
            f"--merge: shard{'s' if len(missing) > 1 else ''} {', '.join(missing)} of {about['of']}"
            f" {'are' if len(missing) > 1 else 'is'} missing; name the folders of all."
        )
    return [by_number[number] for number in sorted(by_number)]


def _plan(path: Path, about: dict[str, Any]) -> Plan:
    """The plan of the corpus."""
    where, values = str(path / SHARD), about["features"]
    features: Features = from_json(
        Features, {**values, "mel": from_json(MelConfig, values["mel"], f"{where}: mel")}, f"{where}: features"
    )
    parts, official, skip_broken = about["parts"], about["official"], about["skip_broken"]
    plan = Plan(features, about["recipe"], about["seed"], parts, official, about["groups"], skip_broken)
    if plan_to_json(plan) != about["plan"]:
        raise InputError(f"{path}: was prepared by another version of this package; merge with that version.")
    return plan


def _append(work: Unfinished, path: Path, about: dict[str, Any]) -> None:
    """Append the recordings of a shard."""
    arrays = {}
    for name, digest in about["arrays"].items():
        if not (path / name).is_file() or sha256_file(path / name) != digest:
            raise InputError(
                f"{path / name}: differs from its hash in {SHARD}: copy the shard again, or prepare it anew."
            )
        arrays[name] = np.load(path / name, mmap_mode="r", allow_pickle=False)
    body = None if about["body"] is None else body_from_json(about["body"])
    for number, (values, digest) in enumerate(zip(about["recordings"], about["annotations"], strict=True)):
        entry, file = Entry(**values), path / ANNOTATIONS / f"{number:05d}.json"
        if not file.is_file() or sha256_file(file) != digest:
            raise InputError(f"{file}: differs from its hash in {SHARD}: copy the shard again, or prepare it anew.")
        rows = slice(entry.first, entry.first + entry.frames)
        samples = slice(entry.first_sample, entry.first_sample + entry.samples)
        audio, pose, root = (np.asarray(arrays[name][rows]) for name in ARRAYS)
        assert body is not None
        work.trust(entry.sources)
        work.append(
            Prepared(
                name=entry.name,
                audio=audio,
                pose=pose,
                root=root,
                waveform=np.asarray(arrays[WAVEFORM][samples]) if WAVEFORM in arrays else None,
                body=body,
                speaker=entry.speaker,
                emotion=entry.emotion,
                split=entry.split,
                sources=tuple(entry.sources),
                annotations=read_json(file),
                waveform_gain=entry.waveform_gain,
            )
        )
    for values in about["skipped"]:
        work.trust(values["hashes"])
        work.skip(Skipped(values["name"], tuple(values["sources"]), values["reason"]))
    work.spread = max(work.spread, float(about["spread"]))
