"""The modes of a machine at many samples of its stiffnesses, and which of them belongs to which reference mode."""

import contextlib
import dataclasses
import functools
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from fitting.identification.machine_affine import AffineMachine
from fitting.identification.machine_evidence import Evidence
from fitting.shared_out import threads_for_small_matrices
from twin._checks import InputError
from twin.batch import batched
from twin.correlation import assign

CHUNK = 64
"""Samples solved at once: their matrices stay in the cache."""


class PairedSamples(NamedTuple):
    """Modes of a machine at some samples, and those that stand for the reference modes."""

    eigenvalues: Float[np.ndarray, "samples n"]
    """All eigenvalues ω² [1/s²]."""
    shapes: Float[np.ndarray, "samples n n"]
    """All shapes of unit length, one mode per column."""
    order: Int[np.ndarray, "samples references"]
    """Number of the mode of each reference mode; of the mode most like it where it has no pair."""
    paired: Bool[np.ndarray, "samples references"]
    """Whether it has a pair."""
    macxp: Float[np.ndarray, "samples references"]
    """MACXP of the reference mode and this mode [-]."""

    @property
    def omega(self) -> Float[np.ndarray, "samples references"]:
        """Angular natural frequency of each reference mode's own mode [rad/s], kept above zero."""
        own = np.take_along_axis(self.eigenvalues, self.order, axis=1)
        return np.sqrt(np.maximum(own, 1e-12 * np.abs(self.eigenvalues[:, -1:])))

    @property
    def own(self) -> Float[np.ndarray, "samples n references"]:
        """Shape of each reference mode's own mode."""
        return np.take_along_axis(self.shapes, self.order[:, None], axis=2)


def paired_samples(
    part: AffineMachine, data: Evidence, stiffness: Float[np.ndarray, "samples stiffnesses"], threshold: float
) -> PairedSamples:
    """Solve the modes of some samples, and find the mode of each reference mode.

    Where a reference mode has no pair, a study needs a number all the same: that of the mode most like it.

    Args:
        part: the machine at a position.
        data: reference modes there.
        stiffness: unknown stiffnesses, at most `CHUNK` samples.
        threshold: least MACXP of a pair [-].
    """
    values, shapes = np.linalg.eigh(part.stiffness_matrices(stiffness))
    alike = data.alike(values, shapes, part.output_map)
    order, paired = _paired(alike, threshold)
    order = np.where(paired, order, alike.argmax(axis=1))
    macxp = np.take_along_axis(alike, order[:, None], axis=1)[:, 0]
    return PairedSamples(values, shapes, order, paired, macxp)


def in_chunks(
    function: Callable[[Any, np.ndarray], tuple[np.ndarray, ...]],
    places: Sequence[Any],
    samples: np.ndarray,
    *,
    threads: int | None = None,
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> list[tuple[np.ndarray, ...]]:
    """Results of a function for all samples at several places, by `twin.batch.batched`, `CHUNK` samples at a time.

    Args:
        function: from a place and some samples to arrays with one row for each sample.
        places: what differs from one axis position to the next.
        samples: all samples, one a row.
        threads: chunks done side by side in this process; the number of cores if not given.
        store: folder that keeps the chunks.
        executor: where they are done; None for threads of this process.
        progress: show a bar.

    Returns:
        The arrays of each place, with all samples.

    Raises:
        InputError: a sample at which the function fails.
    """
    with threads_for_small_matrices(threads) if executor is None else contextlib.nullcontext(executor) as workers:
        found = batched(
            _AtPlaces(function, tuple(places)),
            samples,
            mode="chunk",
            chunk_size=CHUNK,
            store=store,
            executor=workers,
            progress=progress,
        )
    if found.messages:
        raise InputError(f"The modes of some samples could not be computed. {found.message}")
    outputs = dict(found.outputs.items())
    each = len(outputs) // len(places)
    return [tuple(outputs[f"{k}.{i}"] for i in range(each)) for k in range(len(places))]


@dataclasses.dataclass(frozen=True)
class _AtPlaces:
    """A function at all places."""

    function: Callable[[Any, np.ndarray], tuple[np.ndarray, ...]]
    """The function."""
    places: tuple[Any, ...]
    """The places."""

    def __call__(self, samples: np.ndarray) -> dict[str, np.ndarray]:
        """Its results, named by place and number.

        Args:
            samples: one a row.
        """
        return {
            f"{k}.{i}": array
            for k, place in enumerate(self.places)
            for i, array in enumerate(self.function(place, samples))
        }


def _paired(alike: Float[np.ndarray, "samples n references"], threshold: float) -> tuple[np.ndarray, np.ndarray]:
    # A thread does not inherit what its starter set for a while.
    with jax.enable_x64(True):
        full = np.zeros((CHUNK, *alike.shape[1:]))
        full[: len(alike)] = alike
        order, paired = _assigned(jnp.asarray(full), float(threshold))
        return np.asarray(order)[: len(alike)], np.asarray(paired)[: len(alike)]


@functools.partial(jax.jit, static_argnums=1)
def _assigned(alike: jax.Array, threshold: float) -> tuple[jax.Array, jax.Array]:
    pairs = jax.vmap(lambda one: assign(one, threshold=threshold))(alike)
    return pairs.order, pairs.paired
