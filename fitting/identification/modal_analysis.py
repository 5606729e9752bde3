"""Experimental modal analysis: from measured frequency responses to natural frequencies, damping ratios and shapes.

Poles are estimated for rising orders (`modal_lscf`), followed from order to order (`modal_stabilisation`), chosen
(`modal_selection`) and refined by maximum likelihood with shapes and residual terms eliminated (`modal_refinement`).

Sources: P. Guillaume et al., "A poly-reference implementation of the least-squares complex frequency-domain estimator",
Proc. IMAC 21 (2003); B. Peeters et al., "The PolyMAX frequency-domain method", Shock and Vibration 11 (2004) 395-409.
"""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from threadpoolctl import threadpool_limits

from fitting.identification.modal_basis import DAMPING, FORMS, ModalKind, modal_basis
from fitting.identification.modal_fit import ModalFit, fit_modes, significance
from fitting.identification.modal_lscf import largest_order, lscf_poles
from fitting.identification.modal_reciprocity import by_reciprocity
from fitting.identification.modal_result import ModalAnalysis, counted
from fitting.identification.modal_selection import Candidate, candidates, chosen
from fitting.identification.modal_shapes import scaled_shapes
from fitting.identification.modal_stabilisation import LARGEST_DAMPING, StabilisationDiagram, stabilisation_diagram
from fitting.identification.modal_verdict import verdicts
from twin._checks import InputError, finite, positive, require_x64
from twin.correlation.collinearity import phase_collinearity
from twin.frf import FRF

_ORDER, _LEAST_ORDER = 30, 3
# A mode whose damping is no better known than this, as a share of it, is none.
_UNKNOWN = 0.5
# Correlation of neighbouring lines' residuals that tells of modes missing.
_STRUCTURE = 0.6
# By how much responses widen the errors before it is told.
_CONTRADICTED = 2.0
_TURNED = (
    "Shapes are those of the points that were hit, by reciprocity, which holds for passive structures: responses and "
    "excitations are swapped."
)


def modal_analysis(
    frf: FRF,
    *,
    band: tuple[float, float] | None = None,
    order: int | None = None,
    modes: int | Sequence[float] | None = None,
    form: str | None = None,
    damping: str = "viscous",
    residual_terms: bool = True,
    reciprocal: bool | None = None,
) -> ModalAnalysis:
    """Modes of a structure from its measured frequency responses, with standard errors.

    Modes are chosen without being asked: poles that stay in place from order to order (frequency within 1 %, damping
    within 5 %, MAC above 0.98) and that the responses need (information criterion), with up to 20 % of damping.

    Responses are weighted by their variance if they have one. Without it the noise of each is found from what the modes
    leave, the same at all lines or growing with the response where it does (`modal_noise`), so that errors hold where
    the modes explain all but noise; neighbouring lines that err alike, as behind a window, are allowed for. So are
    whole responses that err, as by gains that scatter (`modal_clusters`), where there are six responses or more.

    Args:
        frf: responses to one or more excitations; several excitations tell modes of one frequency apart. Names that are
            both a response and an excitation are driving points, which give shapes their scale.
        band: lowest and highest frequency used [Hz]; all if not given.
        order: highest order of the polynomials; by default 30, less where there are few lines.
        modes: how many modes, or about which frequencies [Hz]; found by itself if not given.
        form: receptance, mobility or accelerance, where the responses do not say it themselves.
        damping: "viscous", or "hysteretic" for responses of models with a loss factor.
        residual_terms: whether there are terms for modes below and above the band.
        reciprocal: whether excitations and responses are swapped, so that shapes are those of the points that were hit,
            as behind a roving hammer; by default where there are more excitations than responses.

    Returns:
        The modes.

    Raises:
        InputError: 64-bit mode off, a form or damping that there is not, values that are not finite, too few lines, no
            stable pole, modes wanted that are not found.
    """
    require_x64()
    used, remarks = _checked(frf, band, form, damping)
    used, turned = by_reciprocity(used, reciprocal)
    if turned:
        remarks.append(_TURNED)
    kind = ModalKind(used.form, damping, residual_terms)
    frequency, values = np.asarray(used.frequency), np.asarray(used.values)
    deviation = None if used.variance is None else np.sqrt(np.asarray(used.variance) / 2)
    highest, told = _order(order, values.shape)
    with threadpool_limits(1, user_api="blas"):  # of many small factorisations each waits for all cores
        by_output, by_line = _weights(values, deviation)
        poles = lscf_poles(frequency, values, by_output, highest)
        diagram = stabilisation_diagram(poles, frequency, values, by_line, kind)
        taken, left = chosen(candidates(diagram), modes, highest, (float(frequency[0]), float(frequency[-1])))
        if modes is None:
            taken, more = _needed(taken, frequency, values, by_line, kind)
            left += more
        found, taken, more = _fitted(frequency, values, deviation, kind, taken, drop=modes is None)
    remarks += told + left + more
    return _result(used, found, diagram, taken, kind, turned, remarks)


