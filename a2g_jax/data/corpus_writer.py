"""Writing a corpus: rows, statistics, splits, manifest. Interruptible and resumable."""

import json
import os
import shutil
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from a2g_jax import __version__
from a2g_jax.data.body_json import body_to_json
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_files import write_statistics
from a2g_jax.data.corpus_layout import ARRAYS, FORMAT, MANIFEST, PARTS, VERSION, VERSION_ON_DEMAND, WAVEFORM
from a2g_jax.data.corpus_manifest import fingerprint_of
from a2g_jax.data.featurise import Prepared as Prepared
from a2g_jax.data.featurise import Skipped as Skipped
from a2g_jax.data.featurise import prepare_recording as prepare_recording
from a2g_jax.data.journal import Unfinished
from a2g_jax.data.prepared_checks import check_finite, is_still
from a2g_jax.data.settings import Features
from a2g_jax.data.splits import official_splits
from a2g_jax.errors import InputError, Interrupted, OutputError
from a2g_jax.io.files import disk_full, make_folder, read_json, sha256_file, unwritable, write_json
from a2g_jax.io.locks import locked
from a2g_jax.io.sealed import write_sealed

#: Version of the layout of unfinished work; work of another one is discarded.
_LAYOUT = 2
_RECIPE = "recipe.json"


class Item(NamedTuple):
    """A recording of a corpus to be written."""

    name: str
    sources: tuple[str, ...]
    """Files it is made from; empty for a generated one."""


@dataclass(frozen=True)
class Plan:
    """Settings of a corpus to be written."""

    features: Features
    recipe: dict[str, Any]
    """How the recordings are made; part of the manifest."""
    seed: int = 0
    """Of the split."""
    parts: dict[str, Any] = field(default_factory=dict)
    """Training recordings to be generated during training, see :mod:`a2g_jax.data.on_demand`; or empty."""
    official: bool = True
    """Whether to use the data set's official split where it has one."""
    groups: Mapping[str, str] = field(default_factory=dict)
    """Group of a recording by its name, for splits by the seed; a recording without one is a group of its own."""
    skip_broken: bool = False
    """Whether a recording that cannot be prepared is noted and left out instead of raising its error."""


def prepare_corpus(
    path: str | os.PathLike[str],
    items: Sequence[Item],
    make: Callable[[int], Generator[Prepared | Skipped, None, None]],
    plan: Plan,
    report: Callable[[str], None] = lambda line: None,
) -> Corpus:
    """Write a corpus. Interruptible: the same call resumes the work, and the result has the same bytes.

    The folder gets its name only when it is complete. Until then the work is in a hidden folder beside it,
    ``.NAME.unfinished``. Memory holds a few recordings.

    Args:
        items: every recording, in order.
        make: called with the number of finished recordings; yields the others in order.
        report: called with a line for the user about anything noteworthy.

    Raises:
        InputError: the folder exists, another process prepares it, there are no recordings, or they have different
            joints.
        Interrupted: by Ctrl-C.
    """
    write_rows(path, items, make, plan, report, finish_corpus)
    return Corpus.open(path)


def write_rows(
    path: str | os.PathLike[str],
    items: Sequence[Item],
    make: Callable[[int], Generator[Prepared | Skipped, None, None]],
    plan: Plan,
    report: Callable[[str], None],
    finish: Callable[[Unfinished, Path, Plan, Callable[[str], None]], None],
    more: Mapping[str, Any] | None = None,
) -> None:
    """Write rows as :func:`prepare_corpus` does.

    Args:
        finish: gives the work its name; see :func:`finish_corpus`.
        more: what the unfinished work depends on, beside the plan.
    """
    path = Path(path)
    with place(path) as folder:
        _discard_unless_same(folder, path, plan, report, more or {})
        work = Unfinished(folder, plan.features)
        total = len(items)
        try:
            done, before = work.recover(list(items))
            if before:
                again = f" ({before - done} finished ones have changed or are damaged)" if done < before else ""
                report(f"{path}: resuming after {done} of {total} recordings{again}")
            with closing(make(done)) as rows:
                for item in rows:
                    _add(work, item, plan.skip_broken, report)
            finish(work, path, plan, report)
        except KeyboardInterrupt:
            raise Interrupted(
                f"{path}: stopped after {work.done} of {total} recordings; run the same command to resume."
            ) from None
        except Exception:
            if work.done:
                report(f"{path}: {work.done} of {total} recordings are finished; run the same command to resume")
            raise
        finally:
            work.close()
            if not work.done:
                shutil.rmtree(folder, ignore_errors=True)


def _add(work: Unfinished, item: Prepared | Skipped, skip: bool, report: Callable[[str], None]) -> None:
    """Add a recording, or note why it cannot be added."""
    if isinstance(item, Prepared):
        try:
            check_finite(item)
            work.append(item)
            if is_still(item):
                report(f"{' and '.join(item.sources) or item.name}: nothing moves in {item.name!r}; check the export.")
            return
        except OutputError:
            raise
        except InputError as error:
            if not skip:
                raise
            item = Skipped(item.name, item.sources, str(error))
    report(f"skipped: {item.reason}")
    work.skip(item)


