"""The picture of the README: the first fit, measured against fitted, with its table of parameters.

Run it where `axis.csv` of `docs/examples/make_axis_csv.py` lies: `python docs/picture.py first_fit.png`.
"""

import runpy
import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot

from twin.references import SampledReference
from twin.simulation import simulate

EXAMPLES = Path(__file__).parent / "examples"
GREY, BLUE, INK = "0.62", "#1f6fb4", "0.15"


def draw(file: Path) -> None:
    """Fit and draw."""
    result = runpy.run_path(str(EXAMPLES / "first_fit.py"))
    record, found = result["record"], result["result"]
    truth = runpy.run_path(str(EXAMPLES / "make_axis_csv.py"))["true_axis"]().plant
    times = np.asarray(record.times)
    fitted = simulate(found.model, SampledReference(record.times, record.channel("set")), record.times)
    pyplot.rcParams.update({"font.size": 9, "text.color": INK, "axes.labelcolor": INK, "axes.edgecolor": "0.6"})
    figure = pyplot.figure(figsize=(10, 4.1), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1.05, 1))
    axes = left.subplots(3, 1, sharex=True)
    for ax, name, factor, label in (
        (axes[0], "position", 1e3, "position [mm]"),
        (axes[1], "command", 1.0, "current [A]"),
    ):
        ax.plot(times, factor * np.asarray(record.channel(name)), color=GREY, lw=2, label="measured")
        ax.plot(times, factor * np.asarray(fitted.channel(name)), color=BLUE, lw=0.8, label="fitted")
        ax.set_ylabel(label)
    error = 1e6 * (np.asarray(record.channel("position")) - np.asarray(fitted.channel("position")))
    axes[2].plot(times, error, color=BLUE, lw=0.4)
    axes[2].set_ylabel("left over [µm]")
    axes[2].set_xlabel("time [s]")
    axes[0].legend(frameon=False, ncols=2, loc="upper right")
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.margins(x=0)
    _table(right.subplots(), found, truth)
    figure.savefig(file, dpi=130)


def _table(ax, found, truth) -> None:
    names = {"plant.mass": "mass", "plant.offset": "offset"}
    true = {"plant.mass": truth.mass, "plant.offset": truth.offset}
    for path in found.space.paths:
        if path.startswith("plant.friction."):
            field = path.rsplit(".", 1)[-1]
            names[path], true[path] = field.replace("_", " "), getattr(truth.friction, field)
    rows = []
    for path, interval in zip(found.space.paths, np.asarray(found.intervals()), strict=True):
        digits = 4 if "velocity" in path else 2
        low, high = (f"{bound:.{digits}f}" for bound in interval)
        rows.append([names[path], f"{found[path].value:.{digits}f}", f"{low} … {high}", f"{float(true[path]):g}"])
        rows[-1].insert(1, found[path].unit)
    heads = ["parameter", "unit", "estimate", "95 % interval", "truth"]
    table = ax.table(
        rows,
        colLabels=heads,
        loc="center",
        cellLoc="right",
        edges="horizontal",
        colWidths=(0.27, 0.13, 0.17, 0.31, 0.12),
    )
    table.auto_set_font_size(False)
    table.set_fontsize(9)
    table.scale(1, 1.75)
    for (row, column), cell in table.get_celld().items():
        cell.set_edgecolor("0.85")
        if row == 0:
            cell.get_text().set_color("0.45")
        if column < 2:
            cell.get_text().set_ha("left")
            cell.PAD = 0.02
        if row and column == 2:
            cell.get_text().set_fontweight("bold")
    ax.set_axis_off()


if __name__ == "__main__":
    draw(Path(sys.argv[1] if len(sys.argv) > 1 else "first_fit.png"))
