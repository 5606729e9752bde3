"""Long records drawn with few points: the least and the greatest sample of each pixel, so that no peak is lost."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import ArrayLike

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PIXELS_PER_INCH = 96
# Steps longer than so many usual ones are gaps.
_GAP = 3.0


def thinned(ax: "Axes", *series: ArrayLike) -> np.ndarray:
    """Which samples to draw: for each pixel of the axes the first, and the least and greatest of each series.

    Args:
        ax: axes to draw in.
        series: samples on one axis of times (samples,), at least one series.

    Returns:
        Numbers of the samples, rising; all of them where they are few.
    """
    figure = ax.get_figure(root=True)
    width = 7.0 if figure is None else figure.get_size_inches()[0]
    return extremes(series, int(_PIXELS_PER_INCH * width))


def with_gaps(times: np.ndarray, kept: np.ndarray, *series: np.ndarray) -> tuple[np.ndarray, ...]:
    """The samples to draw, with a NaN where some were left out, so that no line is drawn across.

    Args:
        times: times of all samples (samples,) [s].
        kept: numbers of the samples to draw, rising.
        series: samples (samples,).

    Returns:
        Times, then each series.
    """
    steps = np.diff(times)
    after = np.flatnonzero(steps > _GAP * np.median(steps)) if steps.size else np.empty(0, dtype=int)
    places = np.searchsorted(kept, after, side="right")
    return tuple(
        np.insert(np.asarray(values, dtype=float)[kept], places, filling)
        for values, filling in ((times, times[after]), *((one, np.nan) for one in series))
    )


def extremes(series: tuple[ArrayLike, ...], pixels: int) -> np.ndarray:
    """As `thinned`, for a number of pixels.

    Args:
        series: samples on one axis of times, (samples,) each.
        pixels: pixels to draw them in.
    """
    rows = [np.asarray(values, dtype=float) for values in series]
    count = rows[0].size
    if count <= 3 * pixels:
        return np.arange(count)
    edges = np.linspace(0, count, pixels + 1).astype(int)[:-1]
    kept = [edges, [count - 1]]
    for values in rows:
        finite = np.where(np.isfinite(values), values, 0.0)
        kept += [_arg(finite, edges, np.argmin), _arg(finite, edges, np.argmax)]
    return np.unique(np.concatenate(kept))


def _arg(values: np.ndarray, edges: np.ndarray, pick: Callable[[np.ndarray], np.intp]) -> np.ndarray:
    return np.array([start + pick(part) for start, part in zip(edges, np.split(values, edges[1:]), strict=True)])
