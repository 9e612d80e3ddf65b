"""Inspection of anything by its path."""

import os
from pathlib import Path

from a2g_jax.data.corpus_layout import MANIFEST
from a2g_jax.errors import InputError
from a2g_jax.inspection.corpora import inspect_corpus
from a2g_jax.inspection.files import Inspected, inspect_file, inspect_together
from a2g_jax.inspection.folders import inspect_folder
from a2g_jax.inspection.report import Report
from a2g_jax.inspection.runs import inspect_run
from a2g_jax.io.reading import reading
from a2g_jax.training.run_file import RUN_FILE, SHIPPED


def inspect(
    name: str | os.PathLike[str],
    audio: str | os.PathLike[str] | None = None,
    verify: bool = False,
    *,
    channel: int | None = None,
    tier: str | None = None,
) -> Report:
    """Facts about a file, a folder of recordings, a corpus or a run, and its likely faults.

    Args:
        name: path of the file or folder, or the name of a run that comes with the package: ``"demo"``,
            ``"demo-flow"`` or ``"demo-emotion"``. ``"./demo"`` is a folder of that name.
        audio: the speech that belongs to a motion or a transcript.
        verify: read all files of a corpus to compare their hashes, also those that seem unchanged since last time.
        channel: of audio files, from 1 on; None for the mean of all.
        tier: of TextGrids, its name or the speaker's; None for the first one of words.

    Raises:
        InputError: no such file or folder, or one of an unknown kind.
    """
    with reading(channel, tier):
        return _inspect(name, audio, verify)


def _inspect(name: str | os.PathLike[str], audio: str | os.PathLike[str] | None, verify: bool) -> Report:
    path = Path(name)
    if name in SHIPPED or path.is_dir():
        if audio is not None:
            kind = "a run" if name in SHIPPED else "a folder"
            raise InputError(f"{name}: is {kind}; --audio belongs to one motion or transcript.")
        if name in SHIPPED:
            return inspect_run(name)
        if (path / MANIFEST).exists():
            return inspect_corpus(path, verify)
        if (path / RUN_FILE).exists():
            return inspect_run(path)
        return inspect_folder(path)
    found: Inspected = inspect_file(path)
    if audio is not None:
        found = inspect_together(found, inspect_file(Path(audio)))
    return Report(found.path, found.kind, found.facts, found.findings)
