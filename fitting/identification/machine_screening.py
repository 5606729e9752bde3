"""What a Sobol study of a machine's modes can do without: bounds on all total effects from a few exact derivatives.

Measured on the reference machine, 20 modes at z2 to z4, against the Sobol study with 1024 base points: 256 samples take
3 % of its time, and clear 628 of the 660 pairs of a mode and a stiffness whose total effect on MACXP is below 1 %, and
none that is above with all of its interval. No parameter is cleared of every mode, so that there is none to leave
out of the whole study.
"""

import dataclasses
from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from fitting.identification.machine_affine import AffineMachine, affine_machine
from fitting.identification.machine_evidence import Evidence, evidence
from fitting.identification.machine_pairing import in_chunks, paired_samples
from fitting.identification.machine_sensitivity import DAMPING, SHAPE, output_names, require_modes
from fitting.identification.machine_slopes import mode_slopes
from fitting.identification.machine_unknowns import STIFFNESS, unknowns
from sensitivity import DerivativeMeasures, derivative_samples, measures_from_derivatives
from sensitivity.partition import require_threshold
from twin.modal.reference import ReferenceModes
from twin.parameters import ParameterSpace
from twin.structure import Machine


@dataclasses.dataclass(frozen=True)
class MachineScreening:
    """Upper bounds on the total effects of all unknown parameters on all modes of a machine."""

    measures: DerivativeMeasures
    """Measures and bounds; outputs named and ordered as those of `MachineSensitivity`."""
    threshold: float
    """Total effect that matters [-]."""
    unpaired: np.ndarray
    """Share of the samples in which a reference mode has no pair (modes of all positions,). Where it is not zero, NDD²
    jumps from one mode's damping to another's."""
    problems: tuple[str, ...]
    """Names of the reference modes of all positions, without the kind of output."""

    @property
    def kept(self) -> tuple[str, ...]:
        """Paths of the parameters that may matter for some mode; `machine_sensitivity` takes them as `only`."""
        kept = np.any(self.matters(SHAPE) | self.matters(DAMPING), axis=0)
        return tuple(path for path, keep in zip(self.measures.names, kept, strict=True) if keep)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Paths of those that matter for none, neither for MACXP nor for NDD²."""
        return tuple(path for path in self.measures.names if path not in self.kept)

    def bound(self, kind: str) -> Float[np.ndarray, "problems parameters"]:
        """Upper ends of the intervals of the bounds on the total effects on MACXP or NDD².

        Args:
            kind: "MACXP" or "NDD²".
        """
        rows = [self.measures.index(name) for name in output_names(self.problems, (kind,))]
        return (self.measures.bound + self.measures.bound_conf)[rows]

    def matters(self, kind: str = SHAPE) -> Bool[np.ndarray, "problems parameters"]:
        """Which parameters may matter for which reference mode; all others are cleared.

        No stiffness is cleared of NDD² of a mode that some sample left without a pair: its bound says nothing. MACXP
        stays, as where one mode takes the place of another both are equally like the reference; so do dampers, which
        change no pairs.

        Args:
            kind: "MACXP" or "NDD²".
        """
        above = self.bound(kind) >= self.threshold
        if kind == DAMPING:
            above |= (self.unpaired > 0)[:, None] & (unknowns(self.measures.space).kind == STIFFNESS)
        return above


def screen_machine(
    machine: Machine,
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    space: ParameterSpace,
    *,
    seed: int,
    n: int = 256,
    threshold: float = 0.01,
    least_macxp: float = 0.3,
    confidence: float = 0.95,
    resamples: int = 100,
    threads: int | None = None,
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> MachineScreening:
    """Bound the total effect of every unknown parameter on MACXP and NDD² of every reference mode.

    From mean squared derivatives, exact at each sample, and the outputs' variance: S_Ti ≤ ν_i·(b - a)²/(π²·V), see
    `derivative_measures`. One eigenproblem for each sample and position gives all of them.

    The bound holds where the pairing does not jump: a reference mode that finds its mode in another one from one sample
    to the next has a step in NDD² that no derivative sees, see `MachineScreening.matters`. Where two modes come near
    each other, derivatives are large in a few samples, and the bound is far above the effect, or, if no sample fell
    there, too low: take more samples rather than fewer, most of the time goes into other things.

    Args:
        machine: machine; its values of the unknown parameters play no part.
        references: reference modes, one set for each position.
        positions: axis positions [m].
        space: unknown stiffnesses and dampings of joints, with bounds.
        seed: seed of samples and intervals, from 1.
        n: samples, a power of two.
        threshold: total effect that matters [-]; 1 % in the paper.
        least_macxp: least MACXP of a pair [-], the `threshold` of `machine_sensitivity`.
        confidence: probability that the intervals are made for.
        resamples: bootstrap samples that the intervals come from.
        threads: positions and samples solved side by side; the number of cores if not given.
        store: folder that keeps what was solved, so that a study that was killed goes on.
        executor: where it is solved, see `twin.batch.batched`; None for threads of this process.
        progress: show a bar.

    Returns:
        The bounds, and what is left to study.

    Raises:
        InputError: 64-bit mode off, a parameter that is no stiffness or damping of a joint, bounds missing, reference
            data that cannot be compared, fewer modes than reference modes, a position off the rail, a threshold outside
            0 to 1.
    """
    require_threshold(threshold)
    data = evidence(references, positions)
    parts = [affine_machine(machine, space, one.position, one.outputs) for one in data]
    require_modes(parts, data)
    samples = derivative_samples(space, n, seed=seed)
    places = [(part, one, least_macxp) for part, one in zip(parts, data, strict=True)]
    done = in_chunks(
        _differentiated, places, samples, threads=threads, store=store, executor=executor, progress=progress
    )
    macxp, ndd, d_macxp, d_ndd, paired = (np.concatenate(arrays, axis=1) for arrays in zip(*done, strict=True))
    problems = tuple(label for one in data for label in one.labels)
    measures = measures_from_derivatives(
        space,
        samples,
        np.concatenate([macxp, ndd], axis=1),
        np.concatenate([d_macxp, d_ndd], axis=1),
        seed=seed,
        outputs=output_names(problems),
        confidence=confidence,
        resamples=resamples,
    )
    return MachineScreening(measures, threshold, 1 - paired.mean(axis=0), problems)


def _differentiated(place: tuple[AffineMachine, Evidence, float], samples: np.ndarray) -> tuple[np.ndarray, ...]:
    """`ModeSlopes` of some samples, and whether each reference mode is paired."""
    part, one, threshold = place
    found = paired_samples(part, one, samples[:, part.stiffness], threshold)
    return *mode_slopes(part, one, found, samples[:, part.damping]), found.paired
