"""A preloaded drive from sweeps at several preloads, all at once, with controls: the laws of its meshes.

The published chain gives the start; all responses together give the fit; sweeps that were held back are predicted.
"""

import dataclasses
from collections.abc import Collection
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from fitting.controls import Control, held_back, permuted_control
from fitting.fit import fit
from fitting.identifiability import IdentifiabilityReport, identifiability
from fitting.identification.preload_chain import PreloadChain, identify_preload_chain
from fitting.identification.preload_direct import mesh_space, with_laws
from fitting.identification.preload_sweep import PreloadSweep
from fitting.multistart import MultistartResult, multistart
from fitting.residuals.frequency_response import FrequencyResponseResidual
from fitting.residuals.residual import JointResidual
from fitting.result import FitResult
from twin._checks import InputError
from twin.drives import RackPinionDrive
from twin.drives.rack_pinion_operation import table_response
from twin.frf import FRF
from twin.parameters import ParameterSpace

# How far from the start other starts are drawn, as factors.
_AWAY = 5.0


class TableResponse(NamedTuple):
    """Response of the table's velocity to that of both motors, which move alike, about given forces."""

    forces: tuple[float, float]
    """Forces through the meshes [N]."""
    velocity: float
    """Velocity of the table [m/s]."""

    def __call__(self, drive: RackPinionDrive, frequency: Float[ArrayLike, "frequencies"]) -> FRF:
        """The response V_T/V_1.

        Args:
            drive: the drive.
            frequency: frequencies [Hz].
        """
        values = jnp.sum(table_response(drive, jnp.asarray(self.forces), frequency, velocity=self.velocity), axis=0)
        return FRF(jnp.asarray(frequency), values[None, None], ("table_velocity",), ("velocity_1",))


@dataclasses.dataclass(frozen=True)
class PreloadedDrive:
    """The laws of both meshes, taken to be alike, with what they rest on."""

    result: FitResult
    """The fit; its model is the drive."""
    chain: PreloadChain
    """What the published chain makes of the fitted sweeps."""
    many: MultistartResult | None
    """All starts, where several were asked for."""
    verdicts: IdentifiabilityReport
    """What the data can tell."""
    controls: tuple[Control, ...]
    """Sweeps held back and predicted, and shuffled responses."""
    responses: dict[str, tuple[FRF, FRF]]
    """Measured and fitted response by name of the sweep."""
    held: tuple[str, ...]
    """Names of the sweeps held back."""


def identify_preloaded_drive(
    sweeps: dict[str, PreloadSweep],
    drive: RackPinionDrive,
    *,
    held: Collection[str] = (),
    band: tuple[float, float] = (30.0, 200.0),
    leave_out_up_to: float = 6.0,
    starts: int = 1,
    seed: int = 1,
) -> PreloadedDrive:
    """k(F) and d(F) of the meshes from the responses of all sweeps, after Leipe et al., section V.

    Args:
        sweeps: one record for each preload, by name.
        drive: the drive, of which mass, gear ratio, pinion diameter and the friction of the guides are used.
        held: names of sweeps that are predicted instead of fitted.
        band: frequencies that are used [Hz].
        leave_out_up_to: preloads up to this one are left out, as backlash distorts them [%].
        starts: number of starts; from 2 on, these are drawn within a factor of 5 about what the chain found.
        seed: of the starts and of the shuffling.

    Raises:
        InputError: an unknown sweep to hold back, fewer than three sweeps left, a sweep without a -90° point.
    """
    for name in held:
        if name not in sweeps:
            raise InputError(f"{name!r} is to be held back, but the sweeps are {', '.join(sweeps)}.")
    used = {name: one for name, one in sweeps.items() if one.preload_percent > leave_out_up_to}
    fitted = {name: one for name, one in used.items() if name not in held}
    if len(fitted) < 3:
        raise InputError(
            f"{len(fitted)} sweeps are left to fit; two laws of the load need three preloads above "
            f"{leave_out_up_to:g} %. Measure more, or hold back fewer."
        )
    responses = {name: one.response(band=band) for name, one in used.items()}
    chain = identify_preload_chain(
        list(fitted.values()),
        drive,
        band=band,
        leave_out_up_to=leave_out_up_to,
        responses=[responses[name] for name in fitted],
    )
    start = with_laws(drive, chain.stiffness.law, chain.damping.law)
    evidence = {name: _evidence(one, responses[name], drive) for name, one in used.items()}
    joint = JointResidual(tuple(evidence[name] for name in fitted), tuple(fitted))
    space = _space(start)
    result, many = _fitted(joint, start, space, starts, seed)
    controls: list[Any] = []
    kept = [name for name in used if name in held]
    if kept:
        controls.append(held_back(joint, JointResidual(tuple(evidence[n] for n in kept), tuple(kept)), result.model))
    controls.append(permuted_control(joint, result.model, result.space, result.model, seed=seed))
    pairs = {}
    for name, measured in responses.items():
        pairs[name] = (measured, evidence[name].respond(result.model, measured.frequency))
    return PreloadedDrive(result, chain, many, identifiability(result), tuple(controls), pairs, tuple(kept))


def _space(start: RackPinionDrive) -> ParameterSpace:
    """The laws' parameters within a factor of their start, the order of the root above 1."""
    found = []
    for parameter in mesh_space().parameters:
        path = parameter.path.removeprefix("drive.")
        tied = tuple(other.removeprefix("drive.") for other in parameter.tied)
        found.append(dataclasses.replace(parameter, path=path, tied=tied))
    values = np.asarray(ParameterSpace(found).values(start))
    return ParameterSpace(
        dataclasses.replace(p, lower=max(p.lower, float(v) / _AWAY), upper=float(v) * _AWAY)
        for p, v in zip(found, values, strict=True)
    )


def _evidence(sweep: PreloadSweep, response: FRF, drive: RackPinionDrive) -> FrequencyResponseResidual:
    forces = np.asarray(drive.motor_force(sweep.motor_torques()))
    respond = TableResponse((float(forces[0]), float(forces[1])), sweep.velocity)
    return FrequencyResponseResidual(response, kind="complex", respond=respond)


def _fitted(
    joint: JointResidual, start: RackPinionDrive, space: ParameterSpace, starts: int, seed: int
) -> tuple[FitResult, MultistartResult | None]:
    # Lines that share windows hang together: each part of each response is a series.
    series = 2 * len(joint.parts)
    if starts == 1:
        return fit(joint, start, space, correlated=series), None
    many = multistart(joint, start, space, starts=starts, seed=seed, correlated=series)
    return many.best, many
