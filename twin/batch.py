"""One function at many samples: what-if sweeps, sensitivity studies and many starts, fast, resumable, on any executor.

Every study runs here: chunks of one shape, compiled once, several at a time; results, status and wall time for each
sample; kept on the disk where there is a store, so that a study that was killed goes on where it was.

A store goes on with the same study alone. It is told by the function (its code, what it is closed over, the globals and
the functions that it uses, the arrays of a module; comments do not count), the samples, their order, the seed, and the
versions of what computes; what was changed is named. One process computes a store at a time; any may read it.

Executors:
    threads of this process, one for each core or accelerator: nothing to give.
    worker processes: `with local_processes() as pool: batched(..., executor=pool)`, from `twin.executors`.
    dask: `batched(..., executor=client.get_executor())`; workers that are lost are replaced by dask.
    MPI: `mpiexec -n 9 python -m mpi4py.futures script.py`, which calls `batched(..., executor=MPIPoolExecutor())` below
    `if __name__ == "__main__":`; one process hands out the chunks, eight compute.

Workers must have the same versions, and be able to import the module that the function is in.
"""

import contextlib
import sys
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jaxtyping import ArrayLike, Float

from twin._batch_facts import facts_of
from twin._batch_keep import AbstractKept, InMemory, OnDisk, StoreFailed
from twin._batch_kernel import MODES, VMAP, Computed, of_one
from twin._batch_plan import (
    Plan,
    Traits,
    as_samples,
    automatic_width,
    ordered,
    rows_of,
    second_width,
    streams,
    traits,
    whole_rows,
)
from twin._batch_run import ExecutorDied, local_threads, run_chunks, window_of
from twin._batch_worker import compute_here, compute_remotely, packed_job
from twin._checks import InputError, require_x64
from twin.batch_result import NOT_FINITE, BatchResult, statuses, was_computed
from twin.store import StoredChunk

_HOPELESS = 20
"""Samples that raised, while none was computed, after which a batch is given up."""


class StudyInterrupted(RuntimeError):
    """A study that could not go on; the message says what is kept and how to go on."""


