"""Studies that are killed or interrupted at any moment go on where they were, to the same bits."""

import json
import os
import signal
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import batch_functions as functions
import jax.numpy as jnp
import numpy as np
import pytest

from twin.batch import StudyInterrupted, batched
from twin.batch_result import NOT_FINITE
from twin.study import read_study, study_status

HERE = Path(__file__).parent
SAMPLES = np.random.default_rng(6).random((50, 2))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills by SIGKILL")
@pytest.mark.parametrize("kills", [4, pytest.param(20, marks=pytest.mark.slow)])
def test_kills(tmp_path, kills):
    with functions.started(HERE / "killed_study.py", tmp_path / "study", kills) as process:
        printed, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    found = json.loads(printed)
    assert sum(found["killed"]) >= 0.75 * kills
    assert found["aside"] >= 3  # amid writing samples, manifest, chunk
    assert found["chunks"] == sorted(found["chunks"])
    assert found["chunks"][4] == 0
    assert kills == 4 or found["chunks"][-1] > 0
    assert found["resumed"] == found["uninterrupted"]


@pytest.mark.skipif(os.name == "nt", reason="signals")
@pytest.mark.parametrize("where", ["threads", pytest.param("workers", marks=pytest.mark.slow)])
def test_ctrl_c_keeps_what_was_done(tmp_path, where):
    folder, script = tmp_path / "study", HERE / "interrupted_study.py"
    with functions.started(script, folder, where, PAUSE="0.5") as process:
        functions.wait_until(lambda: len(list(folder.glob("chunks/*.npz"))) >= 2)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)  # all of it would take longer
    assert process.returncode in (1, -signal.SIGINT)
    assert errors.count("Traceback") == 1, errors
    assert "KeyboardInterrupt" in errors
    assert errors.rstrip().endswith("the same call goes on from there.")
    kept = read_study(folder)
    assert 2 <= np.count_nonzero(kept.success) < 150
    with functions.started(script, folder, where, PAUSE="0") as process:
        printed, errors = process.communicate(timeout=120)
    assert printed == "200 of 200 samples computed.\n", errors
    np.testing.assert_array_equal(read_study(folder).value, np.arange(200.0) ** 2)
    assert np.all(read_study(folder).seconds[kept.success] == kept.seconds[kept.success])  # and not computed again


def low_alone(x):
    """Of high samples nothing is known at first."""
    return jnp.where(x[0] > 0.4, jnp.nan, x[0])


def most(x):
    """The second try finds all but the highest."""
    return jnp.where(x[0] > 0.9, jnp.nan, 10 * x[0])


def test_the_second_try_goes_on_as_well(tmp_path, monkeypatch):
    options = {"retry": most, "chunk_size": 8, "progress": False}
    whole = batched(low_alone, SAMPLES, **options)
    assert np.any(whole.status == NOT_FINITE)
    first, again = 7, -(-np.count_nonzero(SAMPLES[:, 0] > 0.4) // 8)
    assert again >= 3
    sync, left = os.fsync, 0

    def full(descriptor):
        nonlocal left
        left -= 1
        if left < 0:
            raise OSError(28, "No space left on device")
        sync(descriptor)

    folder, told = tmp_path / "study", 0
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        for call in range(first + again):  # one chunk more with each call
            left = 3 if call == 0 else 1
            try:
                batched(low_alone, SAMPLES, store=folder, **options)
            except StudyInterrupted:
                told += 1
            assert study_status(folder).complete == (told <= call)
            if call == first:
                assert f"second try: 1 of {again} chunks" in str(study_status(folder))
    assert told == first + again - 1
    assert batched(low_alone, SAMPLES, store=folder, **options).digest == whole.digest
    assert read_study(folder).digest == whole.digest


def test_a_chunk_of_the_first_try_that_is_lost_leaves_the_second_as_it_is(tmp_path):
    folder, options = tmp_path / "study", {"retry": most, "chunk_size": 8, "progress": False}
    digest = batched(low_alone, SAMPLES, store=folder, **options).digest
    for number in (2, 8):
        before = set((folder / "chunks").iterdir())
        next(folder.glob(f"chunks/{number:07d}-*")).unlink()
        assert batched(low_alone, SAMPLES, store=folder, **options).digest == digest
        assert len(before - set((folder / "chunks").iterdir())) <= 1


def test_a_study_that_is_complete_needs_no_executor(tmp_path):
    options = {"store": tmp_path / "study", "mode": "loop", "progress": False}
    batched(len, SAMPLES, **options)
    over = ThreadPoolExecutor(1)
    over.shutdown()
    assert batched(len, SAMPLES, executor=over, **options).success.all()
