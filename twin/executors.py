"""Executors for batches: worker processes of this machine. Those of clusters come from dask.distributed or mpi4py."""

import multiprocessing
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from twin._checks import InputError
from twin._cores import usable_cores
from twin._loop_option import make_small_loops_one_function


def local_processes(workers: int | None = None) -> ProcessPoolExecutor:
    """Worker processes, started anew, each held on a core of its own.

    In a script, make them below `if __name__ == "__main__":`, as every worker reads the script. Cores are given from
    the first one on: two pools that run at a time share them.

    Args:
        workers: number of processes; that of the cores if not given.

    Returns:
        The pool; use it in a `with` statement, or shut it down.

    Raises:
        InputError: fewer than one; called by a worker that reads the script.
    """
    if multiprocessing.parent_process() is not None:
        raise InputError(
            "Workers are made while a worker reads the script. Put what makes them, and what uses them, below "
            'if __name__ == "__main__":.'
        )
    cores = usable_cores()
    count = len(cores) if workers is None else workers
    if count < 1:
        raise InputError(f"workers must be a whole number of at least 1, but is {count}.")
    context = multiprocessing.get_context("spawn")
    turn = context.Queue()
    for number in range(count):
        turn.put(cores[number % len(cores)])
    return ProcessPoolExecutor(count, mp_context=context, initializer=_begin, initargs=(turn,))


def _begin(turn: Any) -> None:
    """Hold the process on one core before JAX counts them for its threads, and compile as the command line does."""
    # Ctrl-C is for the parent, which keeps what is done; the terminal sends it to all.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    core = turn.get()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {core})
    make_small_loops_one_function()


def _end_with_parent() -> None:
    """A worker whose parent was killed would wait for work for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
