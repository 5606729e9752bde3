"""Which unknown parameters of a machine matter for which of its modes: one Sobol study of all MACXP and NDD².

Every sample's modes are solved once per position, and only where stiffnesses differ: dampers turn no shape, and what
they add to the damping ratios is linear in them.
"""

import dataclasses
import functools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from fitting.identification.machine_affine import AffineMachine, affine_machine
from fitting.identification.machine_evidence import Evidence, evidence
from fitting.shared_out import shared_out
from sensitivity import SobolIndices, SobolSamples, sobol_indices, sobol_samples
from twin._checks import InputError
from twin.correlation import assign
from twin.modal.reference import ReferenceModes
from twin.parameters import ParameterSpace
from twin.structure import Machine

SHAPE, DAMPING = "MACXP", "NDD²"
"""The two outputs of each reference mode."""
# Samples solved at once: their matrices stay in the cache.
_CHUNK = 64


@dataclasses.dataclass(frozen=True)
class MachineSensitivity:
    """Sobol indices of all modes of a machine at all positions."""

    indices: SobolIndices
    """Indices; outputs "MACXP mode 1 at -60 mm", first MACXP of all modes and positions, then NDD² of all."""
    unpaired: np.ndarray
    """Share of the samples in which a reference mode found no mode of its own, by MACXP above the threshold; the mode
    most like it then stands in (modes of all positions,)."""
    problems: tuple[str, ...]
    """Names of the reference modes of all positions, without the kind of output."""

    def total(self, kind: str) -> np.ndarray:
        """Total effects on MACXP or NDD² (modes of all positions, parameters).

        Args:
            kind: "MACXP" or "NDD²".
        """
        return self.indices.ST[[self.indices.index(f"{kind} {name}") for name in self.problems]]

    def searched(self, threshold: float = 0.01, *, interval: bool = False) -> np.ndarray:
        """Which parameters are searched for each reference mode: by their total effect on MACXP.

        Args:
            threshold: total effect above which a parameter is searched; 1 % in the paper.
            interval: search also those whose confidence interval reaches above it.

        Returns:
            Mask (modes of all positions, parameters).
        """
        half = self.indices.ST_conf[[self.indices.index(f"{SHAPE} {name}") for name in self.problems]]
        return self.total(SHAPE) + (half if interval else 0.0) > threshold


def machine_sensitivity(
    machine: Machine,
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    space: ParameterSpace,
    *,
    seed: int,
    n: int = 1024,
    threshold: float = 0.3,
    confidence: float = 0.95,
    resamples: int = 100,
    threads: int | None = None,
) -> MachineSensitivity:
    """Sobol indices of MACXP and NDD² of every reference mode at every position; section 2.3.1, eq. 10.

    Args:
        machine: machine; its values of the unknown parameters play no part.
        references: reference modes, one set for each position.
        positions: axis positions [m].
        space: unknown stiffnesses and dampings of joints, with bounds.
        seed: seed of samples and intervals, from 1.
        n: base points, a power of two; n·(parameters + 2) samples.
        threshold: least MACXP of a pair [-].
        confidence: probability that the intervals are made for.
        resamples: bootstrap samples that the intervals come from.
        threads: positions and samples solved side by side; the number of cores if not given.

    Returns:
        The study.

    Raises:
        InputError: 64-bit mode off, a parameter that is no stiffness or damping of a joint, bounds missing, reference
            data that cannot be compared, fewer modes than reference modes, a position off the rail.
    """
    data = evidence(references, positions)
    parts = [affine_machine(machine, space, one.position, one.outputs) for one in data]
    for one, part in zip(data, parts, strict=True):
        if one.omega.size > len(part.fixed):
            raise InputError(f"The machine has {len(part.fixed)} modes, fewer than {one.omega.size} reference modes.")
    samples = sobol_samples(space, n, seed=seed)
    shape, damping, unpaired = mode_outputs(parts, data, samples, threshold=threshold, threads=threads)
    problems = tuple(label for one in data for label in one.labels)
    names = [f"{kind} {name}" for kind in (SHAPE, DAMPING) for name in problems]
    outputs = np.concatenate([shape, damping], axis=1)
    indices = sobol_indices(samples, outputs, outputs=names, confidence=confidence, resamples=resamples)
    return MachineSensitivity(indices, unpaired, problems)


