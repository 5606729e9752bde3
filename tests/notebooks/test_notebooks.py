"""Every notebook runs from top to bottom; its last cell asserts its own headline numbers.

Notebooks that take long run smaller here, by DRIVETWIN_FAST=1; `make notebooks` runs them in full.
"""

import os
from pathlib import Path
from tempfile import gettempdir

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
def test_notebook_runs(path, monkeypatch):
    monkeypatch.setenv("DRIVETWIN_FAST", os.environ.get("DRIVETWIN_FAST", "1"))
    if path.stem in NEEDS:
        try:
            data_file(NEEDS[path.stem])
        except DataNotFound as error:
            pytest.skip(str(error))
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": path.parent}}
    ).execute()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebook_is_small(path):
    assert path.stat().st_size < 200_000


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebook_is_stored_as_it_ran(path):
    """In double precision, in one go from the first cell, without an error, with assertions at its end."""
    code = [cell for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]
    assert "jax_enable_x64" in code[0].source
    assert "assert " in code[-1].source
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    assert all(output.output_type != "error" for cell in code for output in cell.outputs)
    assert sum(any("image/png" in output.get("data", {}) for output in cell.outputs) for cell in code) >= 2


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_outputs_show_no_folder_of_the_machine_they_ran_on(path):
    outputs = [output for cell in nbformat.read(path, as_version=4).cells for output in cell.get("outputs", [])]
    text = "".join(str(output.get("text", "")) for output in outputs)
    text += "".join(
        str(value) for output in outputs for kind, value in output.get("data", {}).items() if "image" not in kind
    )
    for folder in (str(Path.home()), str(Path(__file__).parents[2]), gettempdir(), "/home/", "/Users/"):
        assert folder == "/" or folder not in text
