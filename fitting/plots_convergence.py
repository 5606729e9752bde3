"""How fits came down: cost over steps."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fitting.result import FitResult
from twin._axes import axes_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_convergence(
    fits: FitResult | Mapping[str, FitResult], *, above: bool = False, ax: "Axes | None" = None
) -> "Axes":
    """Cost after each step, of one fit or of several; the last step of a fit that did not converge is a cross.

    Args:
        fits: a fit, or fits by name.
        above: draw the distance above the lowest cost of all, which shows how fast the ends were approached.
        ax: axes to draw in; new ones if not given.
    """
    from matplotlib.ticker import MaxNLocator

    ax = axes_or_new(ax)
    several = {"": fits} if isinstance(fits, FitResult) else dict(fits)
    histories = {name: np.asarray(fit.cost_history) for name, fit in several.items()}
    finite = [history[np.isfinite(history)] for history in histories.values()]
    lowest = min((float(h.min()) for h in finite if h.size), default=0.0)
    for i, (name, fit) in enumerate(several.items()):
        state = "converged" if fit.success else "not converged"
        cost = histories[name] - lowest if above else histories[name]
        # Zero has no place on a logarithmic axis.
        cost = np.where(cost > 0, cost, np.nan)
        steps = np.arange(cost.size)
        ax.plot(steps, cost, ".-", color=f"C{i}", label=f"{name}, {state}" if name else state)
        drawn = np.flatnonzero(np.isfinite(cost))
        if not fit.success and drawn.size:
            ax.plot(steps[drawn[-1]], cost[drawn[-1]], "x", color=f"C{i}", ms=9, mew=2)
    ax.set_yscale("log")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlabel("step")
    ax.set_ylabel("cost above the lowest [-]" if above else "cost: half the sum of squares [-]")
    if several:
        ax.legend(fontsize="small")
    ax.grid(True, which="major", alpha=0.3)
    return ax
