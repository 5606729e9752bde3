"""Report on the two-inertia bench: what the fit to record A says about record B, in numbers, parameters and plots."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from fitting.identification.two_inertia_bench import (
    EXCITATION,
    RESPONSES,
    SCATTER,
    STATED_SCATTER,
    BenchPrediction,
    bench_distortion,
    predict_bench,
    relative_scatter,
    share_within,
)
from fitting.identification.two_mass import two_mass_response
from fitting.json_file import write_json
from fitting.plots_frequency import plot_log_error, plot_magnitude, plot_phase
from twin.io.parameter_file import ParameterEntry, write_parameters

STATED_FREQUENCIES = {"resonance": 76.2, "antiresonance": 53.9}
"""Resonance and antiresonance stated with the data [Hz]."""
FREQUENCY_TOLERANCE = 0.005
"""Relative deviation of resonance and antiresonance that is accepted."""
SCATTER_FACTOR = 2.0
"""The log-magnitude error may be this many times the measurement's scatter."""


def reproduce_two_inertia(
    out_dir: str | os.PathLike[str], data: str | os.PathLike[str] | None = None
) -> dict[str, Any]:
    """Fit record A of the two-inertia bench, predict record B, and write down how well that goes.

    Writes `summary.json`, `parameters.toml`, `fit_A.png`, `prediction_B.png` and `residual_B.png`.

    Args:
        out_dir: folder for the files; made if it does not exist.
        data: folder with the two MAT-files; None looks for the data set by `twin.io.data.data_file`.

    Returns:
        The content of `summary.json`.

    Raises:
        DataNotFound: if no folder is given and the data set is found nowhere.
        InputError: if the files cannot be used.
    """
    prediction = predict_bench(data)
    folder = Path(out_dir)
    folder.mkdir(parents=True, exist_ok=True)
    summary = summarise(prediction)
    write_json(folder / "summary.json", summary)
    _write_parameters(prediction, folder / "parameters.toml")
    _plot(prediction, folder)
    return summary


def summarise(prediction: BenchPrediction) -> dict[str, Any]:
    """Everything that is known of the prediction, as plain numbers; relative quantities are plain, not percent.

    Args:
        prediction: of record B.
    """
    result = prediction.identification.result
    records = (prediction.fitted, prediction.predicted)
    return {
        "fit": {
            "converged": result.success,
            "message": result.message,
            "steps": result.steps,
            "reduced chi square": float(2 * result.cost / result.degrees_of_freedom),
            "condition number": result.condition_number,
            "parameters": {path: estimate._asdict() for path, estimate in result.estimates().items()},
            "remark": "in units of the torque constant; standard errors take the lines as independent and the drive as "
            "linear, and are lower bounds",
        },
        "records": {
            record.name: {
                "lines": int(record.measured.frequency.size),
                "periods used": list(record.spectra.used),
                "periods rejected as disturbed": list(record.spectra.rejected),
            }
            for record in records
        },
        "frequencies": _frequencies(prediction),
        "damping ratio": prediction.identification.modes.damping_ratio._asdict(),
        "log-magnitude error": {
            record: {name: _error(error) for name, error in errors.items()}
            for record, errors in prediction.errors.items()
        },
        "scatter": {
            key: {"meaning": SCATTER[key], **{name: size._asdict() for name, size in sizes.items()}}
            for key, sizes in prediction.scatter.items()
        },
        "prediction of B within twice the scatter": {
            key: {name: _verdict(prediction, key, name) for name in RESPONSES} for key in SCATTER
        },
        "remark on the prediction": "record B was looked at while the weighting was chosen: it is no untouched test",
        "share of lines of B within twice the total scatter of A": {
            name: share_within(prediction, name, SCATTER_FACTOR) for name in RESPONSES
        },
    }


def _error(error: Any) -> dict[str, float]:
    largest, at = error.largest
    return {**error.size._asdict(), "largest": largest, "largest at [Hz]": at}


