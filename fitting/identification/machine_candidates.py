"""Further measurements of a machine, as the evidence to expect of them: at other positions, more modes, repeats.

What is expected are the modes of the identified machine itself, with the standard deviations of the measurement that
there is. Each is a residual like any other, on top of the evidence of the identification.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import equinox as eqx
import numpy as np
from jaxtyping import Array

from fitting.identification.machine import MachineIdentification
from fitting.identification.machine_measurement import measured_modes
from fitting.residuals.modes import KINDS, ModesResidual
from twin._checks import InputError
from twin.modal import reference_modes
from twin.structure import Machine

_NAMES = {"frequency": "frequencies", "shape": "shapes", "damping": "damping ratios"}
_COUNTS = {2: "twice", 3: "three times", 4: "four times", 5: "five times"}


def modes_at(identification: MachineIdentification, position: float, *, count: int | None = None) -> ModesResidual:
    """The modes at a further axis position.

    Args:
        identification: what is known so far.
        position: axis position [m].
        count: number of modes; as many as at the positions measured if not given.

    Returns:
        The evidence to expect.

    Raises:
        InputError: a position off a rail or not finite, more modes than the machine has, none.
    """
    if not np.isfinite(position):
        raise InputError(f"position must be a place on the rail in m, but is {position}.")
    evidence = identification.evidence
    number = evidence.frequency.shape[1] if count is None else count
    if number < 1:
        raise InputError(f"count must be at least 1, but is {number}.")
    found = measured_modes(identification.machine, [position], count=number, outputs=evidence.outputs)
    return _like(evidence, ModesResidual.of(found, [position], kinds=evidence.kinds))


def more_modes(identification: MachineIdentification, count: int) -> ModesResidual:
    """Further modes at the positions measured: those of the machine's first that have no measured mode of theirs.

    Args:
        identification: what is known so far.
        count: number of the machine's modes that are then measured at each position, from the lowest.

    Returns:
        The evidence to expect of the further ones.

    Raises:
        InputError: no mode among them that is not measured, or more than the machine has.
    """
    evidence = identification.evidence
    positions = [float(position) for position in evidence.position]
    found = measured_modes(identification.machine, positions, count=count, outputs=evidence.outputs)
    missing = [tuple(sorted(set(range(count)) - taken)) for taken in _measured(identification)]
    if not any(missing):
        raise InputError(f"The first {count} modes are all measured at each position. Ask for a count above {count}.")
    further = [reference_modes(modes, indices=indices) for modes, indices in zip(found, missing, strict=True)]
    return _like(evidence, ModesResidual.of(further, positions, kinds=evidence.kinds))


def repeated(
    identification: MachineIdentification, times: float | int, *, kinds: Sequence[str] | None = None
) -> ModesResidual:
    """The same measurement again, so that there are several in all, with errors of their own.

    n times as many are √n times as precise; any number above one may therefore be asked for, to stand for another
    precision.

    Args:
        identification: what is known so far.
        times: number of measurements in all, the first included.
        kinds: which of frequency, shape and damping are measured again; all that count if not given.

    Returns:
        The evidence that the further ones add.

    Raises:
        InputError: not more than one measurement, a kind that does not count in the evidence, none.
    """
    evidence = identification.evidence
    if not (np.isfinite(times) and times > 1):
        raise InputError(f"times must be above 1, the measurement that there is, but is {times}.")
    again = evidence.kinds if kinds is None else tuple(kinds)
    for kind in again:
        if kind not in evidence.kinds:
            raise InputError(f"kinds names {kind!r}; the evidence counts {', '.join(evidence.kinds)}.")
    if not again:
        raise InputError(f"kinds is empty. Name at least one of {', '.join(evidence.kinds)}.")
    # Infinite deviations leave the other kinds out, and one compiled program serves for all.
    shares = {kind: 1 / np.sqrt(times - 1) if kind in again else np.inf for kind in KINDS}
    return _like(evidence, evidence, shares)


def usual_candidates(identification: MachineIdentification) -> dict[str, ModesResidual]:
    """Measurements that are always possible: each kind of evidence five times, and half as many modes again.

    Args:
        identification: what is known so far.

    Returns:
        Evidence to expect, by a name that says what to do.
    """
    evidence = identification.evidence
    found = {repeat_name(5, (kind,)): repeated(identification, 5, kinds=(kind,)) for kind in evidence.kinds}
    own = identification.machine.second_order(float(evidence.position[0]), inputs=(), outputs=evidence.outputs)
    present = max(evidence.frequency.shape[1], 1 + max(max(taken, default=-1) for taken in _measured(identification)))
    count = min(present + (present + 1) // 2, own.mass.shape[0])
    if count > present:
        found[f"{count} modes at each position"] = more_modes(identification, count)
    return found


def repeat_name(times: int, kinds: Sequence[str]) -> str:
    """What a repeated measurement is called: "damping ratios measured five times".

    Args:
        times: number of measurements in all.
        kinds: which of frequency, shape and damping.
    """
    return f"{' and '.join(_NAMES[kind] for kind in kinds)} measured {_COUNTS.get(times, f'{times} times')}"


def _measured(identification: MachineIdentification) -> list[set[int]]:
    """Which modes of the machine are measured and count at each position."""
    evidence = identification.evidence
    order = np.asarray(_order(evidence, identification.machine))
    counts = np.asarray(evidence.weight) > 0
    return [set(row[kept].tolist()) for row, kept in zip(order, counts, strict=True)]


@eqx.filter_jit
def _order(evidence: ModesResidual, machine: Machine) -> Array:
    return evidence.pairs(machine).order


def _like(
    evidence: ModesResidual, other: ModesResidual, shares: Mapping[str, float] = MappingProxyType({})
) -> ModesResidual:
    """Other evidence with the standard deviations of the evidence that there is, times a factor for each kind."""
    return dataclasses.replace(
        other,
        frequency_deviation=evidence.frequency_deviation * shares.get("frequency", 1.0),
        shape_deviation=evidence.shape_deviation * shares.get("shape", 1.0),
        damping_deviation=evidence.damping_deviation * shares.get("damping", 1.0),
    )
