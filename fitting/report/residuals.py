"""Section: what is left over, and whether it looks like noise."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from fitting.plots import plot_residual
from fitting.plots_diagnostics import plot_autocorrelation, plot_histogram, plot_spectrum
from fitting.report.compared import Compared
from fitting.report.content import Figure, Section
from fitting.report.thinning import thinned, with_gaps
from twin.record import Record

_MOST = 8
# Samples that are few enough for large dots.
_FEW = 3000
_SPEEDS = ("m/s", "rad/s")


def residuals_section(series: Sequence[Compared], records: Mapping[str, Record]) -> Section:
    """Residuals of each channel: over time, against the normal distribution, their memory, their spectrum, and over
    the speed where one was measured or simulated.

    Args:
        series: channels that were simulated.
        records: the records, for their speeds.
    """
    figures = []
    for one in series[:_MOST]:
        figures += _figures(one, _speed(one, series, records[one.record]))
    remarks = [f"Only the first {_MOST} of {len(series)} channels are shown."] if len(series) > _MOST else []
    return Section(
        "Residuals",
        text="What is left over should be noise: without a shape over time, normal, without memory, and with a flat "
        "spectrum. A shape over the speed points to friction. Over time they are in the "
        "channel's unit, at the right and elsewhere in units of the standard deviation, where one is given.",
        figures=tuple(figures),
        remarks=tuple(remarks),
    )


def _figures(one: Compared, speed: tuple[str, str, np.ndarray] | None) -> list[Figure]:
    weighted = one.weighted
    values = one.error if weighted is None else weighted
    unit = one.unit if weighted is None else "-"
    period = float(np.median(np.diff(one.times)))
    name = one.name
    figures = [
        Figure(
            partial(_over_time, one, unit),
            f"Residual of {name} over time",
            f"{name}: residual over time.",
            wide=True,
            height=1.6,
        ),
        Figure(
            partial(_histogram, values, unit),
            f"Histogram of the residual of {name} with the normal density",
            f"{name}: distribution, against a normal one of the same mean and deviation.",
        ),
        Figure(
            partial(_autocorrelation, values),
            f"Autocorrelation of the residual of {name} with the band of white noise",
            f"{name}: autocorrelation. The band holds 95 % of the lags of white noise.",
        ),
        Figure(
            partial(_spectrum, values, period, unit),
            f"Spectrum of the residual of {name}",
            f"{name}: spectrum. The line is white noise of the same deviation.",
            wide=speed is None,
            height=2.4 if speed is not None else 1.6,
        ),
    ]
    if speed is not None:
        channel, speed_unit, over = speed
        figures.append(
            Figure(
                partial(_over_speed, over, values, f"{channel} [{speed_unit}]", f"residual [{unit}]"),
                f"Residual of {name} over {channel}",
                f"{name}: residual over {channel}.",
            )
        )
    return figures


def _speed(one: Compared, series: Sequence[Compared], record: Record) -> tuple[str, str, np.ndarray] | None:
    """A speed along the record: simulated ones first, as they are free of noise."""
    if one.speed is not None:
        return one.speed
    for other in series:
        if other.record == one.record and other.unit in _SPEEDS:
            return other.channel, other.unit, other.simulated
    for channel, unit in record.units.items():
        if unit in _SPEEDS:
            return channel, unit, np.asarray(record.channel(channel))
    return None


def _over_time(one: Compared, unit: str, axes: np.ndarray) -> None:
    """In the channel's unit; in units of the standard deviation at the right, where it is one number."""
    ax, scale = axes[0], one.deviation
    single = scale is not None and scale.ndim == 0
    values = one.weighted if scale is not None and not single else one.error
    assert values is not None
    kept = thinned(ax, values)
    ax.plot(*with_gaps(one.times, kept, values), color="C0", lw=0.6)
    ax.axhline(0, color="0.4", lw=0.6)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"{one.channel}\nresidual [{one.unit if single or scale is None else unit}]")
    ax.margins(x=0)
    if single and scale is not None:
        sigma = float(scale)
        right = ax.secondary_yaxis("right", functions=(lambda y: y / sigma, lambda y: y * sigma))
        right.set_ylabel("over deviation [-]")


def _histogram(values: np.ndarray, unit: str, axes: np.ndarray) -> None:
    plot_histogram(values, ax=axes[0])
    axes[0].set_xlabel(f"residual [{unit}]")
    axes[0].set_ylabel("density [-]" if unit == "-" else f"density [1/({unit})]")


def _autocorrelation(values: np.ndarray, axes: np.ndarray) -> None:
    plot_autocorrelation(values, ax=axes[0])


def _spectrum(values: np.ndarray, period: float, unit: str, axes: np.ndarray) -> None:
    plot_spectrum(values, period, unit=unit, ax=axes[0])


def _over_speed(speed: np.ndarray, values: np.ndarray, xlabel: str, ylabel: str, axes: np.ndarray) -> None:
    plot_residual(speed, {"residual": values}, xlabel=xlabel, ylabel=ylabel, ax=axes[0])
    if values.size <= _FEW:
        axes[0].lines[0].set(markersize=3.0)
    legend = axes[0].get_legend()
    if legend is not None:
        legend.remove()
