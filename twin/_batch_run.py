"""Running the chunks of a batch: several at a time, in threads of this process or on an executor."""

import contextlib
import queue
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from typing import Any

import jax

from twin._batch_kernel import Computed
from twin._batch_worker import Failed

_AHEAD = 32
"""Chunks given to an executor that does not say how many workers it has."""
_PATIENCE = 3.0
"""How long Ctrl-C waits for the chunks that run, so that they are not lost [s]."""

Submit = Callable[[int], "Future[Any]"]
Keep = Callable[[int, Computed], None]


class ExecutorDied(RuntimeError):
    """An executor that lost its workers, or was shut down."""


def run_chunks(chunks: Sequence[int], submit: Submit, keep: Keep, *, window: int, first_alone: bool) -> None:
    """Run chunks and hand on the results as they come, never more than a window of them at a time.

    Args:
        chunks: their numbers.
        submit: starts one.
        keep: takes the results of one; called in this thread alone.
        window: chunks that are started or wait.
        first_alone: wait for the first chunk before the others are started, as it compiles the program.

    Raises:
        ExecutorDied: the executor can do no more. What it had done is kept.
        KeyboardInterrupt: after Ctrl-C. What was done is kept, and what is done within a few seconds.
    """
    left = iter(chunks)
    pending: dict[Future[Any], int] = {}
    allowed = 1 if first_alone else window
    try:
        while True:
            while len(pending) < allowed and (chunk := next(left, None)) is not None:
                pending[_started(submit, chunk)] = chunk
            if not pending:
                return
            for future in wait(pending, return_when=FIRST_COMPLETED).done:
                keep(pending.pop(future), _result(future))
            allowed = window
    except BaseException as error:
        patience = _PATIENCE if isinstance(error, KeyboardInterrupt) else 0.0
        _collect(pending, keep, patience)
        raise


def _started(submit: Submit, chunk: int) -> "Future[Any]":
    try:
        return submit(chunk)
    except RuntimeError as error:  # a pool that is broken or shut down
        raise ExecutorDied(f"{type(error).__name__}: {error}") from error


def _result(future: "Future[Any]") -> Computed:
    try:
        found = future.result()
    # What the function itself raises comes back as a value, so this is the executor's.
    except Exception as error:
        raise ExecutorDied(f"{type(error).__name__}: {error}") from error
    if isinstance(found, Failed):
        raise found.error
    return found


def _collect(pending: "dict[Future[Any], int]", keep: Keep, patience: float) -> None:
    """Keep what is done, or soon will be; a second error must not hide the first."""
    running = [future for future in pending if not future.cancel()]
    for future in wait(running, timeout=patience).done:
        if not future.cancelled() and future.exception() is None:
            found = future.result()
            if not isinstance(found, Failed):
                with contextlib.suppress(Exception):
                    keep(pending[future], found)


def window_of(executor: Executor) -> int:
    """Chunks to hand to an executor ahead of time."""
    client = getattr(executor, "_client", None)  # of dask
    if client is not None and callable(getattr(client, "nthreads", None)):
        return 2 * max(1, sum(client.nthreads().values()))
    for name in ("_max_workers", "num_workers"):  # of the standard library, of mpi4py
        workers = getattr(executor, name, None)
        if isinstance(workers, int) and workers > 0:
            return 2 * workers
    return _AHEAD


@contextlib.contextmanager
def local_threads(count: int) -> Iterator[ThreadPoolExecutor]:
    """Threads of this process, each with a device of its own where there are several.

    When they are left early, the chunks that run come to their end beside what follows.

    Args:
        count: number of threads.
    """
    devices: queue.SimpleQueue[Any] = queue.SimpleQueue()
    for device in jax.local_devices() if jax.local_device_count() > 1 else []:
        devices.put(device)

    def begin() -> None:
        if not devices.empty():
            jax.default_device(devices.get()).__enter__()

    pool = ThreadPoolExecutor(count, initializer=begin)
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
