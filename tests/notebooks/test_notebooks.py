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


def executed(path, folder, stacks):
    """The notebook with its outputs; where its threads are goes to a file, should a cell take too long."""
    from jupyter_client import AsyncKernelManager

    notebook = nbformat.read(path, as_version=4)
    watch = f"import faulthandler\nfaulthandler.dump_traceback_later({PATIENCE - 10}, file=open({str(stacks)!r}, 'w'))"
    notebook.cells.insert(0, nbformat.v4.new_code_cell(watch))
    resources = {"metadata": {"path": str(folder)}}
    # Sockets are files: ports are chosen before they are bound, and other tests start kernels at the same time. Their
    # paths must be short.
    with tempfile.TemporaryDirectory() as sockets:
        manager = AsyncKernelManager(kernel_name="python3", transport="ipc", ip=f"{sockets}/kernel")
        client = nbclient.NotebookClient(notebook, km=manager, resources=resources)
        client.timeout_func = lambda cell: START if cell is notebook.cells[0] else PATIENCE
        client.execute()
    return notebook


@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_runs(path, tmp_path):
    folder, stacks = tmp_path / "work", tmp_path / "stacks.txt"
    folder.mkdir()
    try:
        notebook = executed(path, folder, stacks)
    except nbclient.exceptions.CellTimeoutError as error:
        # Once in many runs a kernel no longer answered; a notebook that hangs twice is at fault itself.
        where = stacks.read_text() if stacks.exists() else "in the first cell"
        warnings.warn(f"{path.name} hung: {error}\n{where}", stacklevel=1)
        notebook = executed(path, folder, stacks)
    shown = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    pictures = [output for output in shown if "image/png" in output.get("data", {})]
    assert len(pictures) >= 4
    assert not any(output.output_type == "error" for output in shown)
    assert list(folder.iterdir()) == []
