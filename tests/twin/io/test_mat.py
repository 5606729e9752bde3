import h5py
import numpy as np
import pytest
import scipy.io

from twin._checks import InputError
from twin.io.mat import read_mat


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "run.mat"
    values = {"column": np.arange(500.0)[:, None], "gain": 2.5, "label": "text", "pulses": np.uint8([[0], [5]])}
    scipy.io.savemat(path, {**values, "table": np.ones((2, 3)), "nested": {"a": 1.0}}, do_compression=True)
    return path


def test_reads_numbers_and_leaves_out_the_rest(file):
    variables = read_mat(file)
    assert set(variables) == {"column", "gain", "pulses", "table"}
    assert variables["column"].shape == (500,) and variables["gain"].shape == () and variables["table"].shape == (2, 3)
    assert variables["pulses"].dtype == np.uint8


@pytest.mark.parametrize("content", [b"time,position\n0,1\n" * 20, b"\x00" * 300, b"x", bytes(range(256)) * 2])
def test_file_that_is_no_mat(tmp_path, content):
    path = tmp_path / "no.mat"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"no\.mat"):
        read_mat(path)


@pytest.mark.parametrize("kept", [0, 50, 127, 140, 200, 0.5, 0.99])
def test_truncated_file(file, kept):
    content = file.read_bytes()
    file.write_bytes(content[: kept if isinstance(kept, int) else int(kept * len(content))])
    try:
        remaining = read_mat(file)
    except InputError as error:
        assert "run.mat" in str(error)
    else:  # cut between two variables: what is left is sound, and a missing variable is named by the reader
        assert set(remaining) < {"column", "gain", "pulses", "table"}


def test_version_7_3(tmp_path):
    path = tmp_path / "new.mat"
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["table"] = np.arange(6.0).reshape(3, 2)  # MATLAB stores columns first
        file["gain"] = np.full((1, 1), 2.5)
        file["label"] = np.frombuffer("text".encode("utf-16-le"), np.uint16).reshape(-1, 1)
        file["label"].attrs["matlab_class"] = np.bytes_("char")
    content = path.read_bytes()
    path.write_bytes(head + content[128:])
    variables = read_mat(path)
    assert set(variables) == {"table", "gain"} and variables["gain"] == 2.5
    np.testing.assert_array_equal(variables["table"], [[0, 2, 4], [1, 3, 5]])
    path.write_bytes((head + content[128:])[:700])
    with pytest.raises(InputError, match=r"new\.mat.*truncated"):
        read_mat(path)


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(InputError, match=r"gone\.mat.*does not exist"):
        read_mat(tmp_path / "gone.mat")
    with pytest.raises(InputError, match="is a folder"):
        read_mat(tmp_path)
