"""Every notebook runs from its first cell to its last and draws what it says."""

import tempfile
import warnings
from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")
pytest.importorskip("ipykernel")

NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))


def test_there_are_notebooks():
    tours = {"audio2gestures_tour", "stylized_flow_tour", "emotion_gesture_tour"}
    assert tours | {"latent_dct_edits"} <= {path.stem for path in NOTEBOOKS}


#: Seconds that the first cell may take, which does nothing, and then each cell; a few are enough on a quiet machine.
START, PATIENCE = 40, 240


#: What a notebook that is first in its kernel has: no variables, and its own working folder. Where its threads are goes
#: to a file, should a cell take too long.
FIRST = """
get_ipython().run_line_magic("reset", "-f")
import faulthandler, os
os.chdir({folder!r})
faulthandler.dump_traceback_later({seconds}, file=open({stacks!r}, "w"))
del faulthandler, os
"""


@pytest.fixture(scope="module")
def new_kernel():
    """A function that gives a kernel; it is started by the first notebook. All stop in the end."""
    from jupyter_client import AsyncKernelManager
    from nbclient.util import run_sync

    # Sockets are files: ports are chosen before they are bound, and other tests start kernels at the same time. Their
    # paths must be short.
    with tempfile.TemporaryDirectory() as sockets:
        kernels = []

        def new():
            where = f"{sockets}/kernel{len(kernels)}"
            kernels.append(AsyncKernelManager(kernel_name="python3", transport="ipc", ip=where))
            return kernels[-1]

        yield new
        for kernel in kernels:
            if kernel.has_kernel:
                run_sync(kernel.shutdown_kernel)(now=True)


@pytest.fixture(scope="module")
def kernel(new_kernel):
    """One kernel for all notebooks: to import JAX and the package takes seconds."""
    return new_kernel()


def executed(path, folder, stacks, kernel):
    """The notebook with its outputs."""
    notebook = nbformat.read(path, as_version=4)
    first = FIRST.format(folder=str(folder), stacks=str(stacks), seconds=PATIENCE - 10)
    notebook.cells.insert(0, nbformat.v4.new_code_cell(first))
    client = nbclient.NotebookClient(notebook, km=kernel, resources={"metadata": {"path": str(folder)}})
    client.timeout_func = lambda cell: START if cell is notebook.cells[0] else PATIENCE
    try:
        client.execute()
    finally:
        if client.kc is not None:
            client.kc.stop_channels()
    return notebook


@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_runs(path, tmp_path, kernel, new_kernel):
    folder, stacks = tmp_path / "work", tmp_path / "stacks.txt"
    folder.mkdir()
    try:
        notebook = executed(path, folder, stacks, kernel)
    except nbclient.exceptions.CellTimeoutError as error:
        # Once in many runs a kernel no longer answered; a notebook that hangs twice is at fault itself.
        where = stacks.read_text() if stacks.exists() else "in the first cell"
        warnings.warn(f"{path.name} hung: {error}\n{where}", stacklevel=1)
        notebook = executed(path, folder, stacks, new_kernel())
    shown = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    pictures = [output for output in shown if "image/png" in output.get("data", {})]
    assert len(pictures) >= 4
    assert not any(output.output_type == "error" for output in shown)
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_no_cell_waits_for_a_person_or_needs_a_browser(path):
    """``interact`` captures output in messages to a browser, and some runners have none that answers."""
    cells = [cell.source for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]
    assert not any(word in source for source in cells for word in ("interact(", "interactive", "input(", "Output("))
    assert not any(line.startswith(("%", "!")) for source in cells for line in source.splitlines())


def test_edits_are_drawn_when_they_are_chosen(monkeypatch):
    """The cells of the edits as a program of their own, without a kernel; a choice redraws the page."""
    pytest.importorskip("ipywidgets")
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from a2g_jax.models.audio2gestures.edit_presets import EDIT_PRESETS

    cells = nbformat.read(next(p for p in NOTEBOOKS if p.stem == "latent_dct_edits"), as_version=4).cells
    sources = [cell.source for cell in cells if cell.cell_type == "code"]
    names: dict = {}
    for source in [*sources[:2], next(one for one in sources if "ipywidgets" in one)]:
        exec(source, names)
    assert names["place"].value == ""
    names["choice"].value = "calmer"
    page = names["watch"]("calmer").page
    assert names["place"].value.startswith("<iframe srcdoc=")
    for label in ("as drawn", "the talker", "calmer; shared keep 128"):
        assert label in names["place"].value
    assert page.count("m/s3") >= 3
    speed = {
        name: names["figures"](names["space"].to_motion(names["space"].edit(names["codes"], name)))["speed, m/s"]
        for name in ("calmer", "livelier", "slower sway")
    }
    assert speed["slower sway"] < speed["calmer"] < names["figures"](names["motion"])["speed, m/s"] < speed["livelier"]
    assert set(EDIT_PRESETS) <= set(names["choice"].options)
