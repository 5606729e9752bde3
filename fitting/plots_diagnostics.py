"""What a residual should look like if the model is right: noise, normal, and without memory."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import ArrayLike
from scipy import stats

from fitting.result import FitResult
from twin._axes import axes_or_new, grid_or_new
from twin._checks import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BLUE, _LINE = "C0", {"color": "C3", "lw": 1.2}


def plot_diagnostics(
    residual: FitResult | ArrayLike,
    *,
    series: int = 1,
    fitted: ArrayLike | None = None,
    axes: "Sequence[Axes] | np.ndarray | None" = None,
) -> "np.ndarray":
    """Four looks at a weighted residual: in sequence, as quantiles, its memory, and against the fitted value (or else
    as a histogram).

    Args:
        residual: a fit, whose priors are left out, or the residual itself (samples,).
        series: number of equally long series, one after the other, that it consists of.
        fitted: fitted values (samples,), in any unit.
        axes: four axes to draw in; new ones if not given.

    Returns:
        The axes (4,).

    Raises:
        InputError: nothing finite to draw, a length that does not divide into the series, fitted values of another
            length.
    """
    values = _values(residual)
    grid = grid_or_new(axes, 4, columns=2, panel=(3.9, 2.8))
    plot_sequence(values, series=series, ax=grid[0])
    plot_quantiles(values, ax=grid[1])
    plot_autocorrelation(values, series=series, ax=grid[2])
    if fitted is None:
        plot_histogram(values, ax=grid[3])
    else:
        other = np.asarray(fitted, dtype=float).ravel()
        if other.shape != values.shape:
            raise InputError(f"fitted has {other.size} values, but the residual {values.size}. Give one for each.")
        ax = grid[3]
        ax.plot(other, values, ".", ms=3, color=_BLUE, alpha=0.6, rasterized=values.size > 2000)
        ax.axhline(0, color="0.3", lw=0.8)
        ax.set_xlabel("fitted value")
        ax.set_ylabel("weighted residual [-]")
    return grid


def plot_sequence(residual: FitResult | ArrayLike, *, series: int = 1, ax: "Axes | None" = None) -> "Axes":
    """The residual in the order of its samples, with the boundaries between series.

    Args:
        residual: as in `plot_diagnostics`.
        series: as in `plot_diagnostics`.
        ax: axes to draw in; new ones if not given.
    """
    ax, values = axes_or_new(ax), _values(residual)
    rows = _rows(values, series)
    ax.plot(values, ".", ms=3, color=_BLUE, alpha=0.6, rasterized=values.size > 2000)
    ax.axhline(0, color="0.3", lw=0.8)
    for end in range(1, series):
        ax.axvline(end * rows.shape[1] - 0.5, color="0.6", lw=0.8, ls="--")
    ax.set_xlabel("sample")
    ax.set_ylabel("weighted residual [-]")
    return ax


def plot_quantiles(residual: FitResult | ArrayLike, *, ax: "Axes | None" = None) -> "Axes":
    """Quantiles against those of a normal distribution, with the line of one with the residual's quartiles.

    Args:
        residual: as in `plot_diagnostics`.
        ax: axes to draw in; new ones if not given.
    """
    ax, values = axes_or_new(ax), np.sort(_finite(residual))
    expected = stats.norm.ppf((np.arange(values.size) + 0.625) / (values.size + 0.25))
    low, high = np.quantile(values, [0.25, 0.75])
    slope = (high - low) / (stats.norm.ppf(0.75) - stats.norm.ppf(0.25))
    ax.plot(expected, values, ".", ms=3, color=_BLUE, rasterized=values.size > 2000)
    ax.axline((0.0, float(low + high) / 2), slope=float(slope), label=f"normal, deviation {slope:.3g}", **_LINE)
    ax.set_xlabel("normal quantile [-]")
    ax.set_ylabel("weighted residual [-]")
    ax.legend(fontsize="small", loc="upper left")
    return ax


def plot_histogram(residual: FitResult | ArrayLike, *, ax: "Axes | None" = None) -> "Axes":
    """Histogram with the normal density of the same mean and deviation.

    Args:
        residual: as in `plot_diagnostics`.
        ax: axes to draw in; new ones if not given.
    """
    ax, values = axes_or_new(ax), _finite(residual)
    ax.hist(values, bins=min(50, max(8, int(np.sqrt(values.size)))), density=True, color=_BLUE, alpha=0.5)
    mean, deviation = float(np.mean(values)), float(np.std(values))
    if deviation > 0:
        x = np.linspace(values.min(), values.max(), 200)
        label = f"normal, mean {round(mean / deviation, 3) * deviation:.2g}, deviation {deviation:.3g}"
        ax.plot(x, stats.norm.pdf(x, mean, deviation), label=label, **_LINE)
        ax.set_ylim(top=1.3 * ax.get_ylim()[1])
        ax.legend(fontsize="small", loc="upper left")
    ax.set_xlabel("weighted residual [-]")
    ax.set_ylabel("density [-]")
    return ax


def plot_autocorrelation(
    residual: FitResult | ArrayLike, *, series: int = 1, lags: int | None = None, ax: "Axes | None" = None
) -> "Axes":
    """Autocorrelation, averaged over the series, with the band that noise without memory stays in at 95 % of lags.

    Args:
        residual: as in `plot_diagnostics`.
        series: as in `plot_diagnostics`.
        lags: longest lag; a quarter of a series, but at most 60, if not given.
        ax: axes to draw in; new ones if not given.
    """
    ax, values = axes_or_new(ax), _values(residual)
    rows = _rows(np.where(np.isfinite(values), values, 0.0), series)
    length = rows.shape[1]
    last = min(length - 1, max(1, min(length // 4, 60)) if lags is None else lags)
    transform = np.fft.rfft(rows - rows.mean(), 2 * length, axis=1)
    covariance = np.fft.irfft(np.abs(transform) ** 2, axis=1).sum(axis=0)[: last + 1]
    correlation = covariance / covariance[0] if covariance[0] > 0 else np.zeros(last + 1)
    shown = np.arange(1, last + 1)
    ax.vlines(shown, 0, correlation[1:], color=_BLUE, lw=2.0 if last < 40 else 1.2)
    band = 1.96 / np.sqrt(values.size)
    ax.axhspan(-band, band, color="C3", alpha=0.2, label="95 % band of white noise")
    ax.axhline(0, color="0.3", lw=0.8)
    reach = 1.2 * max(2 * band, float(np.max(np.abs(correlation[1:]), initial=0.0)))
    ax.set_ylim(-min(reach, 1.05), min(1.5 * reach, 1.4))
    ax.set_xlim(0, last + 1)
    ax.set_xlabel("lag [samples]")
    ax.set_ylabel("autocorrelation [-]")
    ax.legend(fontsize="small", loc="upper right")
    return ax


def plot_spectrum(
    residual: FitResult | ArrayLike, period: float, *, unit: str = "-", ax: "Axes | None" = None
) -> "Axes":
    """Amplitude spectral density (Welch), with the level of white noise of the same deviation.

    Args:
        residual: as in `plot_diagnostics`, one series.
        period: time between two samples [s].
        unit: unit of the residual.
        ax: axes to draw in; new ones if not given.

    Raises:
        InputError: a period that is not positive, nothing finite to draw.
    """
    from scipy import signal

    if not period > 0:
        raise InputError(f"period must be positive, but is {period} s.")
    ax, values = axes_or_new(ax), _finite(residual)
    length = min(values.size, max(64, min(values.size // 24, 4096)))
    frequency, density = signal.welch(values, 1 / period, nperseg=length, detrend="constant")
    ax.plot(frequency[1:], np.sqrt(density[1:]), color=_BLUE, lw=1.0)
    ax.axhline(float(np.std(values)) * np.sqrt(2 * period), label="white noise", **_LINE)
    ax.set_yscale("log")
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel(f"density [{'1' if unit == '-' else unit}/√Hz]")
    ax.margins(x=0)
    ax.legend(fontsize="small", loc="upper right")
    return ax


def _values(residual: FitResult | ArrayLike) -> np.ndarray:
    if isinstance(residual, FitResult):
        priors = sum(p.prior is not None for p in residual.space.parameters)
        values = np.asarray(residual.residual)[: len(residual.residual) - priors]
    else:
        values = np.asarray(residual, dtype=float).ravel()
    if np.isfinite(values).sum() < 2:
        raise InputError(
            f"The residual has {values.size} entries, of which {np.isfinite(values).sum()} are finite; there is "
            "nothing to draw. Look at the status of the fit."
        )
    return values


def _finite(residual: FitResult | ArrayLike) -> np.ndarray:
    values = _values(residual)
    return values[np.isfinite(values)]


def _rows(values: np.ndarray, series: int) -> np.ndarray:
    if series < 1 or values.size % series:
        raise InputError(f"{values.size} residuals do not divide into {series} series of equal length.")
    return values.reshape(series, -1)
