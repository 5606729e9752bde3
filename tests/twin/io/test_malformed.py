"""No file may do more than be refused: one sentence that names it, no code run, no memory taken, no noise."""

import os
import re
import tracemalloc
import warnings

import numpy as np
import pytest

from fitting.cli import main
from tests.twin.io.malformed_files import FILES, WITNESS
from twin._checks import InputError
from twin.io.measurement import read_measurement

# So that a bomb of a few megabytes already counts as one.
LIMIT = 5_000_000


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_there_are_many():
    assert len(FILES) >= 60


@pytest.mark.parametrize("name", FILES)
def test_refused(folder, name, capfd):
    path = folder / name
    FILES[name](path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        if re.search("huge|bomb|lying|many|deep", name):  # it is slow
            tracemalloc.start()
        with pytest.raises(InputError) as caught:
            read_measurement(path, limit=LIMIT)
        peak = tracemalloc.get_traced_memory()[1]  # nothing where it was not started
        tracemalloc.stop()
    assert name in str(caught.value) and "\n" not in str(caught.value) and len(str(caught.value)) < 1200
    assert peak < 12 * LIMIT
    assert not (folder / WITNESS).exists()
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", [name for name in FILES if not name.startswith("zip_bomb")])
def test_command_ends_with_one_sentence(folder, name, capsys):
    FILES[name](folder / name)
    assert main(["look", str(folder / name)]) == 2
    told = capsys.readouterr()
    assert told.err.startswith("drivetwin: ") and name in told.err and "Traceback" not in told.err
    assert told.out == "" and not (folder / WITNESS).exists()


def test_folders_pipes_and_missing_files(folder, capsys):
    os.mkfifo(folder / "pipe.csv")
    (folder / "folder.csv").mkdir()
    (folder / "dangling.csv").symlink_to(folder / "nowhere")
    for name, told in (("pipe.csv", "pipe"), ("folder.csv", "folder"), ("dangling.csv", "exist"), ("a\0b.csv", "zero")):
        with pytest.raises(InputError, match=told):
            read_measurement(folder / name)
    assert main(["look", str(folder / "pipe.csv")]) == 2
    assert "pipe.csv" in capsys.readouterr().err


def test_larger_than_the_limit(folder):
    path = folder / "run.npy"
    np.save(path, np.ones((100_000, 2)))
    assert len(read_measurement(path)) == 2
    with pytest.raises(InputError, match=r"run\.npy.*1 MB"):
        read_measurement(path, limit=1_000_000)
