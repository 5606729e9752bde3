"""Random bytes and mutated files: read, or refused with an InputError, and nothing else."""

import functools
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.twin.io import measured_files as made
from twin._checks import InputError
from twin.io.look import look
from twin.io.measurement import Measurement, read_measurement

LIMIT = 20_000_000
ENDINGS = (".csv", ".mat", ".uff", ".h5", ".tdms", ".wav", ".npz", "")
WORDS = (b"\xff" * 4, bytes(4), b"\x7f\xff\xff\xff", b"\0\0\0\x40")
# Each is read by a process of its own first.
HDF5 = ("run.h5", "run73.mat")


@functools.cache
def whole(name: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        return made.WRITERS[name](Path(folder) / name).read_bytes()


def read_or_refused(data: bytes, name: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(data)
        try:
            found = read_measurement(path, limit=LIMIT)
        except InputError as error:
            assert name in str(error)
            return
    assert isinstance(found, Measurement) and len(found) > 0
    for channel in found:
        assert channel.values.dtype in (np.float64, np.complex128)
    assert look(found).text()


@settings(max_examples=60, deadline=None)
@given(st.binary(min_size=1, max_size=400), st.sampled_from(ENDINGS))
def test_random_bytes(data, ending):
    read_or_refused(data, f"run{ending}")


@settings(max_examples=60, deadline=None)
@given(st.text("0123456789.,;:eE+-\t \n|x[]#\"'", min_size=1, max_size=400))
def test_random_tables(text):
    read_or_refused(text.encode(), "run.csv")


def mutated(name: str, data: st.DataObject) -> bytes:
    content = bytearray(whole(name))
    head = min(len(content) - 1, 600)
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.one_of(st.integers(0, head), st.integers(0, len(content) - 1)))
        how = data.draw(st.sampled_from(["byte", "word", "cut", "double"]))
        if how == "byte":
            content[at] = data.draw(st.integers(0, 255))
        elif how == "word":
            content[at : at + 4] = data.draw(st.sampled_from(WORDS))
        elif how == "cut":
            del content[at : at + data.draw(st.integers(1, 64))]
        else:
            content[at:at] = content[at : at + 32]
        head = min(head, len(content) - 1)
    return bytes(content)


@pytest.mark.parametrize("name", [name for name in made.WRITERS if name not in HDF5])
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_mutated_files(name, data):
    read_or_refused(mutated(name, data), name)


@pytest.mark.slow
@pytest.mark.parametrize("name", HDF5)
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_mutated_hdf5_files(name, data):
    read_or_refused(mutated(name, data), name)
