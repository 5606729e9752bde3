"""`drivetwin frf`: frequency response of the model of a study, beside measured ones where there are any.

[frf]
from = "1 Hz"
to = "500 Hz"
lines = 800
inputs = ["command"]
outputs = ["position"]
velocity = "0.1 m/s"         # friction counts by its slope at this speed
"""

from pathlib import Path

import numpy as np

from fitting.commands._outcome import Outcome
from fitting.study.data import data_names
from fitting.study.model_modes import linear_model
from fitting.study.operating_point import KEYS, operating_point
from fitting.study.responses import ResponseData, read_response
from fitting.study.study_file import StudyFile
from fitting.study.units_of_outputs import output_units
from fitting.study.written import write_run
from twin._checks import InputError
from twin.export.frf_csv import write_frf_csv
from twin.frf import FRF
from twin.linear import frequency_response


def run_frf(study: StudyFile, out: Path) -> Outcome:
    """Compute the response, and write `frf.csv`, `frf.png` and `summary.json`.

    Args:
        study: the study.
        out: folder for the results.

    Raises:
        InputError: naming line and key: an unknown input or output, a range that is none.
    """
    table = study.table("frf", known=("from", "to", "lines", "inputs", "outputs", *KEYS))
    low = table.quantity("from", "1 Hz", units=("Hz",), positive=True).value
    high = table.quantity("to", "500 Hz", units=("Hz",), positive=True).value
    if not low < high:
        raise table.error("to", f"{high:g} Hz does not lie above `from`, {low:g} Hz. Exchange them.")
    frequency = np.geomspace(low, high, table.integer("lines", 800, least=2))
    try:
        system = linear_model(study.model, operating_point(table, study.model))
        wanted = {
            "inputs": table.texts("inputs", system.inputs[:1]),
            "outputs": table.texts("outputs", system.outputs[:2]),
        }
        frf = frequency_response(system, frequency, **wanted)
    except InputError as error:
        raise table.error("", str(error)) from error
    measured = [read_response(study, name) for name in data_names(study, "frf")]
    units = output_units(study)
    write_frf_csv(out / "frf.csv", frf, units={(o, i): units.get(o, "") for o in frf.outputs for i in frf.inputs})
    _draw(out / "frf.png", study.title, frf, measured)
    peaks = {f"{o} / {i}": _peaks(frf, o, i) for o in frf.outputs for i in frf.inputs}
    summary = {"from": low, "to": high, "lines": frequency.size, "peaks": peaks}
    write_run(study, out, "frf", summary)
    lines = [f"{name}: " + (", ".join(f"{f:.4g} Hz" for f in listed) or "no peak") for name, listed in peaks.items()]
    return Outcome("\n".join([f"{study.title}: peaks of the response", *lines, f"Results in {out}"]), summary)


def _peaks(frf: FRF, output: str, excitation: str) -> list[float]:
    from scipy.signal import find_peaks

    size = np.log(np.abs(np.asarray(frf[output, excitation])) + np.finfo(float).tiny)
    found, _ = find_peaks(size, prominence=0.05)
    return np.asarray(frf.frequency)[found].tolist()


def _draw(file: Path, title: str, frf: FRF, measured: list[ResponseData]) -> None:
    from matplotlib import pyplot

    from fitting.plots import save_figure

    pairs = [(o, i) for o in frf.outputs for i in frf.inputs]
    figure, axes = pyplot.subplots(
        2, len(pairs), figsize=(1.5 + 4.5 * len(pairs), 5), layout="constrained", sharex=True, squeeze=False
    )
    for (upper, lower), (output, excitation) in zip(axes.T, pairs, strict=True):
        for one in measured:
            if output in one.outputs and excitation in one.inputs:
                values = one.measured.values[one.outputs.index(output), one.inputs.index(excitation)]
                upper.loglog(
                    one.measured.frequency, np.abs(values), ".", ms=2, color="0.6", label=f"measured, {one.name}"
                )
                lower.semilogx(one.measured.frequency, np.degrees(np.angle(values)), ".", ms=2, color="0.6")
        values = np.asarray(frf[output, excitation])
        upper.loglog(frf.frequency, np.abs(values), lw=1.2, label="model")
        lower.semilogx(frf.frequency, np.degrees(np.angle(values)), lw=1.2)
        upper.set_title(f"{output.replace('_', ' ')} / {excitation.replace('_', ' ')}", fontsize="medium")
        lower.set_xlabel("frequency [Hz]")
        lower.set_yticks(range(-180, 181, 90))
        if measured:
            upper.legend(frameon=False, fontsize="small")
    axes[0, 0].set_ylabel("magnitude [output per input, SI]")
    axes[1, 0].set_ylabel("phase [deg]")
    figure.suptitle(title)
    save_figure(figure, file)
