"""Pictures of a machine's identification: deviations, runs of the small problems, responses against the reference."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fitting.identification.machine_selection import StiffnessSelection
from twin._axes import axes_or_new
from twin._checks import InputError
from twin.frf import FRF

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_deviations(
    deviation: Mapping[str, float],
    *,
    bins: int = 25,
    limits: tuple[float, float] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """Histogram of the deviations of identified parameters, with median and 5th and 95th percentile.

    As figures 6 and 8 of J. Ellinger and M. F. Zaeh, Machines 10 (2022) 535. The largest deviation is named.

    Args:
        deviation: relative deviation of each parameter, by name [%].
        bins: of the histogram.
        limits: ends of the histogram [%]; those of the deviations if not given.
        ax: axes to draw in; new ones if not given.

    Raises:
        InputError: no parameter, or one without a finite deviation.
    """
    values = np.asarray(list(deviation.values()), dtype=float)
    if values.size == 0 or not np.isfinite(values).all():
        raise InputError("deviation must hold at least one parameter, and a finite number for each.")
    from matplotlib.ticker import MaxNLocator

    ax = axes_or_new(ax, (4.6, 3.2))
    low, middle, high = np.percentile(values, (5, 50, 95))
    ax.hist(values, bins=bins, range=limits, color="0.75", edgecolor="0.35", lw=0.5)
    ax.axvline(middle, color="C0", lw=1.4, label=f"median {middle:.2g} %")
    for at in (low, high):
        ax.axvline(
            at, color="C3", lw=1.0, ls="--", label=f"5 to 95 %: {low:.2g} to {high:.2g} %" if at == low else None
        )
    worst = max(deviation, key=lambda name: abs(deviation[name]))
    ax.plot([], [], " ", label=f"largest: {worst}, {deviation[worst]:.2g} %")
    ax.set_xlabel("deviation from the true value [%]")
    ax.set_ylabel("parameters")
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_ylim(0, 1.45 * ax.get_ylim()[1])  # room for the legend
    ax.legend(fontsize="x-small", loc="upper left", edgecolor="none", framealpha=0.9)
    return ax


def plot_part_runs(
    selection: StiffnessSelection,
    path: str,
    *,
    truth: float | None = None,
    name: str | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """Where the runs of every problem that searched a stiffness ended, the chosen problem in red.

    As figure 2 of J. Ellinger and M. F. Zaeh, Machines 10 (2022) 535. Failed runs are left out.

    Args:
        selection: stiffnesses chosen.
        path: the stiffness.
        truth: its true value, drawn as a line if known [N/m, Nm/rad].
        name: what to write instead of its path.
        ax: axes to draw in; new ones if not given.

    Raises:
        InputError: a stiffness that was not searched for.
    """
    runs = selection.runs
    if path not in runs.paths:
        raise InputError(f"{path!r} is no stiffness of these runs, which are {', '.join(runs.paths)}.")
    number = runs.paths.index(path)
    problems = np.flatnonzero(runs.searched[:, number])
    ax = axes_or_new(ax, (max(5.0, 1.6 + 0.2 * problems.size), 3.6))
    rng = np.random.default_rng(0)
    for at, problem in enumerate(problems):
        chosen = problem == selection.problem[number]
        ends = runs.value[problem, ~runs.failed[problem], number]
        colour = "C3" if chosen else "0.45"
        # Beside each other: ends on top of each other could not be told from a single one.
        ax.plot(at + rng.uniform(-0.28, 0.28, ends.size), ends, ".", ms=2.5, color=colour, alpha=0.6)
        if ends.size:
            ax.plot([at - 0.38, at + 0.38], [ends.mean()] * 2, color=colour, lw=2.0 if chosen else 1.0)
    if truth is not None:
        ax.axhline(truth, color="C0", lw=1.0, ls="--", label="true value")
    ax.plot([], [], color="C3", lw=2.0, label="chosen problem: mean")
    ax.plot([], [], color="0.45", lw=1.0, label="other problems: mean")
    bound = runs.space[path]
    ax.set_ylim(bound.lower - 0.03 * (bound.upper - bound.lower), bound.upper + 0.03 * (bound.upper - bound.lower))
    ax.set_xticks(np.arange(problems.size), [runs.problems[i] for i in problems], rotation=90, fontsize="x-small")
    ax.set_ylabel(f"{name or path} [{bound.unit}]")
    ax.legend(fontsize="small", ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False)
    return ax


def plot_conformity(
    reference: FRF,
    models: Mapping[str, FRF],
    response: str,
    excitation: str,
    *,
    unit: str = "m/N",
    linear: tuple[float, float] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """Magnitude of a reference response and of models, with a stretch on a linear scale as an inset.

    As figures 7 and 9 of J. Ellinger and M. F. Zaeh, Machines 10 (2022) 535.

    Args:
        reference: the reference.
        models: models, by what they are.
        response: name of the response.
        excitation: name of the excitation.
        unit: unit of the response per excitation.
        linear: frequencies that the inset shows [Hz]; no inset if not given.
        ax: axes to draw in; new ones if not given.
    """
    ax = axes_or_new(ax, (8.2, 4.6))
    inset = None if linear is None else ax.inset_axes((0.5, 0.56, 0.48, 0.41))
    for panel in (ax, inset):
        if panel is None:
            continue
        scale = 1.0 if panel is ax else 1e6
        panel.plot(
            reference.frequency, scale * _size(reference, response, excitation), color="0.1", lw=2.2, label="reference"
        )
        for i, (name, model) in enumerate(models.items()):
            style = {"color": f"C{i}", "lw": 1.1, "ls": ("-", "--", ":", "-.")[i % 4]}
            panel.plot(model.frequency, scale * _size(model, response, excitation), label=name, **style)
    ax.set_yscale("log")
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel(f"|{response} / force {excitation}| [{unit}]")
    ax.margins(x=0)
    ax.grid(True, which="both", alpha=0.2)
    ax.legend(fontsize="small", loc="lower left")
    if inset is not None and linear is not None:
        inside = (np.asarray(reference.frequency) >= linear[0]) & (np.asarray(reference.frequency) <= linear[1])
        top = max(1e6 * _size(one, response, excitation)[inside].max() for one in (reference, *models.values()))
        inset.set_xlim(*linear)
        inset.set_ylim(0, 1.08 * top)
        inset.set_ylabel(f"[10⁻⁶ {unit}]", fontsize="x-small")
        inset.tick_params(labelsize="x-small")
        ax.axvspan(*linear, color="0.9", zorder=0)
        ax.set_ylim(top=ax.get_ylim()[1] * 30)  # room for the inset
    return ax


def _size(frf: FRF, response: str, excitation: str) -> np.ndarray:
    return np.abs(np.asarray(frf[response, excitation]))
