"""Pictures of a measurement: traces over time, spectra, frequency responses."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from twin.io.measurement import MeasuredChannel, Measurement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROWS, _PAGES, _POINTS = 6, 6, 4000


def save_looks(measurement: Measurement, folder: Path) -> list[Path]:
    """Draw all channels and save the pictures as PNG.

    Args:
        measurement: what was read.
        folder: where they go; it exists.

    Returns:
        The files, named by kind and page, never by what the file says.
    """
    over_time = [one for one in measurement if one.abscissa != "frequency" and one.values.dtype.kind == "f"]
    over_frequency = [one for one in measurement if one.abscissa == "frequency"]
    sampled = [one for one in over_time if one.rate is not None and one.values.size >= 32]
    files = []
    for kind, channels, draw in (
        ("traces", over_time, _trace),
        ("spectra", sampled, _spectrum),
        ("responses", over_frequency, _response),
    ):
        rows = _ROWS if kind != "responses" else _ROWS // 2
        for page in range(min(_PAGES, -(-len(channels) // rows))):
            figure = _page(channels[page * rows : (page + 1) * rows], draw, kind, measurement.name)
            files.append(folder / f"{kind}_{page + 1}.png")
            figure.savefig(files[-1], dpi=110)
    return files


def _page(channels: list[MeasuredChannel], draw, kind: str, title: str) -> "Figure":
    from matplotlib.figure import Figure

    each = 2 if kind == "responses" else 1
    count = each * len(channels)
    figure = Figure(figsize=(9, 1.2 + 1.7 * count), layout="constrained")
    axes = figure.subplots(count, 1, sharex=kind != "responses" or len(channels) == 1, squeeze=False)[:, 0]
    for number, channel in enumerate(channels):
        draw(channel, *axes[each * number : each * (number + 1)])
    figure.suptitle(_plain(f"{title}: {kind}"), fontsize=11)
    axes[-1].set_xlabel(_abscissa(channels[-1]) if kind == "traces" else "frequency [Hz]")
    return figure


def _trace(channel: MeasuredChannel, axes: "Axes") -> None:
    times = np.arange(channel.values.size) if channel.times is None else channel.times
    times, low, high = _envelope(times, channel.values)
    if low is high:
        axes.plot(times, low, linewidth=0.9)
    else:
        axes.fill_between(times, low, high, linewidth=0.6, edgecolor="C0")
    _label(axes, channel)


def _envelope(times: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, least and largest values of blocks, so that no spike is lost in long traces."""
    block = values.size // _POINTS
    if block < 2:
        return times, values, values
    kept = values.size // block * block
    blocks = values[:kept].reshape(-1, block)
    return times[:kept:block], np.nanmin(blocks, axis=1), np.nanmax(blocks, axis=1)


def _spectrum(channel: MeasuredChannel, axes: "Axes") -> None:
    values = np.nan_to_num(channel.values - np.nanmean(channel.values), posinf=0.0, neginf=0.0)
    window = np.hanning(values.size)
    amplitude = 2 * np.abs(np.fft.rfft(values * window)) / window.sum()
    frequency = np.arange(amplitude.size) * (channel.rate or 1.0) / values.size
    frequency, _, high = _envelope(frequency[1:], amplitude[1:])
    axes.semilogy(frequency, np.maximum(high, 1e-9 * max(float(np.max(high)), 1e-300)), linewidth=0.8)
    axes.grid(True, alpha=0.3)
    _label(axes, channel)


def _response(channel: MeasuredChannel, magnitude: "Axes", phase: "Axes") -> None:
    frequency = channel.times if channel.times is not None else np.arange(channel.values.size)
    shown = frequency > 0
    draw = magnitude.loglog if np.all(np.abs(channel.values[shown]) > 0) and shown.any() else magnitude.plot
    draw(frequency[shown], np.abs(channel.values[shown]), linewidth=0.9)
    _label(magnitude, channel)
    degrees = np.angle(channel.values[shown], deg=True)
    phase.plot(frequency[shown], degrees, linewidth=0.9)
    phase.set_xscale(magnitude.get_xscale())
    phase.set(ylabel="phase [deg]", ylim=(-190, 190), yticks=(-180, -90, 0, 90, 180))
    phase.set_xlabel("frequency [Hz]")
    for axes in (magnitude, phase):
        axes.grid(True, alpha=0.3)


def _label(axes: "Axes", channel: MeasuredChannel) -> None:
    axes.set_ylabel(_plain(f"{channel.name[:24]}\n[{channel.unit or '?'}]"), fontsize=8)
    axes.grid(True, alpha=0.3)


def _abscissa(channel: MeasuredChannel) -> str:
    return "sample" if channel.times is None else "time [s]"


def _plain(text: str) -> str:
    return text.replace("$", r"\$")  # or it would be read as a formula
