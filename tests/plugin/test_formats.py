"""Output formats of other packages: used when they are chosen, and harmless when they are broken."""

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation.formats import MotionFiles, format_names
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """A package with the formats ``csv`` (works), ``gone`` (no such module), ``odd`` (no format) and ``html``."""
    (tmp_path / "toy_formats.py").write_text(
        "from a2g_jax.generation.formats import MotionFormat\n"
        "CSV = MotionFormat('.csv', 'toy_formats:write')\n"
        "ODD = 3\n"
        "def write(path, motion):\n"
        "    path.write_text(f'{motion.frames}')\n"
    )
    info = tmp_path / "toy_formats-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-formats\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[a2g_jax.formats]\ncsv = toy_formats:CSV\ngone = no_such_module:X\nodd = toy_formats:ODD\n"
        "html = toy_formats:CSV\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))


def test_a_format_of_another_package_is_written(packages, tmp_path):
    assert format_names() == ("bvh", "npz", "csv", "gone", "odd", "html")
    skeleton = Skeleton(np.zeros((1, 3), np.float32), ("a",), (-1,))
    motion = Motion(np.tile(np.eye(3, dtype=np.float32), (5, 1, 1, 1)), np.zeros((5, 3), np.float32), skeleton, 30.0)
    out = tmp_path / "out"
    for number in (3, 0):  # files of the first call, of motions that the second one has not, go
        with MotionFiles(out, ("sample",), ("csv", "html")) as files:
            files.write(number, motion)
    assert [path.name for path in out.iterdir()] == ["sample_00.csv"]
    assert (out / "sample_00.csv").read_text() == "5"


def test_a_broken_format_is_named_when_it_is_chosen_and_only_then(packages, tmp_path, capsys):
    with pytest.raises(SystemExit, match="0"):
        main(["generate", "--help"])
    assert "gone" in capsys.readouterr().out
    for name, message in (("gone", "the package toy-formats 1.0"), ("odd", "expected a MotionFormat; got int")):
        with pytest.raises(InputError, match=message):
            MotionFiles(tmp_path / "out", ("sample",), (name,))
        assert not (tmp_path / "out").exists()
