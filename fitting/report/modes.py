"""Section: natural frequencies, damping and shapes."""

from functools import partial

import numpy as np
from jaxtyping import ArrayLike

from fitting.report.content import Cell, Figure, Section, Table, number_cells
from fitting.report.numbers import percent, plain, with_error
from twin._checks import InputError
from twin.modal.damped import DampedModes
from twin.modal.undamped import Modes

_MOST_DRAWN = 6


def modes_section(
    modes: Modes | DampedModes,
    *,
    deviation: ArrayLike | None = None,
    measured: Modes | DampedModes | None = None,
    most: int = 20,
) -> Section:
    """Modes of a model: frequencies and damping ratios as a table, shapes at the outputs as pictures.

    Args:
        modes: modes of the model.
        deviation: standard errors of the natural frequencies (modes,) [Hz], if known.
        measured: measured modes, paired with those of the model one by one.
        most: modes listed.

    Raises:
        InputError: another number of standard errors than modes.
    """
    frequency, damping = np.asarray(modes.frequency), np.asarray(modes.damping_ratio)
    errors = np.full(frequency.size, np.nan) if deviation is None else np.asarray(deviation, dtype=float)
    if errors.shape != frequency.shape:
        raise InputError(
            f"deviation has shape {errors.shape}, but there are {frequency.size} modes. Give one for each."
        )
    head = ("Mode", "Frequency [Hz]", "Damping ratio", "Largest at")
    if measured is not None:
        head += ("Measured [Hz]", "Deviation", "Measured damping")
    rows = []
    for i in range(min(most, frequency.size)):
        shape = np.abs(np.asarray(modes.output_shapes)[:, i])
        row = (
            Cell(str(i + 1)),
            *number_cells((with_error(float(frequency[i]), float(errors[i])), percent(float(damping[i])))),
        )
        row += (Cell(modes.outputs[int(np.argmax(shape))] if shape.size else "–", "name"),)
        if measured is not None:
            row += _beside(measured, i, float(frequency[i]))
        rows.append(row)
    remarks = (f"Only the first {most} of {frequency.size} modes are listed.",) if frequency.size > most else ()
    figures = [
        Figure(
            partial(_draw, modes, i),
            f"Shape of mode {i + 1} at {plain(float(frequency[i]))} Hz at the outputs",
            f"Mode {i + 1}, {plain(float(frequency[i]))} Hz: shape at the outputs, the largest set to one.",
            height=0.6 + 0.22 * min(len(modes.outputs), 20),
        )
        for i in range(min(_MOST_DRAWN, frequency.size))
        if 1 < len(modes.outputs) <= 20
    ]
    return Section("Modes", figures=tuple(figures), tables=(Table(head, tuple(rows), "Modes"),), remarks=remarks)


def _beside(measured: Modes | DampedModes, i: int, frequency: float) -> tuple[Cell, ...]:
    if i >= measured.frequency.size:
        return number_cells(("–", "–", "–"))
    other = float(measured.frequency[i])
    return number_cells((plain(other), percent(frequency / other - 1), percent(float(measured.damping_ratio[i]))))


def _draw(modes: Modes | DampedModes, i: int, axes: np.ndarray) -> None:
    shape = np.asarray(modes.output_shapes)[:, i]
    # A complex shape is turned so that its largest entry is real and positive.
    largest = shape[np.argmax(np.abs(shape))]
    values = np.real(shape / largest) if largest != 0 else np.zeros(shape.size)
    ax, rows = axes[0], np.arange(values.size)
    ax.barh(rows, values, height=0.55, color="C0")
    ax.axvline(0, color="0.4", lw=0.6)
    ax.set_yticks(rows, modes.outputs)
    ax.set_ylim(values.size - 0.5, -0.5)
    ax.set_xlim(-1.05, 1.05)
    ax.grid(False, axis="y")
    ax.set_xlabel("shape over its largest entry [-]")