def _checked(frf: FRF, band: tuple[float, float] | None, form: str | None, damping: str) -> tuple[FRF, list[str]]:
    stated = frf.form if form is None else form
    if stated not in FORMS:
        raise InputError(
            f"form is {stated!r}, but modes are told from receptance, mobility or accelerance. Say by form which of "
            "them the responses are."
        )
    if damping not in DAMPING:
        raise InputError(f"damping must be one of {', '.join(DAMPING)}, but is {damping!r}.")
    if band is not None and not (np.all(np.isfinite(band)) and 0 <= band[0] < band[1]):
        raise InputError(f"band is {band} Hz, but must be a lower and a higher frequency.")
    remarks = []
    if float(frf.frequency[0]) <= 0:
        if band is None or band[0] <= 0:
            remarks.append("The line at 0 Hz was left out.")
        frf = frf.between(np.nextafter(0, 1), np.inf)
    frf = frf if band is None else frf.between(*band)
    finite("frf", np.abs(np.asarray(frf.values)))
    if not np.any(np.asarray(frf.values)):
        raise InputError("All responses are zero. Check that the right channels were read.")
    if frf.variance is not None:
        positive("variance of frf", frf.variance)
    return FRF(frf.frequency, frf.values, frf.outputs, frf.inputs, stated, frf.variance), remarks


def _order(order: int | None, shape: tuple[int, ...]) -> tuple[int, list[str]]:
    outputs, inputs, lines = shape
    most = largest_order(lines, outputs, inputs)
    if most < _LEAST_ORDER:
        raise InputError(
            f"{lines} lines are too few to tell modes from. Measure with a finer resolution, or widen the band."
        )
    if order is not None and order < _LEAST_ORDER:
        raise InputError(f"order is {order}, but poles can only be followed over {_LEAST_ORDER} orders or more.")
    if order is not None and order > most:
        return most, [f"The order was lowered to {most}: there are {lines} lines only."]
    return min(order or _ORDER, most), []