def mode_outputs(
    parts: Sequence[AffineMachine],
    data: Sequence[Evidence],
    samples: SobolSamples,
    *,
    threshold: float = 0.3,
    threads: int | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """MACXP and NDD² of every reference mode in every sample.

    Args:
        parts: the machine at each position.
        data: the reference modes at each position.
        samples: samples of the unknown parameters.
        threshold: least MACXP of a pair [-].
        threads: as in `machine_sensitivity`.

    Returns:
        MACXP and NDD² (samples, modes of all positions), and the share of samples in which each has no pair.
    """
    kinds = parts[0]
    paths = [samples.space.paths[i] for i in kinds.stiffness]
    distinct = samples.distinct(paths)
    stiffness = distinct.values[:, kinds.stiffness]
    dampings = samples.values[:, kinds.damping]
    starts = range(0, len(stiffness), _CHUNK)
    tasks = [
        (part, one, stiffness[i : i + _CHUNK], threshold) for part, one in zip(parts, data, strict=True) for i in starts
    ]
    done = shared_out(_solved, tasks, threads)
    shape, damping, missing = [], [], []
    for number, one in enumerate(data):
        own = done[number * len(starts) : (number + 1) * len(starts)]
        value, paired, known, factors = (np.concatenate(arrays) for arrays in zip(*own, strict=True))
        ratio = known[distinct.back] + np.einsum("smd,sd->sm", factors[distinct.back], dampings, optimize=True)
        shape.append(value[distinct.back])
        damping.append((ratio / one.ratio - 1) ** 2)  # eq. 5
        missing.append(1 - paired[distinct.back].mean(axis=0))
    return np.concatenate(shape, axis=1), np.concatenate(damping, axis=1), np.concatenate(missing)


def _solved(task: tuple[AffineMachine, Evidence, np.ndarray, float]) -> tuple[np.ndarray, ...]:
    """MACXP, whether paired, known damping and damping factors of the mode of each reference mode, for some samples."""
    part, one, stiffness, threshold = task
    values, shapes = np.linalg.eigh(part.stiffness_matrices(stiffness))
    alike = one.alike(values, shapes, part.output_map)
    order, paired = _paired(alike, threshold)
    # Where a reference mode has no pair, the study needs a number all the same: that of the mode most like it.
    order = np.where(paired, order, alike.argmax(axis=1))
    value = np.take_along_axis(alike, order[:, None], axis=1)[:, 0]
    own = np.take_along_axis(shapes, order[:, None], axis=2)
    omega = np.sqrt(np.maximum(np.take_along_axis(values, order, axis=1), 1e-12 * np.abs(values[:, -1:])))
    return value, paired, *part.damping_ratios(omega, own)


def _paired(alike: Float[np.ndarray, "samples n references"], threshold: float) -> tuple[np.ndarray, np.ndarray]:
    # A thread does not inherit what its starter set for a while.
    with jax.enable_x64(True):
        full = np.zeros((_CHUNK, *alike.shape[1:]))
        full[: len(alike)] = alike
        order, paired = _assigned(jnp.asarray(full), float(threshold))
        return np.asarray(order)[: len(alike)], np.asarray(paired)[: len(alike)]


@functools.partial(jax.jit, static_argnums=1)
def _assigned(alike: jax.Array, threshold: float) -> tuple[jax.Array, jax.Array]:
    pairs = jax.vmap(lambda one: assign(one, threshold=threshold))(alike)
    return pairs.order, pairs.paired
