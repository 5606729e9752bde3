"""The fit of modes to responses, with what is known of its weights, and the errors of what was eliminated."""

import dataclasses
from typing import NamedTuple

import numpy as np

from fitting.identification.modal_basis import ModalKind, modal_basis, shapes_of, solve_linear
from fitting.identification.modal_clusters import cluster_deviation, gain_scatter
from fitting.identification.modal_noise import noise_deviation
from fitting.identification.modal_poles import ModalPoles
from fitting.identification.modal_refinement import ModalProblem, factored, refined
from fitting.result import FitResult

# The noise of a response is not believed to be smaller than this share of its size.
_FLOOR = 1e-9
# Correlation of neighbouring lines' residuals from which on it counts.
_CORRELATED = 0.2


class ModalFit(NamedTuple):
    """Modes fitted to responses."""

    result: FitResult
    """Poles and participations, with their covariance."""
    shapes: np.ndarray
    """Shapes ψ at the scale of the participations, complex (outputs, modes)."""
    shape_errors: np.ndarray
    """Standard errors of their parts, complex (outputs, modes)."""
    synthesised: np.ndarray
    """Responses of the modes and residual terms (outputs, inputs, frequencies)."""
    correlation: float
    """Correlation of the residuals of neighbouring lines [-]."""
    widened: np.ndarray
    """By what the errors of each parameter are larger because whole responses err, 1 where they do not [-]."""


def fit_modes(
    frequency: np.ndarray,
    values: np.ndarray,
    poles: np.ndarray,
    participation: np.ndarray,
    deviation: np.ndarray | None,
    kind: ModalKind,
    *,
    max_steps: int = 60,
) -> ModalFit:
    """Fit poles, participations, shapes and residual terms to responses.

    Without a measured variance the noise of each response is found from what a first fit leaves (`modal_noise`): the
    same at all lines, or growing with the response where it does.

    Args:
        frequency: lines [Hz].
        values: responses (outputs, inputs, frequencies).
        poles: start λ (modes,) [rad/s].
        participation: start L (modes, inputs).
        deviation: standard deviation of each part; None if it is not known.
        kind: what the responses are.
        max_steps: evaluations of a round.
    """
    model = ModalPoles.of(poles, participation)
    rms = np.sqrt(np.mean(np.abs(values) ** 2, axis=2, keepdims=True))
    rms = np.where(rms > 0, rms, 1.0)
    if deviation is not None:
        problem = ModalProblem.of(frequency, values, deviation, kind)
        result = refined(problem, model, variance="known", max_steps=max_steps)
    else:
        first = ModalProblem.of(frequency, values, rms, kind)
        model = refined(first, model, variance="estimated", max_steps=max_steps).model
        basis = modal_basis(frequency, model.poles, model.participations, kind)
        response = np.einsum("ifk,ok->oif", basis, first.linearised(model).coefficients)
        used = np.maximum(noise_deviation(values - response, response), _FLOOR * rms)
        model = ModalPoles.of(model.poles, model.participations)  # another excitation may drive a mode most
        problem = ModalProblem.of(frequency, values, used, kind)
        result = refined(problem, model, variance="estimated", max_steps=max_steps)
    model = result.model
    coefficients = problem.linearised(model).coefficients
    result, correlation = _with_honest_errors(result, values.shape, coefficients.size)
    result, widened = _with_clusters(result, problem)
    basis = modal_basis(frequency, model.poles, model.participations, kind)
    return ModalFit(
        result,
        shapes_of(coefficients, model.poles.size),
        _shape_errors(problem, result, coefficients),
        np.einsum("ifk,ok->oif", basis, coefficients),
        correlation,
        widened,
    )


def _with_honest_errors(result: FitResult, shape: tuple, eliminated: int) -> tuple[FitResult, float]:
    """The covariance with the degrees of freedom that shapes took, and with neighbouring lines that err alike."""
    rest = result.residual.reshape(-1, shape[2])
    power = float(np.sum(rest**2))
    correlation = float(np.sum(rest[:, 1:] * rest[:, :-1])) / power if power > 0 else 0.0
    freedom = max(result.degrees_of_freedom - eliminated, 1)
    factor = result.degrees_of_freedom / freedom if result.variance == "estimated" else max(1.0, power / freedom)
    if correlation > max(_CORRELATED, 3 / np.sqrt(rest.size)):
        factor *= (1 + correlation) / (1 - correlation)
    covariance = factor * result.scaled_covariance
    return dataclasses.replace(result, scaled_covariance=covariance, degrees_of_freedom=freedom), correlation


