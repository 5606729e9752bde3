"""What is to be said about each measured mode."""

import numpy as np

# Lines within a half-power bandwidth below which damping is hardly seen.
_FEW_LINES = 2.0
# Half-power bandwidths from the band's end, and from a neighbour, within which modes run together.
_EDGE, _CLOSE = 2.0, 1.0
_COMPLEX, _HEAVY, _UNCERTAIN = 0.8, 0.1, 0.2


def verdicts(
    frequency: np.ndarray,
    damping_ratio: np.ndarray,
    damping_error: np.ndarray,
    collinearity: np.ndarray,
    seen: np.ndarray,
    lines: np.ndarray,
) -> tuple[str, ...]:
    """A word on each mode: "good", or what may be wrong with it.

    Args:
        frequency: natural frequencies (modes,) [Hz].
        damping_ratio: damping ratios [-].
        damping_error: their standard errors [-].
        collinearity: modal phase collinearity of the shapes [-].
        seen: share of the orders at which each was stable [-].
        lines: frequencies of the lines [Hz].
    """
    step = float(np.median(np.diff(lines)))
    found = []
    for i, f in enumerate(frequency):
        width = 2 * damping_ratio[i] * f
        others = np.delete(frequency, i)
        told = []
        if not damping_error[i] <= _UNCERTAIN * damping_ratio[i]:
            told.append("damping uncertain")
        if width < _FEW_LINES * step:
            told.append(f"{width / step:.1f} lines within its bandwidth")
        if min(f - lines[0], lines[-1] - f) < _EDGE * width:
            told.append("at the band's end")
        if others.size and np.min(np.abs(others - f)) < _CLOSE * width:
            told.append("close to another")
        if collinearity[i] < _COMPLEX:
            told.append("complex shape")
        if damping_ratio[i] > _HEAVY:
            told.append("heavily damped")
        if seen[i] < 1 / 3:
            told.append("rarely stable")
        found.append(", ".join(told) or "good")
    return tuple(found)
