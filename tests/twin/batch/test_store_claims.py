"""A store belongs to one call at a time, and its chunks to the study that made them."""

import os
import shutil
import threading
from concurrent.futures import ThreadPoolExecutor

import batch_functions as functions
import numpy as np
import pytest

from twin._checks import InputError
from twin.batch import batched
from twin.store import Store, StoredChunk, claim
from twin.study import read_study, study_status

SAMPLES = np.random.default_rng(3).random((60, 3))


def study(folder, fn=functions.quadratic):
    return batched(fn, SAMPLES, store=folder, progress=False, chunk_size=8)


@pytest.fixture
def folder(tmp_path):
    study(tmp_path / "study")
    return tmp_path / "study"


def chunks(folder):
    return sorted((folder / "chunks").iterdir())


def test_one_process_at_a_time(folder, tmp_path):
    script = tmp_path / "holder.py"
    script.write_text(
        "import sys, pathlib\nfrom twin.store import claim\n"
        "with claim(pathlib.Path(sys.argv[1])):\n    print('held', flush=True)\n    sys.stdin.read()\n"
    )
    with functions.started(script, folder) as process:
        assert process.stdout.readline() == "held\n"
        with pytest.raises(InputError, match="computed by another process"):
            study(folder)
        assert read_study(folder).success.all()
        process.kill()  # and not closed
        process.wait()
        with claim(folder):
            pass
    assert study(folder).success.all()


def test_one_thread_at_a_time(tmp_path, monkeypatch):
    begun, go_on, sync = threading.Event(), threading.Event(), os.fsync

    def slow(descriptor):
        begun.set()
        assert go_on.wait(60)
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", slow)
    (tmp_path / "link").symlink_to(tmp_path / "study")
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(study, tmp_path / "study")
        try:
            assert begun.wait(60)
            for name in ("study", "link"):
                with pytest.raises(InputError, match="computed by another thread of this program"):
                    study(tmp_path / name)
        finally:
            go_on.set()
        digest = first.result(60).digest
    assert study(tmp_path / "link").digest == digest


def test_threads_write_aside_under_names_of_their_own(tmp_path, monkeypatch):
    store, names = Store(tmp_path, {}), []
    monkeypatch.setattr(os, "replace", lambda aside, file: names.append(aside))
    (tmp_path / "chunks").mkdir()
    for _ in range(2):
        store.write(0, StoredChunk(np.arange(1), np.ones(1, np.int8), np.ones(1), {}, {}))
    assert names[0] != names[1]


def _double(row):
    return 2 * row[0]


def _triple(row):
    return 3 * row[0]


def test_chunks_without_their_manifest_are_refused(tmp_path):
    before = study(tmp_path / "study", _double)
    manifest = tmp_path / "study" / "manifest.json"
    text = manifest.read_text()
    manifest.unlink()
    for fn in (_double, _triple):
        with pytest.raises(InputError, match=r"holds 8 chunks of a study, but no manifest\.json"):
            study(tmp_path / "study", fn)
    manifest.write_text(text)
    assert study(tmp_path / "study", _double).digest == before.digest


def test_chunks_of_another_study_are_computed_again(tmp_path):
    study(tmp_path / "double", _double)
    study(tmp_path / "triple", _triple)
    for file in chunks(tmp_path / "triple"):
        file.unlink()
    for file in chunks(tmp_path / "double")[:3]:
        shutil.copy(file, tmp_path / "triple" / "chunks")
    assert study_status(tmp_path / "triple").damaged == 3
    assert not read_study(tmp_path / "triple").success.any()
    with pytest.warns(UserWarning, match="3 chunks were damaged or of another study"):
        found = study(tmp_path / "triple", _triple)
    np.testing.assert_array_equal(found.value, 3 * SAMPLES[:, 0])