def _with_clusters(result: FitResult, problem: ModalProblem) -> tuple[FitResult, np.ndarray]:
    """The covariance, widened where responses contradict each other more than their lines scatter; never narrowed."""
    widened = np.ones(result.values.size)
    scatter = cluster_deviation(problem, result.model)
    if scatter is not None:
        known = np.isfinite(result.standard_errors) & (result.standard_errors > 0)
        widened[known] = np.maximum(scatter[known] / result.standard_errors[known], 1.0)
    covariance = result.scaled_covariance * np.outer(widened, widened)
    return dataclasses.replace(result, scaled_covariance=covariance), widened


def _shape_errors(problem: ModalProblem, result: FitResult, coefficients: np.ndarray) -> np.ndarray:
    """Standard errors of shapes: their own for given poles, that of the poles passed on, and of gains that scatter."""
    model = result.model
    columns = problem.columns(model)
    slopes, places = problem.stacked_slopes(model)
    modes = model.poles.size
    covariance = np.nan_to_num(result.covariance)
    square = 2 * result.cost / result.degrees_of_freedom
    scale = max(1.0, square) if result.variance == "known" else square
    errors = np.empty((coefficients.shape[0], modes), dtype=complex)
    # A shape averages the gains of its responses, each as strongly as its excitation drives the mode.
    drive = np.abs(model.participations) ** 2
    averaged = np.sqrt(np.sum(drive**2, axis=1)) / np.sum(drive, axis=1)
    gain = gain_scatter(problem, model, square) * averaged
    for own in problem.groups():
        profile = problem.profile[own[0]][:, None]
        left, factor, size = factored(profile * columns)
        inverse = np.linalg.pinv(factor) / size[:, None]
        alone = np.sum(inverse**2, axis=1) * scale
        moved = (inverse @ (left.T @ (profile * slopes))).reshape(size.size, -1, 2)
        for row in own:
            passed = np.einsum("kpa,pa->kp", moved, coefficients[row][places])
            variance = alone / problem.size[row] ** 2 + np.einsum("kp,pq,kq->k", passed, covariance, passed)
            variance[: 2 * modes] += (np.tile(gain, 2) * coefficients[row, : 2 * modes]) ** 2
            errors[row] = shapes_of(np.sqrt(variance)[None], modes)[0]
    return errors


def significance(
    frequency: np.ndarray,
    values: np.ndarray,
    poles: np.ndarray,
    participation: np.ndarray,
    weight: np.ndarray,
    kind: ModalKind,
) -> np.ndarray:
    """By how much the squared residual would grow without each mode, in units of what its parameters cost (BIC).

    Below 1 the responses are explained as well without the mode.

    Args:
        frequency: lines [Hz].
        values: responses.
        poles: λ (modes,) [rad/s].
        participation: L (modes, inputs).
        weight: of each line.
        kind: what the responses are.

    Source: G. Schwarz, "Estimating the dimension of a model", Annals of Statistics 6 (1978) 461-464.
    """
    outputs, inputs, _ = values.shape
    basis = modal_basis(frequency, poles, participation, kind)

    def power(columns: np.ndarray) -> np.ndarray:
        rest = solve_linear(basis[:, :, columns], values, weight)[1]
        return np.sum(np.abs(rest) ** 2, axis=(1, 2))  # of each output

    everything = np.arange(basis.shape[-1])
    full = power(everything)
    cost = (2 * inputs + 2 * outputs) * np.log(2 * values.size)
    freedom = max(2 * values.size // outputs - basis.shape[-1], 1)
    noise = np.maximum(full / freedom, 1e-300)
    found = np.empty(poles.size)
    for mode in range(poles.size):
        rest = power(np.setdiff1d(everything, [mode, poles.size + mode]))
        found[mode] = np.sum((rest - full) / noise) / cost
    return found