def batched(
    fn: Callable[..., Any],
    samples: Any,
    *,
    chunk_size: int | str = "auto",
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool = True,
    difficulty: Float[ArrayLike, "samples"] | None = None,
    seed: int | None = None,
    mode: str = VMAP,
    retry: Callable[..., Any] | None = None,
) -> BatchResult:
    """Compute a function at many samples.

    Neither chunk size nor order nor executor changes a result: with constant steps to 1e-12, with adaptive ones within
    their tolerance, as their steps depend a little on what is computed beside. The same call on the same kind of
    machine gives the same bits. A sample that fails is marked, and leaves the others as they are.

    Args:
        fn: JAX function of one sample that returns a number, an array, or several by name (dict, NamedTuple, module).
            It may be a module, or a `functools.partial` of one; then its arrays can change without compiling anew.
        samples: array with one row for each sample, any structure of such arrays, or a table of columns. `fn` gets one
            row of it, in the same structure. A sample that holds NaN is marked and not computed; infinity passes.
        chunk_size: samples computed at once. "auto": 256 on a processor, less for short studies and large arrays, more
            where no sample can take longer than another and on accelerators. The last chunk is filled up.
        store: folder that keeps each chunk as it is done. Called again with the same function and samples, the study
            goes on where it was.
        executor: anything like `concurrent.futures.Executor`: `twin.executors.local_processes()`,
            `dask.distributed.Client(...).get_executor()`, `mpi4py.futures.MPIPoolExecutor()`. None: threads of this
            process, one for each core or accelerator, which take over nothing of JAX's settings for a while
            (`jax.debug_nans` and the like). Give workers of dask one thread each where `fn` calls LAPACK.
        progress: show a bar with rate and remaining time, if it takes longer than a second.
        difficulty: expected effort for each sample, in any unit: samples of like effort share a chunk, the hardest
            first, so that quick ones do not wait for slow ones.
        seed: what the samples were drawn with; kept in the store.
        mode: "vmap": `fn` is compiled for a whole chunk; "loop": `fn` is called for one sample after the other, as
            Python is, and may do anything, such as a fit; "chunk": `fn` is called with the rows of a chunk at once.
        retry: function that stands in for `fn` where an output is not finite: the same with more steps, say. Those
            samples are computed again after the others, a few at a time, so that none holds up a whole chunk for long.

    Returns:
        Outputs, status and wall time of each sample, in the order of the samples.

    Raises:
        InputError: 64-bit mode off, samples of unequal length, an unknown mode, a chunk size below one, a function that
            is none or that returns no numbers, a store that holds another study, twenty samples that all raise.
        StudyInterrupted: the executor died, or the store cannot be written, for instance as the disk is full.
        KeyboardInterrupt: after Ctrl-C, when the chunks that were done, or are so within three seconds, are stored. A
            thread that computes a longer one comes to its end before the program does.
    """
    require_x64()
    _check(fn, chunk_size, executor, mode, retry)
    samples, count = as_samples(samples)
    fn, retry = _as_tree(fn), None if retry is None else _as_tree(retry)
    order, good = ordered(difficulty, count), whole_rows(samples, count)
    known = _known(fn, jax.tree.map(lambda leaf: leaf[np.argmax(good)], samples)) if mode == VMAP else None
    asked = None if chunk_size == "auto" else int(chunk_size)
    width = min(asked, count) if asked else automatic_width(count, known)
    with contextlib.ExitStack() as stack:
        facts = partial(facts_of, fn, retry, samples, count, order, seed, mode)
        kept = _kept(store, facts, samples, count, width, asked)
        stack.callback(kept.close)
        stack.enter_context(_interruptions_explained(kept))
        plan = Plan(order, kept.width)
        run = partial(_run, samples, good, kept, executor, mode, known, progress)
        run(fn, plan, 0)
        if retry is not None and (again := np.flatnonzero(kept.status(plan.chunks) == NOT_FINITE)).size:
            run(retry, Plan(again, second_width(kept.width)), plan.chunks)
        return kept.result()


def _known(fn: Callable[..., Any], row: Any) -> Traits:
    try:
        return traits(of_one, fn, row)
    except jax.errors.ConcretizationTypeError as error:
        error.add_note(
            'The function asks for values while it is compiled: use jnp.where, or batched(..., mode="loop").'
        )
        raise


def _kept(
    store: str | Path | None, facts: Callable[[], Any], samples: Any, count: int, width: int, asked: int | None
) -> AbstractKept:
    if store is None:
        return InMemory(samples, count, width)
    with _interruptions_explained(None):
        kept = OnDisk(Path(store).expanduser(), samples, count, width, facts())
    if asked and kept.width != width:
        warnings.warn(f"The study goes on in chunks of {kept.width} samples, as it was begun.", stacklevel=4)
    return kept


def _check(fn: Any, chunk_size: Any, executor: Any, mode: str, retry: Any) -> None:
    for name, function in (("fn", fn), ("retry", fn if retry is None else retry)):
        if not callable(function):
            raise InputError(f"{name} must be a function of one sample, but is {type(function).__name__}.")
    if mode not in MODES:
        raise InputError(f"mode must be one of {', '.join(map(repr, MODES))}, but is {mode!r}.")
    if chunk_size != "auto" and (
        isinstance(chunk_size, bool) or not isinstance(chunk_size, int | np.integer) or chunk_size < 1
    ):
        raise InputError(f"chunk_size must be 'auto' or a whole number of at least 1, but is {chunk_size!r}.")
    if executor is not None and hasattr(executor, "get_executor"):
        raise InputError("executor is a client of dask; give its client.get_executor().")
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise InputError(
            f"executor must be like concurrent.futures.Executor, but {type(executor).__name__} has no submit()."
        )


def _as_tree(fn: Callable[..., Any]) -> Callable[..., Any]:
    """With the arguments of a partial function as arrays that a compiled program takes, where it would hold them."""
    return jax.tree_util.Partial(fn.func, *fn.args, **fn.keywords) if isinstance(fn, partial) else fn


