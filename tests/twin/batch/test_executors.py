"""Any executor gives the results of this process; one that dies leaves what was done."""

import json
import os
import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import batch_functions as functions
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from twin import _batch_worker
from twin._batch_worker import compute_remotely, packed_job
from twin._checks import InputError
from twin.batch import StudyInterrupted, batched
from twin.executors import local_processes
from twin.study import study_status

HERE = Path(__file__).parent
RNG = np.random.default_rng(8)
NUMBERS = RNG.random(120)


def quiet(fn, samples, **options):
    return batched(fn, samples, progress=False, **options)


@pytest.fixture(scope="module")
def workers():
    with local_processes(2) as pool:
        yield pool


@pytest.mark.slow
@pytest.mark.parametrize(("adaptive", "rtol"), [(False, 1e-12), (True, 1e-5)])
def test_workers_give_what_this_process_gives(workers, adaptive, rtol):
    samples = {"mass": RNG.uniform(20.0, 200.0, 40), "viscous": RNG.uniform(20.0, 2000.0, 40)}
    move = functions.move(adaptive)
    here = quiet(move, samples, chunk_size=8)
    with ThreadPoolExecutor(2) as threads:
        for executor in (workers, threads):
            found = quiet(move, samples, chunk_size=8, executor=executor)
            assert found.success.all()
            for name in ("position", "highest"):
                np.testing.assert_allclose(found[name], here[name], rtol=rtol, atol=rtol * np.abs(here[name]).max())


@pytest.mark.slow
def test_workers_mark_what_fails_and_take_closures(workers):
    samples = RNG.random((20, 3)) * 0.9
    samples[3, 1], samples[11, 0] = np.nan, 0.9995
    here = quiet(functions.refuses_high, samples, chunk_size=8)
    there = quiet(functions.refuses_high, samples, chunk_size=8, executor=workers)
    assert there.messages == here.messages == {11: "EquinoxRuntimeError: too high"}
    assert there.digest == here.digest
    factor = 3.0
    there = quiet(lambda x: factor * x[0], samples, executor=workers)
    np.testing.assert_array_equal(there.value[4:], factor * samples[4:, 0])


@pytest.mark.slow
def test_workers_of_other_versions_are_refused(workers, monkeypatch):
    monkeypatch.setattr(_batch_worker, "versions", lambda: {"jax": "0.0.1"})
    with pytest.raises(InputError, match=r"A worker has jax \d.*, but the study 0\.0\.1\. Start the workers"):
        quiet(functions.quadratic, RNG.random((20, 3)), executor=workers)


@pytest.mark.slow
def test_an_error_that_cannot_be_read_leaves_the_workers_alive(workers):
    for _ in range(2):
        with pytest.raises(InputError, match=r"None of the first 20.*AwkwardError: wrong units"):
            quiet(functions.awkward, RNG.random((20, 3)), mode="chunk", executor=workers)


@pytest.mark.slow
def test_a_dead_worker_leaves_what_was_done(tmp_path, monkeypatch):
    monkeypatch.setenv("DIED_BEFORE", str(tmp_path / "died"))
    numbers = np.linspace(0.0, 1.0, 80)
    options = {"mode": "loop", "chunk_size": 2}
    with local_processes(2) as pool, pytest.raises(StudyInterrupted) as told:
        quiet(functions.dies_once, numbers, store=tmp_path / "study", executor=pool, **options)
    kept = study_status(tmp_path / "study").chunks[0]
    assert "The executor died (BrokenProcessPool: " in str(told.value)
    assert f"{kept} chunks are kept in {tmp_path / 'study'}; the same call goes on from there. Give it a new" in str(
        told.value
    )
    assert 1 <= kept < 40
    with local_processes(1) as pool:
        found = quiet(functions.dies_once, numbers, store=tmp_path / "study", executor=pool, **options)
    np.testing.assert_array_equal(found.value, numbers)


def test_an_executor_that_was_shut_down_is_named():
    pool = ThreadPoolExecutor(1)
    pool.shutdown()
    with pytest.raises(StudyInterrupted, match=r"The executor died .*shutdown.* Nothing of the study is kept"):
        quiet(functions.quadratic, RNG.random((20, 3)), executor=pool)