def _frequencies(prediction: BenchPrediction) -> dict[str, Any]:
    modes = prediction.identification.modes
    sources = {
        "model fitted to A, undamped": (modes.resonance, modes.antiresonance),
        "model fitted to A, peak and dip of the motor": (modes.peak, modes.dip),
        "record A, regression": (prediction.fitted.closed_form.resonance, prediction.fitted.closed_form.antiresonance),
        "record B, regression": (
            prediction.predicted.closed_form.resonance,
            prediction.predicted.closed_form.antiresonance,
        ),
    }
    found: dict[str, Any] = {"stated [Hz]": STATED_FREQUENCIES, "tolerance": FREQUENCY_TOLERANCE}
    measured = prediction.predicted.closed_form
    for source, pair in sources.items():
        found[source] = {}
        for name, estimate in zip(("resonance", "antiresonance"), pair, strict=True):
            stated = estimate.value / STATED_FREQUENCIES[name] - 1
            predicted = estimate.value / getattr(measured, name).value - 1
            found[source][name] = {
                **estimate._asdict(),
                "from the stated": stated,
                "within tolerance of the stated": abs(stated) <= FREQUENCY_TOLERANCE,
                "from record B": predicted,
                "within tolerance of record B": abs(predicted) <= FREQUENCY_TOLERANCE,
            }
    return found


def _verdict(prediction: BenchPrediction, key: str, name: str) -> dict[str, Any]:
    error, scatter = prediction.errors["B"][name].size, prediction.scatter[key][name]
    return {
        statistic: {
            "error": getattr(error, statistic),
            "allowed": SCATTER_FACTOR * getattr(scatter, statistic),
            "holds": getattr(error, statistic) <= SCATTER_FACTOR * getattr(scatter, statistic),
        }
        for statistic in ("median", "rms")
    }


def _write_parameters(prediction: BenchPrediction, path: Path) -> None:
    result = prediction.identification.result
    entries = []
    for parameter, (name, estimate) in zip(result.space.parameters, result.estimates().items(), strict=True):
        error = estimate.standard_error
        entries.append(
            ParameterEntry(
                name,
                estimate.value,
                estimate.unit,
                error if np.isfinite(error) else None,
                parameter.lower,
                parameter.upper,
                "fit to record A",
            )
        )
    header = (
        "Two-inertia bench: two-mass drive behind a dead time, fitted to record A.\n"
        "Inertias, stiffness and frictions are per unit of the torque constant."
    )
    write_parameters(path, entries, header=header)


def _plot(prediction: BenchPrediction, folder: Path) -> None:
    from matplotlib.figure import Figure

    model = prediction.identification.model
    fine = np.geomspace(10.0, 255.0, 2000)
    for record, title, file in (
        (prediction.fitted, "Record A and the drive fitted to it", "fit_A.png"),
        (prediction.predicted, "Record B and the prediction of the drive fitted to A", "prediction_B.png"),
    ):
        figure = Figure(figsize=(11, 7), layout="constrained")
        axes = figure.subplots(2, 2, sharex=True)
        curve = two_mass_response(model, fine)
        for column, name in enumerate(RESPONSES):
            plot_magnitude(record.measured, name, EXCITATION, model=curve, ax=axes[0, column])
            plot_phase(record.measured, name, EXCITATION, model=curve, ax=axes[1, column])
            axes[0, column].set_xlabel("")
        figure.suptitle(title)
        figure.savefig(folder / file, dpi=130)
    figure = Figure(figsize=(11, 8), layout="constrained")
    distortion = bench_distortion(prediction.predicted, prediction.identification)
    for ax, name in zip(figure.subplots(2, 1, sharex=True), RESPONSES, strict=True):
        error = prediction.errors["B"][name]
        fitted, predicted = prediction.fitted, prediction.predicted
        scatter = {
            "2 x stated scatter": SCATTER_FACTOR * STATED_SCATTER[name],
            "2 x noise of B": (
                predicted.measured.frequency,
                SCATTER_FACTOR * relative_scatter(predicted.measured, name),
            ),
            "2 x noise and distortion of A": (
                fitted.total.frequency,
                SCATTER_FACTOR * relative_scatter(fitted.total, name),
            ),
        }
        if predicted.silent is not None:
            level = SCATTER_FACTOR * distortion[name]
            scatter["2 x distortion of B at silent lines"] = (predicted.silent.frequency, level)
        plot_log_error(error.frequency, error.values, scatter=scatter, ax=ax)
        ax.set_title(f"Prediction of B: {name.replace('_', ' ')}")
    figure.savefig(folder / "residual_B.png", dpi=130)