def _run(
    samples: Any,
    good: np.ndarray,
    kept: AbstractKept,
    executor: Executor | None,
    mode: str,
    known: Traits | None,
    progress: bool,
    fn: Callable[..., Any],
    plan: Plan,
    offset: int,
) -> None:
    """Compute the chunks of a plan that are not there yet; they are numbered from an offset on."""
    done = kept.done(plan, offset)
    left = [chunk for chunk in range(plan.chunks) if chunk not in done]
    if not left:
        return
    doubts = _Doubts()
    with contextlib.ExitStack() as stack:
        total = len(plan.order)
        bar = stack.enter_context(_bar(total, total - sum(len(plan.members(c)) for c in left), progress))
        here = executor is None or isinstance(executor, ThreadPoolExecutor)
        work = partial(compute_here, fn, mode) if here else partial(compute_remotely, packed_job(fn, mode))
        if executor is None:
            threads = streams(known)
            executor, window = stack.enter_context(local_threads(threads)), threads + 1
        else:
            alone = here and known is not None and known.lapack
            window = 1 if alone else window_of(executor)
        start = partial(executor.submit, work)

        def submit(chunk: int) -> "Future[Any]":
            members = plan.members(chunk)
            return start(rows_of(samples, members), good[members], plan.width)

        def keep(chunk: int, done: Computed) -> None:
            members = plan.members(chunk)
            status = statuses(done.values, good[members], done.raised)
            messages = {int(members[row]): text for row, text in done.raised.items()}
            content = StoredChunk(members, status, done.seconds, done.values, messages)
            for number, ready in doubts.cleared(offset + chunk, content):
                kept.write(number, ready)
            bar.update(len(members))

        run_chunks(left, submit, keep, window=window, first_alone=here)
        for number, ready in doubts.held:
            kept.write(number, ready)


class _Doubts:
    """Holds chunks back as long as every sample raises: then the function may be wrong, and not its samples."""

    def __init__(self) -> None:
        self.held: list[tuple[int, StoredChunk]] = []
        self._some_done = False

    def cleared(self, number: int, content: StoredChunk) -> list[tuple[int, StoredChunk]]:
        """Chunks that can be kept, when another one has come.

        Raises:
            InputError: so many samples raised, and none was computed, that the batch is given up.
        """
        self.held.append((number, content))
        self._some_done |= bool(was_computed(content.status).any())
        if self._some_done:
            cleared, self.held = self.held, []
            return cleared
        messages = [text for _, chunk in self.held for text in chunk.messages.values()]
        if len(messages) >= _HOPELESS:
            raise InputError(
                f"None of the first {len(messages)} samples could be computed. The first said: {messages[0]}"
            )
        return []


def _bar(total: int, done: int, progress: bool) -> Any:
    from tqdm.auto import tqdm

    # In a file, each change of a bar is a new line.
    every = 0.1 if sys.stderr.isatty() or "ipykernel" in sys.modules else 30.0
    return tqdm(
        total=total,
        initial=done,
        unit=" samples",
        delay=1.0,
        mininterval=every,
        maxinterval=max(every, 10.0),
        smoothing=0,  # the mean rate: chunks come in bursts, as several run side by side
        disable=not progress,
    )


@contextlib.contextmanager
def _interruptions_explained(kept: AbstractKept | None) -> Iterator[None]:
    """Errors of the executor and of the disk say what is kept."""
    try:
        yield
    except (ExecutorDied, StoreFailed) as error:
        dead = isinstance(error, ExecutorDied)
        what = "The executor died" if dead else "The store cannot be read or written"
        cure = ' Give it a new executor, made in a script below if __name__ == "__main__":.' if dead else ""
        told = kept.told() if kept else "Nothing was computed."
        raise StudyInterrupted(f"{what} ({error}). {told}{cure}") from error
    except KeyboardInterrupt as error:
        error.add_note(kept.told() if kept else "Nothing was computed.")
        raise
