"""Poles refined by maximum likelihood: all responses at once, weighted, shapes and residual terms eliminated.

Only poles and participations are searched; for given ones the responses are linear in everything else, which is solved
for response by response and projected out (variable projection). The derivative is exact, with the part that comes from
the solution itself. Written in NumPy: each measurement has numbers of lines, responses and modes of its own, for which
a program would have to be compiled.

Sources: G. H. Golub, V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares problems whose
variables separate", SIAM J. Numer. Anal. 10 (1973) 413-432; P. Guillaume, P. Verboven, S. Vanlanduit, "Frequency-domain
maximum likelihood identification of modal parameters with confidence intervals", Proc. ISMA 23 (1998) 359-366.
"""

import dataclasses
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from fitting.identification.modal_basis import FORMS, ModalKind, in_reals, modal_basis
from fitting.identification.modal_poles import ModalPoles
from fitting.result import FitResult
from fitting.uncertainty import covariance_of
from twin.parameters import ParameterSpace

# Profiles of weights that agree to this are one, and are solved together.
_ALIKE = 1e-12
# Root of the share of the cost that a step still promises to remove, below which the search has ended.
_OFFSET = 1e-6
# Where the search begins between Newton and steepest descent, and where it is stuck.
_CAUTION, _STUCK = 1e-4, 1e8
# Share of the largest curvature below which nothing is known of a direction: what rounding leaves.
_UNSEEN = 1e-13
# Responses explained but for this share are explained but for rounding.
_ROUNDING = 1e-10
# How much more may be left where no step helps any more, as within the plane of a repeated pole.
_NEARLY = 1e3


class Linearised(NamedTuple):
    """Half the squared residual at some poles, with its derivatives by the parameters in their own units."""

    cost: float
    """Half the sum of squared weighted residuals."""
    gradient: np.ndarray
    """Its gradient, exact (parameters,)."""
    curvature: np.ndarray
    """Its second derivatives after Gauss and Newton, with Kaufman's simplification (parameters, parameters)."""
    residual: np.ndarray
    """Responses of the modes minus measured ones, weighted (outputs, rows)."""
    coefficients: np.ndarray
    """The best shapes and residual terms (outputs, columns)."""


