"""How large the errors of a model are beside what was measured."""

from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, ArrayLike

from fitting.residuals.frequency_response import FrequencyResponseResidual
from fitting.residuals.linear import LinearResidual
from fitting.residuals.residual import AbstractResidual, JointResidual
from fitting.residuals.robust import RobustResidual
from fitting.residuals.selected import SelectedResidual
from fitting.residuals.set_leaves import WithLeaves
from fitting.residuals.trajectory import TrajectoryResidual
from fitting.residuals.weighted import Weighted
from twin.paths import get_part


def relative_error(measured: ArrayLike, error: ArrayLike) -> float:
    """‖error‖/‖measured - mean‖: 1 for a model that knows the mean and nothing else; NaN for a constant measurement.

    Args:
        measured: samples (samples,).
        error: measured minus simulated (samples,), in the same unit.
    """
    values = np.asarray(measured)
    moving = float(np.linalg.norm(values - values.mean()))
    return float(np.linalg.norm(np.asarray(error))) / moving if moving > 0 else float("nan")


def relative_errors(evidence: AbstractResidual, model: Any) -> dict[str, float]:
    """Relative error of a model by channel or response; samples of infinite deviation do not count.

    Args:
        evidence: evidence; what is neither a record nor a frequency response is left out.
        model: the model.

    Returns:
        Relative errors [-]: of a record's channel as `relative_error`, of a frequency response ‖G - Ĝ‖/‖Ĝ‖.
    """
    if isinstance(evidence, JointResidual):
        found = {}
        for i, part in enumerate(evidence.parts):
            label = evidence.names[i] if evidence.names else str(i + 1)
            found |= {f"{label}: {name}": value for name, value in relative_errors(part, model).items()}
        return found
    if isinstance(evidence, SelectedResidual):
        inner = relative_errors(evidence.part, get_part(model, evidence.key))
        return {f"{evidence.key}: {name}": value for name, value in inner.items()}
    if isinstance(evidence, WithLeaves):
        return relative_errors(evidence.part, evidence.seen(model))
    if isinstance(evidence, RobustResidual):
        return relative_errors(evidence.part, model)
    if isinstance(evidence, Weighted):
        return relative_errors(evidence.residual, model) if np.isfinite(float(evidence.deviation)) else {}
    if isinstance(evidence, TrajectoryResidual):
        return _of_record(evidence, model)
    if isinstance(evidence, LinearResidual):
        return {evidence.name: relative_error(np.asarray(evidence.target), np.asarray(_values(evidence, model)))}
    return _of_response(evidence, model) if isinstance(evidence, FrequencyResponseResidual) else {}


def _of_record(evidence: TrajectoryResidual, model: Any) -> dict[str, float]:
    rows = np.asarray(_values(evidence, model)).reshape(len(evidence.channels), -1)
    found = {}
    for name, row, measured, sd in zip(evidence.channels, rows, evidence.measured, evidence.deviation, strict=True):
        size = np.broadcast_to(np.asarray(sd), row.shape)
        counts = np.isfinite(size)
        found[name] = relative_error(np.asarray(measured)[counts], row[counts] * size[counts])
    return found


def _of_response(evidence: FrequencyResponseResidual, model: Any) -> dict[str, float]:
    measured = evidence.measured
    real, imaginary = np.asarray(_values(evidence, model)).reshape(2, *measured.values.shape)
    values, deviation = np.asarray(measured.values), np.sqrt(np.asarray(measured.variance) / 2)
    error = (real + 1j * imaginary) * deviation
    if evidence.kind == "log":
        error = values * (np.exp(error / np.abs(values)) - 1)
    found = {}
    for i, output in enumerate(measured.outputs):
        for j, excitation in enumerate(measured.inputs):
            size = float(np.linalg.norm(values[i, j]))
            found[f"{output} / {excitation}"] = float(np.linalg.norm(error[i, j])) / size
    return found


@eqx.filter_jit
def _values(evidence: AbstractResidual, model: Any) -> Array:
    return evidence(model)
