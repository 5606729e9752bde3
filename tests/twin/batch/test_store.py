"""Studies on disk: what is kept, what is damaged, who reads and writes, what names and numbers come back."""

import json
import os
from concurrent.futures import ThreadPoolExecutor

import batch_functions as functions
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.batch import StudyInterrupted, batched
from twin.batch_result import DONE, WAITING
from twin.store import Store, StoredChunk
from twin.study import Gathered, read_study, study_status

SAMPLES = np.random.default_rng(3).random((60, 3))
WIDTH = 8


def study(folder, fn=functions.quadratic, samples=SAMPLES, **options):
    return batched(fn, samples, store=folder, progress=False, **{"chunk_size": WIDTH, **options})


@pytest.fixture
def folder(tmp_path):
    study(tmp_path / "study")
    return tmp_path / "study"


@pytest.fixture(scope="module")
def whole():
    return batched(functions.quadratic, SAMPLES, chunk_size=WIDTH, progress=False).digest


def chunks(folder):
    return sorted((folder / "chunks").iterdir())


def test_a_study_is_computed_once(folder, whole):
    before = {file.name: file.stat().st_mtime_ns for file in chunks(folder)}
    assert len(before) == 8
    assert study(folder).digest == read_study(folder).digest == whole
    assert {file.name: file.stat().st_mtime_ns for file in chunks(folder)} == before


def test_a_removed_chunk_is_computed_again(folder, whole):
    chunks(folder)[3].unlink()
    waiting = read_study(folder)
    assert np.count_nonzero(waiting.status == WAITING) == WIDTH
    assert np.isnan(waiting["sum"][3 * WIDTH : 4 * WIDTH]).all()
    assert "8 wait" in waiting.message
    assert study(folder).digest == whole


@settings(deadline=None, max_examples=12)
@given(data=st.data())
def test_a_flipped_byte_is_found_wherever_it_is(tmp_path_factory, whole, data):
    folder = tmp_path_factory.mktemp("flipped") / "study"
    study(folder)
    file = data.draw(st.sampled_from(chunks(folder)))
    content = bytearray(file.read_bytes())
    content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    file.write_bytes(content)
    assert study_status(folder).damaged == 1
    assert "damaged chunks: 1" in str(study_status(folder))
    with pytest.warns(UserWarning, match=f"first is chunk {int(file.name[:7])}"):
        assert study(folder).digest == whole
    assert study_status(folder).damaged == 0


@pytest.mark.parametrize("left", [0, 1, 100, -1])
def test_a_half_written_chunk_is_found(folder, whole, left):
    file = chunks(folder)[0]
    file.write_bytes(file.read_bytes()[:left])
    with pytest.warns(UserWarning, match="damaged"):
        assert study(folder).digest == whole


def test_what_was_written_aside_is_removed(folder, whole):
    aside = folder / "chunks" / "0000002-abc.npz.1.partial"
    aside.write_bytes(b"PK")
    assert study(folder).digest == whole
    assert not aside.exists()


