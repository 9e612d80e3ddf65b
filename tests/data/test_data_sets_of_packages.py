"""Data sets of other packages, found by entry point or as ``module:name``."""

import sys

import pytest

from a2g_jax.data.data_set_names import NAMES, all_names
from a2g_jax.data.datasets import data_set_lines, find_data_set
from a2g_jax.data.prepare import prepare_data_set
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk

READER = """
from a2g_jax.data.datasets import DataSet
from a2g_jax.data.datasets.folder import find, read

class Studio:
    READER = DataSet(name="studio", title="Our studio", fps=30.0, find=find, read=read, about="Ask Anna.")

DATASET = Studio.READER
NUMBER = 3
"""
ENTRY_POINTS = """[a2g_jax.data_sets]
studio = a2g_test_studio.reader
anna = a2g_test_studio.reader:Studio.READER
beat = a2g_test_studio.reader:NUMBER
number = a2g_test_studio.reader:NUMBER
lost = a2g_test_studio.reader:LOST
raising = a2g_test_studio.raising
"""


@pytest.fixture
def package(tmp_path, monkeypatch):
    """An installed package with readers that work and others that do not."""
    root = tmp_path / "site"
    for name, text in {
        "a2g_test_studio/__init__.py": "",
        "a2g_test_studio/reader.py": READER,
        "a2g_test_studio/raising.py": "raise RuntimeError('no licence\\nfound')\n",
        "a2g_test_studio/importing.py": "import no_such_module_anywhere\n",
        "a2g_test_studio-2.1.dist-info/METADATA": "Metadata-Version: 2.1\nName: a2g-test-studio\nVersion: 2.1\n",
        "a2g_test_studio-2.1.dist-info/entry_points.txt": ENTRY_POINTS,
    }.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    monkeypatch.syspath_prepend(str(root))
    yield
    for name in [name for name in sys.modules if name.startswith("a2g_test_studio")]:
        del sys.modules[name]


def test_names_are_listed_without_importing_the_package(package):
    assert all_names() == (*NAMES, "anna", "lost", "number", "raising", "studio")
    assert "a2g_test_studio" not in sys.modules


@pytest.mark.parametrize(
    "name", ["studio", "anna", "a2g_test_studio.reader:DATASET", "a2g_test_studio.reader:Studio.READER"]
)
def test_data_sets_that_are_found(package, name):
    assert find_data_set(name).title == "Our studio"
    assert find_data_set("beat").title != "Our studio"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "raising",
            "data set 'raising' of the package a2g-test-studio 2.1 (a2g_test_studio.raising): cannot be loaded"
            " (RuntimeError: no licence found); fix or remove it.",
        ),
        ("lost", "a2g-test-studio 2.1 (a2g_test_studio.reader:LOST): cannot be loaded (AttributeError: "),
        ("number", "a2g-test-studio 2.1 (a2g_test_studio.reader:NUMBER): expected a DataSet; got int; see "),
        ("a2g_test_studio.reader:NUMBER", "expected a DataSet; got int"),
        ("a2g_test_studio.reader:LOST", "a2g_test_studio.reader defines no LOST; check the name."),
        ("a2g_test_studio.importing:X", "cannot be imported (ModuleNotFoundError: No module named 'no_such"),
        ("a2g_test_studio.missing:X", "there is no module 'a2g_test_studio.missing'; install its package"),
        ("no_such_package.reader:X", "there is no module 'no_such_package'; install its package"),
        ("a2g_test_studio:", "expected a DataSet; got module a2g_test_studio without DATASET"),
        (":X", "cannot be imported (ValueError: Empty module name)"),
        ("studioo", "no data set 'studioo'; there are: folder, "),
    ],
)
def test_data_sets_that_cannot_be_loaded(package, name, message):
    with pytest.raises(InputError) as caught:
        find_data_set(name)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert find_data_set("studio").title == "Our studio"


def test_the_list_goes_past_a_broken_package(package):
    lines = dict(data_set_lines())
    assert lines["studio: Our studio, 30 fps"] == "Ask Anna."
    assert any(line.startswith("raising: not available: data set 'raising' of the package a2g-test") for line in lines)
    assert len(lines) == len(all_names())


@pytest.mark.parametrize("name", ["studio", "a2g_test_studio.reader:Studio.READER"])
def test_worker_processes_find_the_reader(package, tmp_path, name):
    for number in range(3):
        take = talk(3.0, number)
        write_audio(tmp_path / "source" / f"{number}.wav", take.audio, 16000)
        write_bvh(tmp_path / "source" / f"{number}.bvh", take.motion)
    corpus = prepare_data_set(name, tmp_path / "source", tmp_path / "corpus", Features(), workers=2)
    assert [entry.name for entry in corpus.recordings] == ["0", "1", "2"]
