"""Hashes in ``run.json``: of the weights and the log beside it, so that a changed file is refused before it is used."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from a2g_jax.errors import InputError
from a2g_jax.io.sealed import write_sealed
from a2g_jax.training.run_file import LOG_FILE, RUN_FILE, WEIGHTS_FILE, read_description

#: Entry with the SHA-256 of the weights, null before there are any.
WEIGHTS_HASH = "weights_sha256"
#: Entry of the moment in which new weights take the place of others: hash and steps of those.
BEFORE = "weights_before"
#: Entry with the length and the SHA-256 of the lines of the log that were written up to the weights.
LOG = "log"


class Written(NamedTuple):
    """What a run folder holds beside ``run.json``."""

    weights: str | None = None
    """SHA-256 of the weights."""
    log: Mapping[str, Any] | None = None
    """``bytes`` and ``sha256`` of the beginning of the log."""

    def entries(self) -> dict[str, Any]:
        """Entries of ``run.json``."""
        return {WEIGHTS_HASH: self.weights, LOG: None if self.log is None else dict(self.log)}


def written_before(folder: Path) -> Written:
    """What ``run.json`` says of the files beside it; of a run of version 0.1.0, the files as they are."""
    if not (folder / RUN_FILE).is_file():
        return Written()
    values, weights = read_description(folder), folder / WEIGHTS_FILE
    if WEIGHTS_HASH in values:
        return Written(values[WEIGHTS_HASH], values.get(LOG))
    return Written(hashlib.sha256(weights.read_bytes()).hexdigest() if weights.is_file() else None)


def write_description(folder: Path, values: Mapping[str, Any], written: Written) -> None:
    """Write ``run.json`` with hashes and checksum."""
    write_sealed(folder / RUN_FILE, {**values, **written.entries()})


def write_exchange(folder: Path, values: Mapping[str, Any], written: Written) -> None:
    """Write ``run.json`` for weights that are about to take the place of others; until then it is right for both."""
    entries = written.entries()
    if (folder / RUN_FILE).is_file() and (folder / WEIGHTS_FILE).is_file():
        try:
            before = read_description(folder)
            entries[BEFORE] = {WEIGHTS_HASH: written_before(folder).weights, "steps": before.get("steps")}
        except InputError:
            pass  # a damaged description, which is replaced
    write_sealed(folder / RUN_FILE, {**values, **entries})


def read_weights(folder: Path) -> tuple[bytes, dict[str, Any]]:
    """The bytes of the weights and the contents of ``run.json`` that belong to them.

    Raises:
        InputError: a file is missing, or the weights are not those of ``run.json``.
    """
    weights = folder / WEIGHTS_FILE
    for _ in range(3):
        # A training may exchange the weights meanwhile, so they are read first.
        data = _bytes(weights)
        values = read_description(folder)
        if WEIGHTS_HASH not in values:  # of version 0.1.0
            return data, values
        digest = hashlib.sha256(data).hexdigest()
        if digest == values[WEIGHTS_HASH]:
            return data, values
        before = values.get(BEFORE)
        if isinstance(before, dict) and digest == before.get(WEIGHTS_HASH):
            return data, {**values, "steps": before.get("steps")}
    raise InputError(
        f"{weights}: differs from its hash in {RUN_FILE}: it was damaged, or is of another run; restore it, or write it"
        " anew from the checkpoint with 'a2g train ... --resume'."
    )


def check_log(folder: Path) -> str:
    """What is wrong with the log of a run; empty if nothing is."""
    about, log = read_description(folder).get(LOG), folder / LOG_FILE
    if not isinstance(about, dict) or not log.is_file():
        return ""
    size = int(about.get("bytes", 0))
    with log.open("rb") as file:
        beginning = file.read(size)
    if hashlib.sha256(beginning).hexdigest() == about.get("sha256"):
        return ""
    return f"{log}: its first {size} bytes differ from their hash in {RUN_FILE}: it was damaged or changed"


def _bytes(weights: Path) -> bytes:
    try:
        return weights.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{weights}: there is no such file; resume training with 'a2g train ... --resume'.") from None
    except OSError as error:
        raise InputError(f"{weights}: cannot be read ({error.strerror}); check the disk.") from None