@settings(deadline=None, max_examples=12)
@given(data=st.data())
def test_a_damaged_manifest_is_named(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("manifest") / "study"
    study(folder)
    file = folder / "manifest.json"
    content = bytearray(file.read_bytes())
    place = data.draw(st.integers(0, len(content) - 1))
    content[place] ^= data.draw(st.sampled_from([1, 2, 3, 128]))
    try:
        if json.loads(content) == json.loads(file.read_bytes()):
            return  # white space
    except ValueError:
        pass
    file.write_bytes(content)
    for read in (study, read_study, study_status):
        with pytest.raises(InputError, match=r"manifest\.json (is damaged|has the format)"):
            read(folder)


@pytest.mark.parametrize("damage", [lambda data: data[:50], lambda data: data.replace(data[300:302], b"??"), None])
def test_damaged_samples_are_written_again(folder, whole, damage):
    file = folder / "samples.npz"
    if damage is None:
        file.unlink()
    else:
        file.write_bytes(damage(file.read_bytes()))
    with pytest.raises(InputError, match=r"samples of .* cannot be read"):
        read_study(folder)
    with pytest.warns(UserWarning, match="samples were damaged"):
        assert study(folder).digest == whole
    np.testing.assert_array_equal(read_study(folder).samples["samples"], SAMPLES)


def test_foreign_places_are_refused(tmp_path):
    (tmp_path / "letters").mkdir()
    (tmp_path / "letters" / "letter.txt").write_text("Dear")
    with pytest.raises(InputError, match=r"holds 'letter\.txt', but no study"):
        study(tmp_path / "letters")
    assert len(list((tmp_path / "letters").iterdir())) == 1
    with pytest.raises(InputError, match="is a file"):
        study(tmp_path / "letters" / "letter.txt")
    for read in (read_study, study_status):
        with pytest.raises(InputError, match="holds no study"):
            read(tmp_path / "letters")


def test_a_folder_that_cannot_be_written(tmp_path):
    if not hasattr(os, "geteuid") or os.geteuid() == 0:
        pytest.skip("permissions do not bind the superuser")
    (tmp_path / "mine").mkdir(mode=0o500)
    with pytest.raises(StudyInterrupted, match="Nothing was computed"):
        study(tmp_path / "mine" / "study")


@pytest.mark.parametrize("nth", range(1, 8))
def test_no_space_left(tmp_path, monkeypatch, whole, nth):
    calls, sync = 0, os.fsync

    def full(descriptor):
        nonlocal calls
        calls += 1
        if calls >= nth:
            raise OSError(28, "No space left on device")
        sync(descriptor)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(StudyInterrupted, match="No space left on device") as told:
            study(tmp_path / "study")
    kept = max(0, nth - 3)  # samples and manifest come first
    assert ("Nothing was computed" if nth < 3 else f"{kept} chunks are kept") in str(told.value)
    assert not list((tmp_path / "study").rglob("*.partial"))
    assert study(tmp_path / "study").digest == whole


def test_it_can_be_read_while_it_runs(tmp_path):
    seen = []

    def watched(row):
        if len(seen) < 3 and row[0] == SAMPLES[18 * (len(seen) + 1), 0]:
            found = read_study(tmp_path / "study")
            seen.append(np.count_nonzero(found.status == WAITING))
            assert np.array_equal(found.value[found.success], SAMPLES[found.success].sum(axis=1))
        return row.sum()

    # Threads of this process: what the function closes over is then the same.
    study(tmp_path / "study", watched, mode="loop", chunk_size=5)
    assert seen == sorted(seen, reverse=True)
    assert len(seen) == 3
    assert 60 > seen[0] > seen[-1] > 0


def test_nothing_is_pickled(folder):
    for file in [folder / "samples.npz", *chunks(folder)]:
        with np.load(file, allow_pickle=False) as arrays:
            assert all(arrays[name].dtype.kind in "iuf" for name in arrays.files)


NAMES = st.lists(st.text(min_size=1, max_size=12), unique=True, min_size=1, max_size=4)
KINDS = st.sampled_from(["f8", "f4", "i8", "u1", "?", "c16"])


@settings(deadline=None, max_examples=40)
@given(names=NAMES, kind=KINDS, shape=st.lists(st.integers(0, 3), max_size=2), seed=st.integers(0, 99))
def test_outputs_of_any_name_type_and_shape_come_back(tmp_path_factory, names, kind, shape, seed):
    rng = np.random.default_rng(seed)
    values = {name: (4 * rng.random((6, *shape))).astype(kind) for name in [*names, "a/b", "a.npy", "a", "../up"]}
    store = tmp_path_factory.mktemp("any")
    (store / "chunks").mkdir()
    numbers = np.arange(6)[::-1]
    Store(store, {}).write(4, StoredChunk(numbers, np.ones(6, np.int8), np.ones(6), values, {2: "no\0t"}))
    assert [file.parent.name for file in store.rglob("*.npz")] == ["chunks"]
    found = Store(store, {}).read(Store(store, {}).files()[4])
    assert list(found.values) == list(values)
    assert found.messages == {2: "no\0t"}
    for name, value in values.items():
        np.testing.assert_array_equal(found.values[name], value, strict=True)


def test_functions_with_outputs_of_many_kinds(tmp_path):
    def many(x):
        return {
            "a/b": x[0] > 0.5,
            "..": (10 * x[1]).astype(int),
            "übrig ": x[0] + 1j * x[1],
            "matrix": jnp.outer(x, x),
        }

    samples = SAMPLES.copy()
    samples[5, 1] = np.nan
    found = study(tmp_path / "study", many, samples)
    assert found.digest == batched(many, samples, chunk_size=WIDTH, progress=False).digest
    assert list(found.outputs) == ["a/b", "..", "übrig ", "matrix"]
    assert [found[name].dtype.kind for name in found.outputs] == ["b", "i", "c", "f"]
    np.testing.assert_array_equal(found["matrix"][7], np.outer(SAMPLES[7], SAMPLES[7]))
    assert np.isnan(found["matrix"][5]).all()


@pytest.mark.parametrize("stored", [True, False])
def test_whole_numbers_and_fractions_mix(tmp_path, stored):
    found = batched(
        lambda x: 0 if x[0] < 0.5 else 0.5,
        np.linspace(0, 1, 10)[:, None],
        mode="loop",
        chunk_size=2,
        progress=False,
        store=tmp_path / "study" if stored else None,
    )
    np.testing.assert_array_equal(found.value, [0] * 5 + [0.5] * 5)


@pytest.mark.parametrize("stored", [True, False])
@pytest.mark.parametrize("other", [{"b": 1.0}, {"a": np.ones(3)}])
def test_outputs_must_be_alike(tmp_path, stored, other):
    with pytest.raises(InputError, match=r"for some samples and .* for others"):
        batched(
            lambda x: {"a": 1.0} if x[0] < 0.5 else other,
            np.linspace(0, 1, 10)[:, None],
            mode="loop",
            chunk_size=1,
            progress=False,
            store=tmp_path / "study" if stored else None,
        )


@settings(deadline=None, max_examples=30)
@given(order=st.permutations(range(12)), width=st.integers(1, 12))
def test_chunks_are_put_together_in_any_order(order, width):
    gathered = Gathered(12)
    for start in range(0, 12, width):
        numbers = np.array(order[start : start + width])
        rows = len(numbers)
        gathered.add(StoredChunk(numbers, np.full(rows, DONE), np.ones(rows), {"twice": 2 * numbers}, {}))
    np.testing.assert_array_equal(gathered.outputs["twice"], 2 * np.arange(12))


def test_threads_of_the_caller_write_the_same(tmp_path, whole):
    with ThreadPoolExecutor(2) as pool:
        assert study(tmp_path / "study", executor=pool).digest == whole