def write_corpus(
    path: str | os.PathLike[str],
    prepared: Iterable[Prepared],
    *,
    features: Features,
    recipe: dict[str, Any],
    seed: int = 0,
    report: Callable[[str], None] = lambda line: None,
) -> Corpus:
    """Write recordings to a corpus folder, one at a time and not resumable: an error leaves nothing behind.

    Args:
        recipe: how the recordings were made; part of the manifest.
        seed: of the split.
        report: called with a line for the user about anything noteworthy.

    Raises:
        InputError: the folder exists, there are no recordings, or they have different joints.
    """
    path = Path(path)
    with place(path) as folder:
        shutil.rmtree(folder, ignore_errors=True)
        work = Unfinished(folder, features)
        try:
            work.recover([])
            for item in prepared:
                check_finite(item)
                work.append(item)
            finish_corpus(work, path, Plan(features, recipe, seed), report)
        finally:
            work.close()
            shutil.rmtree(folder, ignore_errors=True)
    return Corpus.open(path)


def _refuse_existing(path: Path) -> None:
    """Raise ``InputError`` if something has the corpus's name: nothing is overwritten."""
    if os.path.lexists(path):
        raise InputError(f"{path}: exists already; choose another folder or remove it.")


@contextmanager
def place(path: Path) -> Iterator[Path]:
    """The folder for unfinished work on a corpus, locked against other processes."""
    folder = path.parent / f".{path.name}.unfinished"
    if not folder.exists():
        _refuse_existing(path)
    make_folder(path.parent)
    with locked(path.parent / f".{path.name}.lock", f"{path}: is being prepared"):
        if os.path.lexists(path):
            # The process that finished the corpus was killed before it had removed its working files.
            shutil.rmtree(folder, ignore_errors=True)
        _refuse_existing(path)
        try:
            yield folder
        except (OSError, OutputError) as error:
            if not disk_full(error):
                raise
            raise unwritable(path, error, "free some space, then run the same command to resume") from error


def plan_to_json(plan: Plan) -> dict[str, Any]:
    """What the rows of a corpus depend on."""
    about = {**plan.features.to_json(), "package": __version__, "layout": _LAYOUT}
    rest = {"parts": plan.parts, "official splits": plan.official, "skip broken": plan.skip_broken}
    values: dict[str, Any] = json.loads(json.dumps({**about, "seed": plan.seed, **plan.recipe, **rest}))
    return values


def _discard_unless_same(
    folder: Path, path: Path, plan: Plan, report: Callable[[str], None], more: Mapping[str, Any]
) -> None:
    """Remove unfinished work of another recipe, and record this one."""
    now = {**plan_to_json(plan), **more}
    if folder.is_dir():
        try:
            before = read_json(folder / _RECIPE)
        except InputError:
            before = None  # killed before it was written, or damaged
        if before == now:
            return
        if isinstance(before, dict):
            changed = [
                f"{key}: {before.get(key)}, now {value}"
                for key, value in now.items()
                if before.get(key) != value and not isinstance(value, list | dict)
            ]
            report(f"{path}: unfinished work with other settings ({'; '.join(changed)}) is discarded")
        shutil.rmtree(folder)
    make_folder(folder)
    write_json(folder / _RECIPE, now)


def finish_corpus(work: Unfinished, path: Path, plan: Plan, report: Callable[[str], None]) -> None:
    """Write everything but the rows; then give the corpus its name."""
    entries, body, folder, features = work.entries, work.body, work.corpus, plan.features
    if body is None:
        reason = f" The first of {work.done}: {work.skipped[0].reason}" if work.skipped else ""
        raise InputError(f"no recordings to prepare; check the source.{reason}")
    if work.spread > 0.001:
        report(
            f"bone lengths differ between recordings by up to {work.spread * 100:.1f} cm;"
            f" rotations are kept, positions use the bones of {entries[0].name}"
        )
    work.finish_arrays()
    parts = [entry.split if plan.official else "" for entry in entries]
    groups = [plan.groups.get(entry.name) or entry.name for entry in entries]
    splits = official_splits([entry.frames for entry in entries], parts, plan.seed, groups)
    if not splits["train"]:
        raise InputError(f"{path}: no recordings for training; add some, or split by the seed (--random-split).")
    write_statistics(folder, entries, splits)
    files = [*ARRAYS, *([WAVEFORM] if features.waveform else []), "statistics.npz"]
    if plan.parts:
        write_json(folder / PARTS, plan.parts)
        files.append(PARTS)
    hashes = {name: sha256_file(folder / name) for name in files}
    manifest = {
        "format": FORMAT,
        "version": VERSION_ON_DEMAND if plan.parts else VERSION,
        "package": __version__,
        "fingerprint": fingerprint_of(hashes),
        "recipe": plan.recipe,
        **features.to_json(),
        "seconds": work.frames / features.fps,
        **body_to_json(body),
        "recordings": [entry.to_json() for entry in entries],
        "splits": {name: [list(segment) for segment in segments] for name, segments in splits.items()},
        "arrays": hashes,
        "annotations": work.annotation_hashes,
        "skipped": [asdict(item) for item in work.skipped],
    }
    write_sealed(folder / MANIFEST, manifest)
    folder.replace(path)
    shutil.rmtree(work.folder, ignore_errors=True)
