"""From a figure to a drawing inside the page: drawn by matplotlib, in the page's colours and letters."""

from typing import TYPE_CHECKING

from fitting.report.colours import PALETTE
from fitting.report.content import Figure
from fitting.report.numbers import given
from fitting.report.svg import in_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

WIDTHS = {"broad": 10.0, "narrow": 4.1, "all": 4.6}
"""Width of a drawing by the screen that it is for [inch]."""
_LETTERS_PER_INCH = 13

_STYLE = {
    "svg.fonttype": "none",
    "svg.hashsalt": "drivetwin",
    # Names of channels are not formulas.
    "text.parse_math": False,
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "axes.facecolor": "none",
    "axes.edgecolor": "0.6",
    "axes.labelcolor": "0.3",
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "xtick.color": "0.6",
    "ytick.color": "0.6",
    "xtick.labelcolor": "0.35",
    "ytick.labelcolor": "0.35",
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "axes.formatter.limits": (-4, 5),
    "legend.frameon": False,
    "savefig.dpi": 130,
}


def drawn(figure: Figure, screen: str, key: str) -> str:
    """A figure as an SVG element for the page.

    Args:
        figure: what to draw.
        screen: "broad", "narrow" or "all".
        key: beginning of all names inside the drawing; different for each drawing of a page.
    """
    import io
    import warnings

    import matplotlib.style
    from cycler import cycler
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure as Canvas

    style = {**_STYLE, "axes.prop_cycle": cycler(color=PALETTE)}
    with matplotlib.style.context(["default", style]), warnings.catch_warnings():
        canvas = Canvas(figsize=(WIDTHS[screen], figure.height * figure.panels + 0.35), layout="constrained")
        FigureCanvasSVG(canvas)
        # The browser has letters for names that matplotlib's font has not.
        warnings.filterwarnings("ignore", message="Glyph")
        axes = canvas.subplots(figure.panels, 1, sharex=True, squeeze=False).ravel()
        figure.draw(axes)
        _tidy(canvas, WIDTHS[screen], figure.panels)
        out = io.StringIO()
        canvas.savefig(out, format="svg", metadata={"Date": None})
    return in_page(out.getvalue(), key, figure.alt)


def _tidy(canvas: "Canvas", width: float, panels: int) -> None:
    """Legends above the axes, where they hide nothing; titles are the caption's business."""
    for ax in canvas.axes:
        ax.set_title("")
        _move_legend(ax, width)
        _label_powers(ax)
        room = int(_LETTERS_PER_INCH * canvas.get_figheight() / panels)
        ax.set_ylabel("\n".join(_shortened(line, max(room, 12)) for line in ax.get_ylabel().split("\n")))
        ax.set_xlabel(_shortened(ax.get_xlabel(), int(_LETTERS_PER_INCH * width)))
    canvas.align_ylabels()


def _move_legend(ax: "Axes", width: float) -> None:
    legend = ax.get_legend()
    if legend is None:
        return
    handles, labels = legend.legend_handles, [text.get_text() for text in legend.get_texts()]
    legend.remove()
    if not handles:
        return
    longest = max(len(label) for label in labels) + 5
    columns = max(1, min(len(labels), int(_LETTERS_PER_INCH * width) // longest))
    ax.legend(
        [handle for handle in handles if handle is not None],
        labels,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        fontsize=8.5,
        labelcolor="0.3",
        borderaxespad=0.2,
        borderpad=0.2,
        handlelength=1.5,
        columnspacing=1.4,
    )


def _label_powers(ax: "Axes") -> None:
    """Ticks of logarithmic axes, which matplotlib writes as formulas, in plain letters."""
    from matplotlib.ticker import FuncFormatter, LogFormatter, LogLocator, NullFormatter

    for axis in (ax.xaxis, ax.yaxis):
        if not isinstance(axis.get_major_formatter(), LogFormatter):
            continue
        low, high = axis.get_view_interval()
        if high < 30 * low:
            # Less than two powers in sight would leave the axis with one number or none.
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: _power(value)))
        axis.set_minor_formatter(NullFormatter())


def _power(value: float) -> str:
    text = given(value)
    return text.removeprefix("1·") if text.startswith("1·10") else text


def _shortened(text: str, most: int) -> str:
    """A text with its middle left out where it is too long."""
    if len(text) <= most:
        return text
    end = most // 2
    return f"{text[: most - end - 1]}…{text[-end:]}"
