"""Small problems of NumPy's linear algebra, shared out whole among threads."""

import contextlib
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from threadpoolctl import threadpool_limits

from twin._cores import usable_cores

Task = TypeVar("Task")
Result = TypeVar("Result")


def shared_out(function: Callable[[Task], Result], tasks: Iterable[Task], threads: int | None = None) -> list[Result]:
    """Results of a function for many tasks, in their order, several at a time.

    Args:
        function: what is done; most of its time must be spent in NumPy.
        tasks: its arguments.
        threads: tasks done side by side; the number of cores if not given.
    """
    with threads_for_small_matrices(threads) as pool:
        return list(pool.map(function, tasks))


@contextlib.contextmanager
def threads_for_small_matrices(threads: int | None = None) -> Iterator[ThreadPoolExecutor]:
    """Threads beside which NumPy's linear algebra uses no more of its own, in the whole process.

    Its libraries split even a small eigenproblem among all cores, and where these are busy the threads wait for each
    other. Seen were 18 ms instead of 0.4 ms for 62 unknowns.

    Args:
        threads: how many; the number of cores if not given.
    """
    with threadpool_limits(1, user_api="blas"), ThreadPoolExecutor(threads or len(usable_cores())) as pool:
        yield pool
