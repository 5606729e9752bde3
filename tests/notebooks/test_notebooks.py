"""Every notebook runs from top to bottom; its last cell asserts its own headline numbers."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from twin.io.data import DataNotFound, data_file

NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))
NEEDS = {"01_servo_axis": "emps/DATA_EMPS.mat"}


def test_there_are_notebooks():
    assert NOTEBOOKS


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebook_runs(path):
    if path.stem in NEEDS:
        try:
            data_file(NEEDS[path.stem])
        except DataNotFound as error:
            pytest.skip(str(error))
    notebook = nbformat.read(path, as_version=4)
    assert "jax_enable_x64" in notebook.cells[1].source or "jax_enable_x64" in notebook.cells[0].source
    NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": path.parent}}).execute()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebook_is_small(path):
    assert path.stat().st_size < 200_000
