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
from a2g_jax.training.run_file import RUN_FILE, SHIPPED


def inspect(name: str | os.PathLike[str], audio: str | os.PathLike[str] | None = None, verify: bool = False) -> Report:
    """Facts about a file, a folder of recordings, a corpus or a run, and its likely faults.

    Args:
        name: path of the file or folder, or the name of a run that comes with the package: ``"demo"`` or
            ``"demo-flow"``. ``"./demo"`` is a folder of that name.
        audio: the speech that belongs to a motion or a transcript.
        verify: read all files of a corpus to compare their hashes, also those that seem unchanged since last time.

    Raises:
        InputError: no such file or folder, or one of an unknown kind.
    """
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
