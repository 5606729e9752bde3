"""Which unknown parameters of a machine matter for which of its modes: one Sobol study of all MACXP and NDD².

Every sample's modes are solved once per position, and only where stiffnesses differ: dampers turn no shape, and what
they add to the damping ratios is linear in them.
"""

import dataclasses
from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from fitting.identification.machine_affine import AffineMachine, affine_machine
from fitting.identification.machine_evidence import Evidence, evidence
from fitting.identification.machine_pairing import in_chunks, paired_samples
from fitting.identification.machine_unknowns import unknowns
from sensitivity import SobolIndices, SobolSamples, sobol_indices, sobol_samples
from twin._checks import InputError
from twin.modal.reference import ReferenceModes
from twin.parameters import ParameterSpace
from twin.structure import Machine

SHAPE, DAMPING = "MACXP", "NDD²"
"""The two outputs of each reference mode."""


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
    left_out: tuple[str, ...] = ()
    """Paths of the parameters that were not studied but held in the middle of their bounds: their indices are 0."""

    def total(self, kind: str) -> np.ndarray:
        """Total effects on MACXP or NDD² (modes of all positions, parameters).

        Args:
            kind: "MACXP" or "NDD²".
        """
        return self.indices.ST[self._rows(kind)]

    def half_width(self, kind: str) -> np.ndarray:
        """Half widths of the confidence intervals of the total effects on MACXP or NDD², as of `total`.

        Args:
            kind: "MACXP" or "NDD²".
        """
        return self.indices.ST_conf[self._rows(kind)]

    def searched(self, threshold: float = 0.01, *, interval: bool = False) -> np.ndarray:
        """Which parameters are searched for each reference mode: by their total effect on MACXP.

        Args:
            threshold: total effect above which a parameter is searched; 1 % in the paper.
            interval: search also those whose confidence interval reaches above it.

        Returns:
            Mask (modes of all positions, parameters).
        """
        return self.total(SHAPE) + (self.half_width(SHAPE) if interval else 0.0) > threshold

    def _rows(self, kind: str) -> list[int]:
        return [self.indices.index(name) for name in output_names(self.problems, (kind,))]


def machine_sensitivity(
    machine: Machine,
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    space: ParameterSpace,
    *,
    seed: int,
    n: int = 1024,
    only: Sequence[str] | None = None,
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
        only: paths of the parameters that are studied, as `screen_machine(...).kept`; all if not given. The others are
            held in the middle of their bounds, have indices of 0 and are named as left out.
        threshold: least MACXP of a pair [-].
        confidence: probability that the intervals are made for.
        resamples: bootstrap samples that the intervals come from.
        threads: positions and samples solved side by side; the number of cores if not given.

    Returns:
        The study.

    Raises:
        InputError: 64-bit mode off, a parameter that is no stiffness or damping of a joint, bounds missing, reference
            data that cannot be compared, fewer modes than reference modes, a position off the rail, a path in `only`
            that is not in the space, none of a stiffness among them.
    """
    studied = (
        space if only is None else space.subset([path for path in space.paths if path in space.subset(only).paths])
    )
    if not unknowns(studied).stiffness.size:
        raise InputError("No stiffness is studied. Name at least one, as only stiffnesses move the modes.")
    middle = space.unscaled((space.lower + space.upper) / 2)
    machine = space.with_values(machine, middle)
    data = evidence(references, positions)
    parts = [affine_machine(machine, studied, one.position, one.outputs) for one in data]
    require_modes(parts, data)
    samples = sobol_samples(studied, n, seed=seed)
    shape, damping, unpaired = mode_outputs(parts, data, samples, threshold=threshold, threads=threads)
    problems = tuple(label for one in data for label in one.labels)
    outputs = np.concatenate([shape, damping], axis=1)
    indices = sobol_indices(
        samples, outputs, outputs=output_names(problems), confidence=confidence, resamples=resamples
    )
    left_out = tuple(path for path in space.paths if path not in studied.paths)
    return MachineSensitivity(_widened(indices, space), unpaired, problems, left_out)


def output_names(problems: Sequence[str], kinds: Sequence[str] = (SHAPE, DAMPING)) -> list[str]:
    """Names of the outputs of a study, kind by kind.

    Args:
        problems: names of the reference modes of all positions.
        kinds: "MACXP", "NDD²" or both.
    """
    return [f"{kind} {name}" for kind in kinds for name in problems]


def require_modes(parts: Sequence[AffineMachine], data: Sequence[Evidence]) -> None:
    """Raise unless the machine has a mode for each reference mode.

    Args:
        parts: the machine at each position.
        data: the reference modes at each position.

    Raises:
        InputError: fewer modes than reference modes.
    """
    for one, part in zip(data, parts, strict=True):
        if one.omega.size > len(part.fixed):
            raise InputError(f"The machine has {len(part.fixed)} modes, fewer than {one.omega.size} reference modes.")


def _widened(indices: SobolIndices, space: ParameterSpace) -> SobolIndices:
    """Indices of all parameters of a space from those of some: zero for the others."""
    own = [space.paths.index(path) for path in indices.space.paths]

    def wide(array: np.ndarray) -> np.ndarray:
        full = np.zeros((*array.shape[:-1], len(space)))
        full[..., own] = array
        return full

    tables = {name: wide(getattr(indices, name)) for name in ("S1_by_size", "S1_conf_by_size")}
    tables |= {name: wide(getattr(indices, name)) for name in ("ST_by_size", "ST_conf_by_size")}
    return dataclasses.replace(indices, space=space, groups=space.paths, **tables)


def mode_outputs(
    parts: Sequence[AffineMachine],
    data: Sequence[Evidence],
    samples: SobolSamples,
    *,
    threshold: float = 0.3,
    threads: int | None = None,
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool = True,
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
    places = [(part, one, threshold) for part, one in zip(parts, data, strict=True)]
    done = in_chunks(_solved, places, stiffness, threads=threads, store=store, executor=executor, progress=progress)
    shape, damping, missing = [], [], []
    for one, (value, paired, known, factors) in zip(data, done, strict=True):
        ratio = known[distinct.back] + np.einsum("smd,sd->sm", factors[distinct.back], dampings, optimize=True)
        shape.append(value[distinct.back])
        damping.append((ratio / one.ratio - 1) ** 2)  # eq. 5
        missing.append(1 - paired[distinct.back].mean(axis=0))
    return np.concatenate(shape, axis=1), np.concatenate(damping, axis=1), np.concatenate(missing)


def _solved(place: tuple[AffineMachine, Evidence, float], stiffness: np.ndarray) -> tuple[np.ndarray, ...]:
    """MACXP, whether paired, known damping and damping factors of the mode of each reference mode, for some samples."""
    part, one, threshold = place
    found = paired_samples(part, one, stiffness, threshold)
    return found.macxp, found.paired, *part.damping_ratios(found.omega, found.own)
