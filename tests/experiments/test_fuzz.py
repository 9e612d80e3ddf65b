"""The fuzz campaign sees crashes, long times and unnamed refusals, and its changes depend on the seed alone."""

import json
import os

import numpy as np
import pytest

from a2g_jax.errors import InputError
from experiments.fuzz import __main__ as command
from experiments.fuzz import child
from experiments.fuzz.child import CRASH, LARGE, READ, REFUSED, SLOW, UNNAMED, read_apart
from experiments.fuzz.mutations import change_bytes, change_json, change_text
from experiments.fuzz.readers import READERS

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")


def raises(error):
    def read(path):
        raise error(f"{path}: is damaged." if error is InputError else "anything")

    return read


def unnamed(path):
    raise InputError("is damaged")


def two_lines(path):
    raise InputError(f"{path}: is\ndamaged")


def busy(path):
    while True:
        pass


def large(path):
    return np.ones(30_000_000).sum()


@pytest.mark.filterwarnings("ignore:.*fork.*")
def test_outcomes(tmp_path, monkeypatch):
    path = tmp_path / "a.txt"
    path.write_text("a")
    monkeypatch.setattr(child, "SECONDS", 0.5)
    monkeypatch.setattr(child, "_STOP_SECONDS", 1)
    kinds = {
        len: CRASH,
        raises(InputError): REFUSED,
        raises(ValueError): CRASH,
        raises(KeyboardInterrupt): CRASH,
        (lambda path: path.read_text()): READ,
        (lambda path: os.abort()): CRASH,
        unnamed: UNNAMED,
        two_lines: UNNAMED,
        busy: SLOW,
        raises(MemoryError): LARGE,
    }
    for read, kind in kinds.items():
        assert read_apart(read, path).kind == kind
    monkeypatch.setattr(child, "SECONDS", 60.0)
    monkeypatch.setattr(child, "MEMORY", 1e8)
    assert read_apart(large, path).kind == LARGE
    assert "test_fuzz.py" in read_apart(raises(ValueError), path).message


def test_changes_are_those_of_the_seed():
    text = b'{"a": [1, 2.5], "checksum": "x", "b": "text"}\n' * 1
    for change in (change_bytes, change_text, change_json):
        first, again = (
            [change(text, np.random.default_rng([seed, 0]), [text]) for seed in range(40)] for _ in range(2)
        )
        assert first == again
        assert len(set(first)) > 20
    edits = [change_json(text, np.random.default_rng([seed, 1]), [text]) for seed in range(40)]
    assert any(b'"checksum": null' in edit for edit in edits)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*fork.*")
def test_a_short_campaign(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(command, "RESULTS", tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    names = [reader.name for reader in READERS]
    assert len(set(names)) == len(names)
    assert command.main(["--files", "8", "--reader", "TextGrid", "--reader", "NPY", "--record"]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [row["reader"] for row in rows] == ["TextGrid", "NPY"]
    assert all(sum(row["outcomes"].values()) == 8 for row in rows)
    command.main(["--files", "4", "--first", "8", "--reader", "TextGrid", "--record"])
    table = (tmp_path / "fuzz.md").read_text()
    assert "| TextGrid | 12 |" in table
    assert "| NPY | 8 |" in table
