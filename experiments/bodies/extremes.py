"""Extremes of a corpus, written into the ``run.json`` of a run that was trained on it before they were measured.

    python -m experiments.bodies.extremes RUN CORPUS

Training measures them itself, and so does ``a2g train MODEL --corpus CORPUS --out RUN --resume`` of a finished run with
its checkpoints. This command needs neither checkpoints nor training; the weights are not touched.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.io.sealed import read_sealed, write_sealed
from a2g_jax.metrics.body.bounds import extremes_to_json
from a2g_jax.training.body_extremes import corpus_extremes
from a2g_jax.training.run import open_run
from a2g_jax.training.run_file import RUN_FILE, run_folder


def add_extremes(run: str, corpus: Path) -> None:
    """Write a corpus's extremes into a run's description.

    Raises:
        InputError: another corpus than that of the run, or one without extremes.
    """
    opened, about, config = Corpus.open(corpus), run_folder(run) / RUN_FILE, open_run(run).config
    values = read_sealed(about)
    if values["corpus"]["fingerprint"] != opened.fingerprint:
        raise InputError(f"{about}: was trained on another corpus than {corpus}; name the one that it was trained on.")
    found = corpus_extremes(opened, config if config.source else replace(config, body_extremes=None))
    if found is None:
        raise InputError(f"{corpus}: has less than a minute of training motion, or no rotations.")
    write_sealed(about, values | {"body_extremes": extremes_to_json(found)})


def main(arguments: list[str]) -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="a run folder, or the name of a shipped run")
    parser.add_argument("corpus", type=Path)
    options = parser.parse_args(arguments)
    try:
        add_extremes(options.run, options.corpus)
    except InputError as error:
        raise SystemExit(f"error: {error}") from None


if __name__ == "__main__":
    main(sys.argv[1:])