@dataclasses.dataclass(frozen=True)
class ModalProblem:
    """Measured responses, and what modes leave of them; rows run over excitations, both parts and lines."""

    frequency: Float[np.ndarray, "frequencies"]
    """Lines [Hz]."""
    kind: ModalKind
    """What the responses are."""
    measured: Float[np.ndarray, "outputs rows"]
    """Responses."""
    size: Float[np.ndarray, "outputs"]
    """The largest weight of each output."""
    profile: Float[np.ndarray, "outputs rows"]
    """Weights, one over the standard deviation, as a share of the largest of their output."""

    @classmethod
    def of(cls, frequency: np.ndarray, values: np.ndarray, deviation: np.ndarray, kind: ModalKind) -> "ModalProblem":
        """From complex responses.

        Args:
            frequency: lines [Hz].
            values: responses (outputs, inputs, frequencies).
            deviation: standard deviation of their real and of their imaginary parts, likewise.
            kind: what the responses are.
        """
        weight = in_reals((1 + 1j) / np.broadcast_to(deviation, values.shape))
        size = weight.max(axis=1)
        return cls(frequency, kind, in_reals(values), size, weight / size[:, None])

    def groups(self) -> Iterator[np.ndarray]:
        """Outputs whose weights have one course, which share their factorisation."""
        left = np.arange(self.size.size)
        while left.size:
            same = np.all(np.abs(self.profile[left] - self.profile[left[0]]) <= _ALIKE, axis=1)
            yield left[same]
            left = left[~same]

    def columns(self, model: ModalPoles) -> np.ndarray:
        """What the responses are combinations of (rows, columns).

        Args:
            model: poles and participations.
        """
        basis = modal_basis(self.frequency, model.poles, model.participations, self.kind)
        return in_reals(np.moveaxis(basis, -1, 0)).T

    def slopes(self, model: ModalPoles) -> Iterator[tuple[int, np.ndarray]]:
        """For each parameter the mode that it belongs to, and the derivative of that mode's two columns (rows, 2).

        Args:
            model: poles and participations.
        """
        s = 2j * np.pi * self.frequency
        factor = s ** FORMS[self.kind.form]
        poles, participation = model.poles, model.participations
        f, ratio = np.asarray(model.frequency), np.asarray(model.damping_ratio)
        modes, inputs = participation.shape
        by_ratio = 2 * np.pi * f * (-1 - 1j * ratio / np.sqrt(1 - ratio**2))
        nothing = np.zeros(inputs)

        def slope(mode: int, change: complex, turn: np.ndarray) -> tuple[int, np.ndarray]:
            pole, own = poles[mode], participation[mode]
            if self.kind.damping == "viscous":
                direct = np.outer(own, change / (s - pole) ** 2) + np.outer(turn, 1 / (s - pole))
                there = np.conj(pole)
                mirrored = np.outer(own.conj(), np.conj(change) / (s - there) ** 2)
                mirrored += np.outer(turn.conj(), 1 / (s - there))
                pair = (direct + mirrored, 1j * (direct - mirrored))
            else:
                square = s**2 - pole**2
                course = 2j * change.imag / square + 4j * pole.imag * pole * change / square**2
                direct = np.outer(own, course) + np.outer(turn, 2j * pole.imag / square)
                pair = (direct, 1j * direct)
            return mode, np.stack([in_reals(one * factor) for one in pair], axis=1)

        for mode in range(modes):
            yield slope(mode, poles[mode] / f[mode], nothing)
        for mode in range(modes):
            yield slope(mode, by_ratio[mode], nothing)
        for mode in range(modes):
            for unit in (1.0, 1j):
                for excitation in model.others[mode]:
                    yield slope(mode, 0j, unit * np.eye(inputs)[excitation])

    def linearised(self, model: ModalPoles) -> Linearised:
        """Cost, derivatives, shapes.

        The derivative of a response is P·D·c: D of its columns, c of their coefficients, P what is beside the columns.
        Summed over responses that share their weights, products of D and of c come apart.

        Args:
            model: poles and participations.
        """
        columns = self.columns(model)
        slopes, places = self.stacked_slopes(model)
        count = places.shape[0]
        residual = np.empty_like(self.measured)
        coefficients = np.empty((self.size.size, columns.shape[1]))
        gradient, curvature = np.zeros(count), np.zeros((count, count))
        for own in self.groups():
            profile, scale = self.profile[own[0]][:, None], self.size[own]
            left, factor, size = factored(profile * columns)
            right = profile * self.measured[own].T
            inside = left.T @ right
            rest = right - left @ inside
            solved = (np.linalg.pinv(factor) @ inside) / size[:, None]
            residual[own], coefficients[own] = -(rest * scale).T, solved.T
            moving = profile * slopes
            parts = solved[places] * scale  # (parameters, 2, outputs)
            gradient -= np.sum((moving.T @ (rest * scale)).reshape(count, 2, -1) * parts, axis=(1, 2))
            beside = moving - left @ (left.T @ moving)
            squares = (beside.T @ beside).reshape(count, 2, count, 2)
            flat = parts.reshape(2 * count, -1)
            curvature += np.sum(squares * (flat @ flat.T).reshape(count, 2, count, 2), axis=(1, 3))
        return Linearised(0.5 * float(np.sum(residual**2)), gradient, curvature, residual, coefficients)

    def stacked_slopes(self, model: ModalPoles) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of the two columns that each parameter moves (rows, 2·parameters), and their places.

        Args:
            model: poles and participations.
        """
        found = list(self.slopes(model))
        modes = np.array([mode for mode, _ in found])
        return np.concatenate([pair for _, pair in found], axis=1), np.stack([modes, modes + model.poles.size], axis=1)


def factored(weighted: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """QR factors of columns over their sizes, and these sizes.

    Args:
        weighted: columns (rows, columns).
    """
    size = np.linalg.norm(weighted, axis=0)
    left, factor = np.linalg.qr(weighted / size)
    return left, factor, size


def refined(problem: ModalProblem, start: ModalPoles, *, variance: str, max_steps: int) -> FitResult:
    """The poles and participations of least squares, by a bounded Levenberg-Marquardt search.

    Args:
        problem: measured responses with their weights.
        start: where to begin.
        variance: "known", or "estimated" from the residual.
        max_steps: steps after which the search is given up.
    """
    space = start.space(float(np.median(np.diff(problem.frequency))))
    sizes = np.array([1.0 if one.size is None else one.size for one in space.parameters])
    logarithmic = np.array([one.scale == "log" for one in space.parameters])
    ends = np.array([[one.lower, one.upper] for one in space.parameters]).T
    lower, upper = space.scaled_rows(ends)

    def look(vector: np.ndarray) -> Linearised:
        values = space.unscaled_rows(vector[None])[0]
        found = problem.linearised(start.moved(values))
        slopes = np.where(logarithmic, values, sizes)
        return found._replace(gradient=found.gradient * slopes, curvature=found.curvature * np.outer(slopes, slopes))

    vector = space.scaled_rows(_values(start)[None])[0]
    here = look(vector)
    small = (
        0.5 * _ROUNDING**2 * float(np.sum(np.sum((problem.measured * problem.profile) ** 2, axis=1) * problem.size**2))
    )
    stop, caution, history, steps = "too_many_steps", _CAUTION, [here.cost], 0
    held, offset = np.zeros(vector.size, dtype=bool), np.inf
    while steps < max_steps:
        held = ((vector <= lower) & (here.gradient > 0)) | ((vector >= upper) & (here.gradient < 0))
        promised = here.gradient @ _step(here, ~held, 0.0) * -0.5
        offset = float(np.sqrt(max(promised, 0.0) / max(here.cost, 1e-300)))
        if here.cost <= small or offset < _OFFSET:
            stop = "at_precision" if here.cost <= small else "converged"
            break
        if caution > _STUCK:
            exhausted = offset < np.sqrt(_OFFSET) or here.cost <= _NEARLY**2 * small
            stop = "at_precision" if exhausted else "stalled"
            break
        moved = np.clip(vector + _step(here, ~held, caution), lower, upper)
        there = look(moved)
        steps += 1
        if there.cost < here.cost:
            vector, here, caution = moved, there, caution / 10
            history.append(here.cost)
        else:
            caution = max(10 * caution, _CAUTION)
    return _as_result(start, space, vector, here, held, offset, stop, steps, history, variance)


def _step(here: Linearised, free: np.ndarray, caution: float) -> np.ndarray:
    step = np.zeros(free.size)
    size = np.sqrt(np.maximum(np.diag(here.curvature)[free], 1e-300))
    scaled = here.curvature[np.ix_(free, free)] / np.outer(size, size)
    values, turn = np.linalg.eigh(scaled)
    # Directions that nothing is known of, as within the plane of a repeated pole, are not gone.
    known = values > _UNSEEN * values.max(initial=0.0)
    along = turn.T @ (here.gradient[free] / size)
    step[free] = -(turn @ np.where(known, along / np.where(known, values + caution, 1.0), 0.0)) / size
    return step


def _as_result(
    start: ModalPoles,
    space: ParameterSpace,
    vector: np.ndarray,
    here: Linearised,
    held: np.ndarray,
    offset: float,
    stop: str,
    steps: int,
    history: list[float],
    variance: str,
) -> FitResult:
    size = np.sqrt(np.maximum(np.diag(here.curvature), 1e-300))
    values, turn = np.linalg.eigh(here.curvature / np.outer(size, size))
    # A square Jacobian with the curvature's information stands for the one with a row for every number measured.
    rows = np.sqrt(np.where(values > _UNSEEN * values.max(), values, 0.0))[:, None] * turn.T * size
    covariance = covariance_of(np.zeros(vector.size), rows, held, variance="known")
    freedom = here.residual.size - vector.size
    scale = 1.0 if variance == "known" else 2 * here.cost / max(freedom, 1)
    found = space.unscaled_rows(vector[None])[0]
    return FitResult(
        model=start.moved(found),
        space=space,
        values=found,
        scaled=vector,
        scaled_covariance=scale * covariance.matrix,
        factor=np.asarray(np.linalg.qr(rows, mode="r")),
        condition_number=covariance.condition_number,
        degrees_of_freedom=freedom,
        unseen=covariance.unseen,
        active=held,
        residual=here.residual.ravel(),
        cost_history=np.array(history),
        steps=steps,
        stop=stop,
        offset=offset,
        variance=variance,
    )


def _values(model: ModalPoles) -> np.ndarray:
    return np.concatenate([np.asarray(x) for x in (model.frequency, model.damping_ratio, model.participation)])
