"""Tables of measured modes: for readers, for programs, for other tools."""

from pathlib import Path
from typing import Any

import numpy as np

from fitting.identification.modal_result import ModalAnalysis
from twin.io.modes_uff import write_modes_uff


def summarise(analysis: ModalAnalysis, source: str) -> dict[str, Any]:
    """What is known of the modes, as plain numbers.

    Args:
        analysis: the analysis.
        source: where the responses come from.
    """
    rows = zip(
        analysis.frequency,
        analysis.frequency_error,
        analysis.damping_ratio,
        analysis.damping_error,
        analysis.phase_collinearity,
        analysis.share,
        analysis.verdict,
        strict=True,
    )
    intervals = dict(zip(("frequency", "damping_ratio"), analysis.intervals, strict=True))
    names = ("frequency", "frequency_error", "damping_ratio", "damping_error", "phase_collinearity", "share")
    return {
        "source": source,
        "converged": analysis.success,
        "message": analysis.message,
        "band": [float(analysis.measured.frequency[0]), float(analysis.measured.frequency[-1])],
        "form": analysis.measured.form,
        "reciprocal": analysis.reciprocal,
        "outputs": list(analysis.measured.outputs),
        "inputs": list(analysis.measured.inputs),
        "mass_normalised": analysis.mass_normalised,
        "error": analysis.error,
        "modes": [
            {
                **{name: float(value) for name, value in zip(names, row[:-1], strict=True)},
                **{f"{name}_95": ends[i].tolist() for name, ends in intervals.items()},
                "verdict": row[-1],
            }
            for i, row in enumerate(rows)
        ],
        "warnings": list(analysis.warnings),
        "remarks": list(analysis.remarks),
    }


def write_modes_csv(analysis: ModalAnalysis, file: Path) -> None:
    """Write the table of modes, with standard errors and 95 % intervals.

    Args:
        analysis: the analysis.
        file: where to.
    """
    table = analysis.to_dataframe()
    frequency, ratio = analysis.intervals
    for place, name, values in (
        (2, "95 % from [Hz]", frequency[:, 0]),
        (3, "95 % to [Hz]", frequency[:, 1]),
        (6, "damping ratio 95 % from", ratio[:, 0]),
        (7, "damping ratio 95 % to", ratio[:, 1]),
    ):
        table.insert(place, name, values)
    table.to_csv(file)


def write_modes_toml(analysis: ModalAnalysis, summary: dict[str, Any], file: Path) -> None:
    """Write the modes with their real shapes.

    Args:
        analysis: the analysis.
        summary: what `summarise` gave.
        file: where to.
    """
    import tomlkit

    document = tomlkit.document()
    document.add(tomlkit.comment("Modes from measured frequency responses. Frequencies in Hz, damping ratios plain."))
    document.add(tomlkit.comment("..._error is a standard error, ..._95 an interval of 95 %."))
    for key in (
        "source",
        "converged",
        "band",
        "form",
        "reciprocal",
        "inputs",
        "outputs",
        "mass_normalised",
        "error",
        "remarks",
    ):
        document.add(key, summary[key])
    shapes = analysis.to_modes().output_shapes
    table = tomlkit.aot()
    for i, mode in enumerate(summary["modes"]):
        one = tomlkit.table()
        for key, value in mode.items():
            one.add(key, value)
        one.add("shape", [float(x) for x in np.asarray(shapes[:, i])])
        table.append(one)
    document.add("mode", table)
    file.write_text(tomlkit.dumps(document), encoding="utf-8")


def write_shapes(analysis: ModalAnalysis, out: Path, source: str = "", component: str = "") -> None:
    """Write `shapes.csv`, and `shapes.uff` where rows are named by node and direction.

    Args:
        analysis: the analysis.
        out: folder.
        source: where the responses come from.
        component: name of the structure.
    """
    import pandas as pd

    from twin._input_error import InputError

    shapes = analysis.shapes_dataframe()
    parts = {}
    for i, name in enumerate(shapes.columns):
        column = shapes.iloc[:, i].to_numpy()
        number = f"mode {i + 1} ({name})"
        parts |= {f"{number} real": column.real, f"{number} imaginary": column.imag}
        parts[f"{number} standard error"] = analysis.shape_errors[:, i]
    pd.DataFrame(parts, index=shapes.index).to_csv(out / "shapes.csv")
    try:
        normalised = analysis.mass_normalised
        notes = (f"measured: {source}" if source else "", f"component: {component}" if component else "")
        write_modes_uff(out / "shapes.uff", analysis.to_modes(), mass_normalised=normalised, notes=notes)
    except InputError:
        return  # rows without node and direction; the tables have everything