def test_a_function_that_the_worker_cannot_read_is_named():
    with pytest.raises(InputError, match="cannot be sent to workers"):
        packed_job(threading.Lock(), "loop")
    found = compute_remotely(b"no function", np.ones((1, 3)), np.ones(1, bool), 1)
    assert isinstance(found.error, InputError)
    assert "A worker cannot read the function" in str(found.error)


class Law(eqx.Module):
    slope: Array

    def __call__(self, x):
        return self.slope * x


def test_a_class_that_workers_cannot_make_again_is_named():
    class Local(eqx.Module):
        law: Law

        def __call__(self, x):
            return self.law(x)

    law = Law(jnp.ones(()))
    assert packed_job(law, "vmap")
    for fn in (Local(law), jax.tree_util.Partial(jnp.multiply, {"a": (Local(law),)}), Local(law).__call__):
        with pytest.raises(InputError, match="class Local cannot be sent to workers"):
            packed_job(fn, "vmap")

    def closed(x):
        return closed if x is None else local(x)

    local = law
    assert packed_job(closed, "vmap")
    local = Local(law)
    with pytest.raises(InputError, match="Put it in a file"):
        packed_job(closed, "vmap")


def test_threads_of_the_caller_run_lapack_one_at_a_time():
    at_work, most, submitted = 0, 0, threading.Lock()

    class Counting(ThreadPoolExecutor):
        def submit(self, work, /, *arguments):
            nonlocal at_work, most
            with submitted:
                at_work += 1
                most = max(most, at_work)
            future = super().submit(work, *arguments)
            future.add_done_callback(done)
            return future

    def done(_):
        nonlocal at_work
        with submitted:
            at_work -= 1

    with Counting(4) as pool:
        found = quiet(lambda x: jnp.linalg.eigh(jnp.outer(x, x))[0], RNG.random((40, 3)), chunk_size=4, executor=pool)
    assert found.success.all()
    assert most == 1


def test_workers_must_be_at_least_one():
    with pytest.raises(InputError, match="workers must be"):
        local_processes(0)


@pytest.mark.slow
def test_workers_end_with_their_parent(tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(
        "import os, time\nfrom twin.executors import local_processes\n"
        "if __name__ == '__main__':\n"
        "    pool = local_processes(2)\n"
        "    futures = [pool.submit(os.getpid) for _ in range(20)]\n"
        "    print(*{future.result() for future in futures}, flush=True)\n"
        "    time.sleep(600)\n"
    )
    with functions.started(script) as process:
        pids = [int(pid) for pid in process.stdout.readline().split()]
        assert pids
        process.kill()
        process.wait()
    functions.wait_until(lambda: not any(_runs(pid) for pid in pids))


def _runs(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{pid}/stat")
    return not (state.exists() and state.read_text().rsplit(")", 1)[1].split()[0] == "Z")


@pytest.mark.slow
def test_dask_loses_a_worker_and_nothing_else(tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(HERE), str(HERE.parents[1]), str(HERE.parents[2])]))
    folder = tmp_path / "study"
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, local_directory=str(tmp_path)
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        victim = next(iter(client.run(os.getpid).values()))

        def kill():
            functions.wait_until(lambda: len(list(folder.glob("chunks/*.npz"))) >= 5)
            os.kill(victim, signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        found = quiet(
            functions.slow_square, NUMBERS, store=folder, mode="loop", chunk_size=4, executor=client.get_executor()
        )
        killer.join()
        assert victim not in client.run(os.getpid).values()
    assert found.success.all()
    files = [file.name for file in folder.glob("chunks/*.npz")]
    assert len(files) == len({name[:7] for name in files}) == 30
    assert found.digest == quiet(functions.slow_square, NUMBERS, mode="loop", chunk_size=4).digest


@pytest.mark.slow
def test_two_devices_take_a_stream_each():
    flags = f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count=2"
    with functions.started(HERE / "two_devices.py", XLA_FLAGS=flags) as process:
        printed, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    found = json.loads(printed)
    assert len(found["devices"]) == 2
    assert found["error"] < 1e-13
