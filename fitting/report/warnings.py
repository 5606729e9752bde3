"""What a reader of a fit has to know before all else, each with what to do about it."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import ArrayLike

from fitting.controls import Control
from fitting.identifiability import AT_BOUND, NOT_SEEN, IdentifiabilityReport
from fitting.multistart import MultistartResult
from fitting.report.correlation import close_pairs
from fitting.result import FitResult
from fitting.solvers.stop import Stop

_LAGS = 60
# Far from white: the autocorrelation of some lag is larger than this, whatever the number of samples.
_MEMORY = 0.3
_RMS = (0.5, 2.0)
_CLOSE = 0.95
# A correlation does no harm to estimates with a standard error below this share of them.
_WELL_KNOWN = 0.01
_FEW = 3


def warnings_of(
    result: FitResult,
    *,
    identifiability: IdentifiabilityReport | None = None,
    many: MultistartResult | None = None,
    residuals: Mapping[str, ArrayLike] | None = None,
    controls: Sequence[Control] = (),
) -> list[str]:
    """Warnings about a fit, in plain sentences with the cure; the gravest first.

    Args:
        result: the fit.
        identifiability: what the data can tell, if known.
        many: fits from many starts, if there were any.
        residuals: weighted residuals in order of time by name, such as "record: channel".
        controls: controls of the fit.
    """
    return [
        *_convergence(result),
        *[f"Control “{control.name}” failed. {control.sentence}" for control in controls if not control.passed],
        *_parameters(result, identifiability),
        *_starts(many),
        *_size(result),
        *_memory(residuals or {}, result.correlated),
        *([result.warning] if result.warning else []),
    ]


def _convergence(result: FitResult) -> list[str]:
    if result.success:
        return []
    return [f"The fit did not converge, and its numbers hold only with care. {Stop[getattr(Stop, result.stop)]}"]


def _parameters(result: FitResult, report: IdentifiabilityReport | None) -> list[str]:
    unseen = {path for path, flag in zip(result.space.paths, result.unseen, strict=True) if flag}
    bound = {path for path, flag in zip(result.space.paths, result.active, strict=True) if flag}
    groups: tuple[tuple[str, ...], ...] = ()
    if report is not None:
        unseen |= {v.path for v in report.verdicts if v.kind == NOT_SEEN} - bound
        bound |= {v.path for v in report.verdicts if v.kind == AT_BOUND}
        groups = report.groups
    found = []
    if unseen:
        found.append(
            f"Not seen by these data: {_listed(result, unseen)}. Hold them at known values, give priors, or measure "
            "something that depends on them."
        )
    if bound:
        found.append(
            f"At a bound: {_listed(result, bound)}. If the bound is not physical, widen it; if it is, the model lacks "
            "something that the parameter makes up for."
        )
    for group in groups:
        found.append(
            f"Only a combination of {', '.join(group)} is known. Hold all but one, give a prior, or measure what tells "
            "them apart."
        )
    uncertain = set(_uncertain(result))
    close = [
        (a, b, value)
        for a, b, value in close_pairs(result)
        if abs(value) > _CLOSE and {a, b} & uncertain and not any({a, b} <= set(group) for group in groups)
    ]
    if close:
        pairs = "; ".join(f"{a} and {b} ({value:.2f})".replace("-", "−") for a, b, value in close)
        found.append(
            f"Closely correlated estimates: {pairs}. Use them together only, or measure what tells them apart."
        )
    return found


def _uncertain(result: FitResult) -> list[str]:
    """Paths of the estimates that are not known well, each for itself."""
    known = np.abs(result.standard_errors) <= _WELL_KNOWN * np.abs(result.values)
    return [path for path, well in zip(result.space.paths, known, strict=True) if not well]


def _starts(many: MultistartResult | None) -> list[str]:
    if many is None:
        return []
    total, good = len(many.costs), int(many.success.sum())
    if good == 0:
        return [f"None of {total} starts converged. {many.message}"]
    found = []
    best = int(np.sum(many.clusters == 0))
    if best < min(_FEW, total):
        found.append(
            f"Only {best} of {total} starts found the best minimum: there may be a better one. Draw more starts, or "
            "narrow the bounds."
        )
    if 2 * good < total:
        found.append(f"Only {good} of {total} starts converged. Narrow the bounds to where the model can be simulated.")
    return found


def _size(result: FitResult) -> list[str]:
    rms = result.rms
    if not np.isfinite(rms) or _RMS[0] <= rms <= _RMS[1]:
        return []
    if rms > 1:
        return [
            f"What is left over is {rms:.3g} times the standard deviations taken. Either these are too small, or the "
            "model lacks something: look at the shape of the residuals."
        ]
    return [
        f"What is left over is only {rms:.2g} times the standard deviations taken. These are too large, or the model "
        "has so much freedom that it follows the noise: take the deviations from repeated records."
    ]


def _memory(residuals: Mapping[str, ArrayLike], allowed: bool) -> list[str]:
    """One sentence on all residuals that remember, so that many channels do not hide the other warnings."""
    found = {name: said for name, values in residuals.items() if (said := _correlated(np.asarray(values, dtype=float)))}
    if not found:
        return []
    if len(found) == 1:
        ((name, said),) = found.items()
        told = f"The residual of {name} is far from noise (autocorrelation {said})."
    else:
        listed = "; ".join(f"{name} ({said})" for name, said in found.items())
        told = f"Residuals are far from noise, by their autocorrelation: {listed}."
    if allowed:
        return [f"{told} The model lacks something: look at the residual for its shape, and mend the model."]
    return [
        f"{told} The model lacks something, and standard errors that count its errors as independent are too small: "
        "look at the residual for its shape, mend the model, or fit with correlated errors."
    ]


def _correlated(values: np.ndarray) -> str:
    """The largest autocorrelation and its lag; empty for what may be noise."""
    values = values[np.isfinite(values)] if values.ndim == 1 else values.ravel()
    if values.size < 2 * _LAGS or values.std() == 0:
        return ""
    moving = values - values.mean()
    spectrum = np.fft.rfft(moving, 2 * values.size)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2)[: _LAGS + 1]
    correlation = correlation / correlation[0]
    lag = int(np.argmax(np.abs(correlation[1:]))) + 1
    if abs(correlation[lag]) <= _MEMORY:
        return ""
    size = f"{correlation[lag]:.2f}".replace("-", "−")
    return f"{size} at {lag} {'sample' if lag == 1 else 'samples'}"


def _listed(result: FitResult, paths: set[str]) -> str:
    return ", ".join(path for path in result.space.paths if path in paths)
