"""From the data sets of a study to the evidence that a fit takes."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from fitting.residuals.frequency_response import FrequencyResponseResidual
from fitting.residuals.losses import HuberLoss
from fitting.residuals.residual import AbstractResidual, JointResidual
from fitting.residuals.robust import RobustResidual
from fitting.residuals.set_leaves import WithLeaves
from fitting.residuals.trajectory import TrajectoryResidual
from fitting.study.data import RecordData, data_names, read_record
from fitting.study.responses import ResponseData, read_response
from fitting.study.study_file import StudyFile
from twin._checks import InputError
from twin.control import SampledLoop
from twin.paths import set_leaves
from twin.simulation import check_ticks, choose_substeps, simulate
from twin.stepping import AbstractStepping
from twin.trajectory import SimulationStatus, Trajectory


@dataclasses.dataclass(frozen=True)
class StudyData:
    """All data of a study."""

    records: tuple[RecordData, ...]
    """Records over time."""
    responses: tuple[ResponseData, ...]
    """Frequency responses."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was assumed or changed on the way."""
        return tuple(remark for one in (*self.records, *self.responses) for remark in one.remarks)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was probably not meant so."""
        return tuple(warning for one in self.records for warning in one.warnings)

    def only(self, names: Sequence[str]) -> "StudyData":
        """The data sets of some names.

        Args:
            names: names of data sets.
        """
        return StudyData(
            tuple(one for one in self.records if one.name in names),
            tuple(one for one in self.responses if one.name in names),
        )


def read_data(study: StudyFile) -> StudyData:
    """Read all data of a study, each checked against the model.

    Args:
        study: the study.

    Raises:
        InputError: no data, data that do not belong to the model, or what `read_record` and `read_response` refuse.
    """
    records = tuple(read_record(study, name) for name in data_names(study, "record"))
    responses = tuple(read_response(study, name) for name in data_names(study, "frf"))
    if not records and not responses:
        raise study.document.error(("data",), "there are no data. Add a table [data.NAME] with a file and channels.")
    for one in records:
        if one.reference is None:
            raise study.document.error(
                ("data", one.name),
                "does not say what drove the drive. Give `reference`, a channel that a closed loop follows, or "
                '`inputs`, such as inputs = { command = "current" }.',
            )
        if isinstance(study.model, SampledLoop):
            try:
                check_ticks(one.record.times, study.model.period)
            except InputError as error:
                raise study.document.error(
                    ("data", one.name), f"{error} Give `rate`, that of the controller, to resample."
                ) from error
        for path in one.initial:
            if "free" in study.document.data and path in study.space.paths:
                raise study.document.error(("data", one.name, "initial", path), "is free as well. Remove one.")
    return StudyData(tuple(dataclasses.replace(one, stepping=stepping_of(study, one)) for one in records), responses)


def evidence_of(data: StudyData, study: StudyFile) -> AbstractResidual:
    """The residual of all data of a study.

    Args:
        data: the data.
        study: the study: stepping, and the loss that its [fit] asks for.

    Raises:
        InputError: as the residuals do.
    """
    parts, names = [], []
    for one in data.records:
        if one.reference is None or not one.deviation:
            continue
        part = TrajectoryResidual.create(one.record, one.reference, one.deviation, stepping=one.stepping)
        if one.initial:
            part = WithLeaves(part, tuple(jnp.asarray(v) for v in one.initial.values()), tuple(one.initial))
        parts.append(part)
        names.append(one.name)
    for one in data.responses:
        parts.append(FrequencyResponseResidual(one.measured, one.outputs, one.inputs, one.residual, one.respond))
        names.append(one.name)
    if study.table("fit", known=FIT_KEYS).text("loss", "squares", choices=("squares", "huber")) == "huber":
        parts = [RobustResidual(part, HuberLoss()) for part in parts]
    return parts[0] if len(parts) == 1 else JointResidual(tuple(parts), tuple(names))


# Samples along which substeps are chosen, and the most that are taken.
_TRIED, _MOST_SUBSTEPS = 20_000, 32
FIT_KEYS = ("starts", "max_steps", "correlated", "loss", "hold_back", "controls")
"""Keys of the table [fit]."""


def stepping_of(study: StudyFile, one: RecordData) -> AbstractStepping | None:
    """How time is stepped along a record: as the study says, else by constant steps from sample to sample.

    A fit needs a cost that is smooth to the last digit, which steps that change with the parameters do not give. Where
    many steps to a sample would be needed, steps are adaptive all the same.

    Args:
        study: the study.
        one: the record.
    """
    if study.stepping is not None or one.reference is None:
        return study.stepping
    started = set_leaves(study.model, dict(one.initial)) if one.initial else study.model
    part = one.record.times[: min(one.record.times.size, _TRIED)]
    try:
        return choose_substeps(started, one.reference, part, most=_MOST_SUBSTEPS)
    except InputError:
        return None


def simulate_record(model: Any, one: RecordData) -> Trajectory:
    """What a model does under what drove a record, at the times of the record.

    Args:
        model: the model.
        one: the record.
    """
    started = set_leaves(model, dict(one.initial)) if one.initial else model
    return simulated(started, one.reference, one.record.times, one.stepping)


@eqx.filter_jit
def simulated(model: Any, reference: Any, times: Any, stepping: AbstractStepping | None) -> Trajectory:
    """`simulate`, compiled once for each structure of the model.

    Args:
        model: as the system of `simulate`.
        reference: as there.
        times: as there [s].
        stepping: as there.
    """
    return simulate(model, reference, times, stepping=stepping)


def status_of(trajectory: Trajectory) -> str:
    """Why a simulation did not succeed, empty where it did.

    Args:
        trajectory: the simulation.
    """
    if trajectory.status == SimulationStatus.successful:
        return ""
    return str(SimulationStatus[trajectory.status])