def _weights(values: np.ndarray, deviation: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Weights of each line of each output, and of each line for all of them."""
    rms = np.sqrt(np.mean(np.abs(values) ** 2, axis=(1, 2)))
    rms = np.where(rms > 0, rms, 1.0)
    if deviation is None:
        return np.repeat(1 / rms[:, None], values.shape[2], axis=1), np.ones(values.shape[2])
    by_output = 1 / np.sqrt(np.mean(deviation**2, axis=1))
    return by_output, 1 / np.sqrt(np.mean((deviation / rms[:, None, None]) ** 2, axis=(0, 1)))


def _needed(
    taken: list[Candidate], frequency: np.ndarray, values: np.ndarray, weight: np.ndarray, kind: ModalKind
) -> tuple[list[Candidate], list[str]]:
    """The candidates without which the responses are explained worse."""
    told = []
    while len(taken) > 1:
        poles, participation = _start(taken)
        gain = significance(frequency, values, poles, participation, weight, kind)
        least = int(np.argmin(gain))
        if gain[least] >= 1:
            break
        told.append(f"Not taken: {abs(taken[least].pole) / (2 * np.pi):.4g} Hz, the responses do not need it.")
        taken = taken[:least] + taken[least + 1 :]
    return taken, told


def _start(taken: list[Candidate]) -> tuple[np.ndarray, np.ndarray]:
    return np.array([one.pole for one in taken]), np.stack([one.participation for one in taken])


def _fitted(
    frequency: np.ndarray,
    values: np.ndarray,
    deviation: np.ndarray | None,
    kind: ModalKind,
    taken: list[Candidate],
    *,
    drop: bool,
) -> tuple[ModalFit, list[Candidate], list[str]]:
    """The fit, again without modes that turn out to be none."""
    told = []
    while True:
        _check_numbers(taken, values.shape)
        found = fit_modes(frequency, values, *_start(taken), deviation, kind)
        result, count = found.result, len(taken)
        ratio, error = result.values[count : 2 * count], result.standard_errors[count : 2 * count]
        f = result.values[:count]
        good = ~(result.active[:count] | result.active[count : 2 * count])
        good &= (error < _UNKNOWN * ratio) & (ratio < LARGEST_DAMPING) & (f > frequency[0]) & (f < frequency[-1])
        if not drop or good.all() or not good.any():
            return found, taken, told
        told += [
            f"Not taken: {abs(one.pole) / (2 * np.pi):.4g} Hz, which the fit of all responses gives a damping ratio of "
            f"{ratio[i]:.2g} ± {error[i]:.2g} at {f[i]:.4g} Hz."
            for i, one in enumerate(taken)
            if not good[i]
        ]
        taken = [one for one, keep in zip(taken, good, strict=True) if keep]


def _check_numbers(taken: list[Candidate], shape: tuple[int, ...]) -> None:
    outputs, inputs, lines = shape
    unknowns = 2 * len(taken) * (inputs + outputs) + 4 * inputs * outputs
    if 2 * outputs * inputs * lines <= unknowns:
        raise InputError(
            f"{len(taken)} modes have {unknowns} unknowns, for {outputs * inputs} responses at {lines} lines. Ask for "
            "fewer modes, widen the band, or measure with a finer resolution."
        )


def _contradicted(found: ModalFit, frequency: np.ndarray) -> list[str]:
    """What is said where whole responses err."""
    modes = frequency.size
    widest = np.max(found.widened[: 2 * modes].reshape(2, modes), axis=0)
    if np.max(widest) <= _CONTRADICTED:
        return []
    listed = ", ".join(f"{f:.4g} Hz" for f, one in zip(frequency, widest, strict=True) if one > _CONTRADICTED)
    return [
        f"Responses contradict each other more than their noise: about {listed}; errors are widened by up to "
        f"{np.max(widest):.2g}. Gains that scatter from response to response, as by the place and direction of taps, "
        "do this, and a structure that changed between them: compare the responses with the synthesised ones."
    ]


def _result(
    frf: FRF,
    found: ModalFit,
    diagram: StabilisationDiagram,
    taken: list[Candidate],
    kind: ModalKind,
    turned: bool,
    remarks: list[str],
) -> ModalAnalysis:
    model, frequency = found.result.model, np.asarray(frf.frequency)
    modes = model.poles.size
    scaled = scaled_shapes(model.poles, found.shapes, found.shape_errors, model.participations, frf.outputs, frf.inputs)
    basis = modal_basis(frequency, model.poles, model.participations, kind)[..., : 2 * modes]
    parts = np.concatenate([np.real(found.shapes), np.imag(found.shapes)], axis=1)
    alone = [np.einsum("ifk,ok->oif", basis[..., [m, modes + m]], parts[:, [m, modes + m]]) for m in range(modes)]
    power = np.sum(np.abs(np.asarray(frf.values)) ** 2)
    warnings = []
    if found.correlation > _STRUCTURE and found.result.stop != "at_precision":
        warnings.append(
            f"What the modes leave hangs together from line to line (correlation {found.correlation:.2g}), by which "
            "the errors are widened: modes are missing, the structure is not linear, or a window leaks. Look at the "
            "responses against the synthesised ones; raise order, narrow the band, or name modes."
        )
    errors = found.result.standard_errors
    points = len(frf.outputs)
    if points < modes:
        warnings.append(
            f"Shapes at {counted(points, 'point')} do not tell {modes} modes apart: a MAC among them misleads. Measure "
            "at more points than there are modes."
        )
    warnings += _contradicted(found, frequency=np.asarray(model.frequency))
    return ModalAnalysis(
        measured=frf,
        synthesised=FRF(frf.frequency, jnp.asarray(found.synthesised), frf.outputs, frf.inputs, frf.form),
        fit=found.result,
        scaled=scaled,
        diagram=diagram,
        share=np.array([np.sum(np.abs(one) ** 2) / power for one in alone]),
        verdict=verdicts(
            np.asarray(model.frequency),
            np.asarray(model.damping_ratio),
            errors[modes : 2 * modes],
            phase_collinearity(scaled.shapes),
            np.array([one.stable for one in taken]) / diagram.orders,
            frequency,
        ),
        reciprocal=turned,
        warnings=(*warnings, *scaled.remarks),
        remarks=tuple(remarks),
    )
