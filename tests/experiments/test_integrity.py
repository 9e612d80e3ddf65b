"""The campaign of kills itself, on a command that takes a moment."""

import subprocess
import sys

import numpy as np

from experiments.integrity import kills
from experiments.integrity.__main__ import table
from experiments.integrity.commands import Command

_SCRIPT = """
import sys
from pathlib import Path
from a2g_jax.io.files import write_json
folder = Path(sys.argv[-1])
folder.mkdir(exist_ok=True)
for number in range(2):
    write_json(folder / f"{number}.json", [number] * 100)
"""
CASE = Command("toy", (), "out")


def test_a_chain_of_kills_ends_with_the_same_files(monkeypatch, tmp_path):
    def start(arguments):
        return subprocess.Popen([sys.executable, "-c", _SCRIPT, *arguments], stderr=subprocess.PIPE)

    monkeypatch.setattr(kills, "start", start)
    _, expected = kills._reference(CASE, tmp_path)
    monkeypatch.setattr(kills, "_reference", lambda case, cache: (1e-6, expected))  # killed while it starts
    row = kills._chain(CASE, tmp_path, np.random.default_rng(0), 4, 1.0)
    assert (row["kills"], row["same result"], row["faults"], row["left behind"]) == (4, True, [], [])
    (tmp_path / "kills" / "toy" / "out" / "1.json").write_text("[1")
    assert kills._torn(CASE, tmp_path / "kills" / "toy", expected) == ["out/1.json"]


def test_the_table_counts_outcomes():
    text = table({"runs": {"bit": {"named": 3}, "zeros": {}, "cut": {"used silently": 1}}}, [], 0)
    assert "| runs, cut | 1 | 0 | 0 | 1 | 0 |" in text
