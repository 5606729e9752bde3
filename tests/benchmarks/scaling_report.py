"""What the scaling curves leave behind: a table each, crossovers against another machine, pictures."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax

from tests.benchmarks.scaling import Curve, crossover


def as_markdown(curves: Sequence[Curve], pictures: Sequence[str], earlier: Sequence[dict[str, Any]] | None) -> str:
    """Tables of the curves.

    Args:
        curves: the curves.
        pictures: names of the files.
        earlier: those of another machine, to tell from which size on this one is ahead; None for none.
    """
    device = f"{jax.devices()[0].device_kind} ({jax.default_backend()})"
    lines = ["## How time grows", "", f"Device: {device}. Pictures: {', '.join(pictures)}.", ""]
    for one in curves:
        lines += [
            f"### {one.name}, against {one.item}",
            "",
            f"Time grows with exponent {one.exponent:.2f} over all sizes, {one.last_exponent:.2f} between the last two."
            + _compared(one, earlier),
            "",
            f"| {one.item} | median [ms] | range of turns [ms] | per item [ms] | items per second |",
            "|---|---|---|---|---|",
        ]
        for size, times, median in zip(one.sizes, one.seconds, one.medians, strict=True):
            spread = f"{1e3 * min(times):.4g} to {1e3 * max(times):.4g}" if len(times) > 1 else ""
            lines.append(
                f"| {size} | {1e3 * median:.4g} | {spread} | {1e3 * median / size:.4g} | {size / median:.4g} |"
            )
        lines.append("")
    return "\n".join(lines)


def _compared(one: Curve, earlier: Sequence[dict[str, Any]] | None) -> str:
    there = next((other for other in earlier or () if other["name"] == one.name), None)
    if there is None:
        return ""
    size = crossover(one, there)
    told = "at no size measured" if size is None else f"from {size:.3g} {one.item} on"
    return f" Ahead of the run compared with {told}."


def write_pictures(curves: Sequence[Curve], folder: Path) -> list[str]:
    """One picture for each group of curves: time against size, on logarithmic axes.

    Args:
        curves: the curves.
        folder: where the pictures go.

    Returns:
        Names of the files.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    files = []
    for group in dict.fromkeys(one.group for one in curves):
        figure, axes = plt.subplots(figsize=(6.4, 4.4), layout="constrained")
        for one in (c for c in curves if c.group == group):
            medians = one.medians
            low, high = ([f(times) for times in one.seconds] for f in (min, max))
            spread = (medians - low, high - medians)
            label = f"{one.name} (exponent {one.last_exponent:.2f} at the end)"
            axes.errorbar(one.sizes, medians, yerr=spread, marker="o", capsize=3, label=label)
            axes.set_xlabel(f"number of {one.item} [-]")
        axes.set(xscale="log", yscale="log", ylabel="time [s]")
        axes.set_title(f"Time against {group}: median and range of turns")
        axes.grid(visible=True, which="both", alpha=0.3)
        axes.legend()
        name = f"scaling_{group}.png"
        figure.savefig(folder / name, dpi=120)
        plt.close(figure)
        files.append(name)
    return files
