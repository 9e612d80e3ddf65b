"""What ``a2g inspect`` does; its flags are in :mod:`a2g_jax.inspection.arguments`."""

import argparse
import json
from pathlib import Path

from a2g_jax.data.corpus import MANIFEST
from a2g_jax.errors import InputError
from a2g_jax.inspection.corpora import inspect_corpus
from a2g_jax.inspection.files import Inspected, inspect_file, inspect_together
from a2g_jax.inspection.folders import inspect_folder
from a2g_jax.inspection.likelihood import file_likelihood, likelihood_report
from a2g_jax.inspection.report import Report
from a2g_jax.inspection.runs import inspect_run
from a2g_jax.training.run import RUN_FILE


def inspect(path: Path, audio: Path | None = None) -> Report:
    """Look at a file, a folder of recordings, a corpus or a run.

    Args:
        audio: the speech that belongs to a motion or a transcript.

    Raises:
        InputError: there is no such file or folder, or nothing is known about its kind.
    """
    if path.is_dir():
        if audio is not None:
            raise InputError(f"{path}: is a folder; --audio belongs to one motion or transcript.")
        if (path / MANIFEST).exists():
            return inspect_corpus(path)
        if (path / RUN_FILE).exists():
            return inspect_run(path)
        return inspect_folder(path)
    found: Inspected = inspect_file(path)
    if audio is not None:
        found = inspect_together(found, inspect_file(audio))
    return Report(found.path, found.kind, found.facts, found.findings)


def run(options: argparse.Namespace, _extra: list[str]) -> int:
    """``a2g inspect``; returns the exit status: 1 if ``--strict`` was asked for and there are warnings, else 0."""
    audio = Path(options.audio) if options.audio else None
    if options.score is None and options.picture is not None:
        raise InputError("--picture: draws a likelihood; add --score MOTION, or leave it out.")
    report = inspect(Path(options.path), audio) if options.score is None else _score(options, audio)
    print(
        json.dumps(report.to_json(), indent=2, ensure_ascii=False, allow_nan=False) if options.json else report.text()
    )
    return 1 if options.strict and report.warnings else 0


def _score(options: argparse.Namespace, audio: Path | None) -> Report:
    """``--score``: the report, and the picture if one is asked for."""
    if audio is None:
        raise InputError("--score: needs the speech that belongs to the motion; add --audio FILE.")
    picture = None if options.picture is None else Path(options.picture)
    if picture is not None and picture.suffix.lower() != ".png":
        raise InputError(f"--picture {picture}: expected a name that ends in .png.")
    likelihood = file_likelihood(Path(options.path), Path(options.score), audio)
    if picture is not None:
        # Late, since Matplotlib is optional.
        from a2g_jax.inspection.likelihood_plot import save_likelihood

        save_likelihood(picture, likelihood.seconds, likelihood.log_likelihood, likelihood.moments)
    return likelihood_report(likelihood, Path(options.score), curve=options.json)
