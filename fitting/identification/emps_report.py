"""The report of the EMPS study: `summary.json`, fitted parameters, plots, and a text."""

from pathlib import Path
from typing import Any

import numpy as np

from fitting.identification.emps import EmpsStudy, Score, information_criteria, score, simulate_record
from fitting.identification.emps_model import CYCLE, PERIOD, SCREW_LEAD, pulse_gain, with_screw_phase
from fitting.identification.inverse_dynamics import DerivativeFilter
from fitting.json_file import write_json
from fitting.plots import plot_comparison, plot_correlation, plot_intervals, plot_residual, save_figure
from fitting.result import FitResult
from twin.io.parameter_file import ParameterEntry, write_parameters

PUBLISHED = {
    "train": {"force_percent": 5.85, "velocity_percent": 0.229},
    "test": {"force_percent": 8.94, "velocity_percent": 0.479},
}
"""Errors of the published symmetric model (Janot, Gautier, Brunot 2019)."""


def write_emps_report(study: EmpsStudy, out: Path) -> str:
    """Score the study, write its files, and return a text for the terminal.

    Args:
        study: the study.
        out: folder, which exists.
    """
    summary = emps_summary(study)
    write_json(out / "summary.json", summary)
    fit = study.fit
    entries = [
        ParameterEntry(p.path, float(v), p.unit, _number(se), p.lower, p.upper, "EMPS training record, output error")
        for p, v, se in zip(fit.space.parameters, fit.values, fit.standard_errors, strict=True)
    ]
    write_parameters(out / "parameters.toml", entries, header="EMPS axis, closed-loop output error")
    fit.save(out / "fit.npz")
    _draw(study, out)
    return f"{_text(study, summary)}\nResults in {out}"


def emps_summary(study: EmpsStudy) -> dict[str, Any]:
    """The study as plain numbers.

    Args:
        study: the study.
    """
    turned = with_screw_phase(study.fit.model, study.screw_phase)
    tried = [
        {
            "model": t.rung.name,
            "parameters": len(t.rung.free),
            "train": score(t.fit.model, study.train)._asdict(),
            "test": score(t.fit.model, study.test)._asdict(),
            "cycles_1_to_3_mean_square": t.fitted_square,
            "cycle_4_mean_square": t.held_back_square,
            "aic": aic,
            "bic": bic,
            "converged": t.fit.success,
        }
        for t, (aic, bic) in zip(study.ladder, information_criteria(study), strict=True)
    ]
    return {
        "inverse_dynamics": {name: _estimates(fit) for name, fit in study.inverse.items()},
        "output_error": {
            "model": study.ladder[study.chosen].rung.name,
            "parameters": _estimates(study.fit),
            "status": study.fit.message,
            "condition_number": study.fit.condition_number,
            "train": score(study.fit.model, study.train)._asdict(),
            "test": score(turned, study.test)._asdict(),
            "test_without_encoder_zero": score(study.fit.model, study.test)._asdict(),
            "published": PUBLISHED,
            "repeatability_percent": _repeatability(study),
            "taken_from_each_record": {
                "initial_state": "position, speed, encoder memory and amplifier output at the first tick",
                "test_pulse_gain": pulse_gain(study.test),
                "test_encoder_zero_m": study.screw_phase,
                "test_encoder_zero_from": "the 320 ticks before the first pulse",
            },
        },
        "models_tried": tried,
        "seconds": study.seconds,
    }


def _estimates(fit: FitResult) -> dict[str, dict[str, Any]]:
    return {
        path: {"value": e.value, "standard_error": _number(e.standard_error), "unit": e.unit}
        for path, e in fit.estimates().items()
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _repeatability(study: EmpsStudy) -> float:
    """Half the difference of two cycles relative to the force: what no model of this kind can explain."""
    voltage = np.asarray(study.train.record.channel("voltage"))
    second, third = voltage[CYCLE : 2 * CYCLE], voltage[2 * CYCLE : 3 * CYCLE]
    return float(100 * np.linalg.norm(second - third) / np.sqrt(2) / np.linalg.norm(second))


def _text(study: EmpsStudy, summary: dict[str, Any]) -> str:
    lines = ["Inverse dynamics"]
    for name, fit in study.inverse.items():
        lines += [f"  {name}"] + [
            f"    {p:28} {e.value:10.4f} ± {e.standard_error:.4f} {e.unit}" for p, e in fit.estimates().items()
        ]
    lines += ["Output error: models tried, force / velocity error in %"]
    lines += [f"  {'k':>2} {'train':>15} {'test':>15} {'cycle 4':>8} {'BIC':>8}  model"]
    for i, row in enumerate(summary["models_tried"]):
        mark = "*" if i == study.chosen else " "
        lines.append(
            f"{mark} {row['parameters']:>2} {_pair(row['train']):>15} {_pair(row['test']):>15} "
            f"{row['cycle_4_mean_square']:8.3f} {row['bic']:8.0f}  {row['model']}"
        )
    best = summary["output_error"]
    lines += [
        f"Chosen (*) by cycle 4, refitted on the whole training record: train {_pair(best['train'])}, "
        f"test {_pair(best['test'])} (without the encoder zero {_pair(best['test_without_encoder_zero'])})",
        "Published, symmetric: train 5.85 / 0.229, test 8.94 / 0.479",
        *[f"    {p:54} {e.value:12.5g} ± {e.standard_error:.2g} {e.unit}" for p, e in study.fit.estimates().items()],
        study.fit.message,
    ]
    return "\n".join(lines)


def _pair(row: dict[str, float]) -> str:
    return f"{row['force_percent']:.3f} / {row['velocity_percent']:.4f}"


def _draw(study: EmpsStudy, out: Path) -> None:
    from matplotlib import pyplot

    turned = with_screw_phase(study.fit.model, study.screw_phase)
    for name, model, data in (("train", study.fit.model, study.train), ("test", turned, study.test)):
        record = data.record
        command, _ = simulate_record(model, data)
        force, simulated = np.asarray(record.channel("force")), data.gtau * command
        figure, axes = pyplot.subplots(2, 1, figsize=(9, 5.5), layout="constrained", sharex=True)
        plot_comparison(record.times, force, simulated, label="force", unit="N", ax=axes[0])
        axes[0].set_xlabel("")
        axes[1].plot(np.asarray(record.times), force - simulated, lw=0.4)
        axes[1].set_xlabel("time [s]")
        axes[1].set_ylabel("measured - simulated [N]")
        errors: Score = score(model, data)
        axes[0].set_title(
            f"EMPS {name} record: force error {errors.force_percent:.2f} %, velocity {errors.velocity_percent:.3f} %"
        )
        save_figure(figure, out / f"{name}.png")
    _draw_residuals(study, out)
    ax = plot_intervals(study.fit, ax=pyplot.subplots(figsize=(8.5, 5.5), layout="constrained")[1])
    ax.set_title("EMPS: intervals relative to the estimates")
    save_figure(ax.figure, out / "intervals.png")
    ax = plot_correlation(study.fit)
    save_figure(ax.figure, out / "correlation.png")


def _draw_residuals(study: EmpsStudy, out: Path) -> None:
    """Force residual of the smallest and the chosen model against what they could depend on."""
    from matplotlib import pyplot

    record = study.train.record
    position = np.asarray(record.channel("position"))
    velocity = DerivativeFilter()(position, PERIOD)[1]
    voltage, gain = np.asarray(record.channel("voltage")), study.train.gtau
    models = {"smallest model": study.ladder[0].fit.model, "chosen model": study.fit.model}
    residual = {name: gain * (voltage - simulate_record(model, study.train)[0]) for name, model in models.items()}
    figure, axes = pyplot.subplots(1, 3, figsize=(13, 4), layout="constrained", sharey=True)
    label = "measured - simulated force [N]"
    plot_residual(velocity, residual, xlabel="velocity [m/s]", ylabel=label, ax=axes[0])
    plot_residual(1e3 * position, residual, xlabel="position [mm]", ylabel="", ax=axes[1])
    turn = (position % SCREW_LEAD) / SCREW_LEAD
    forward = velocity > 0.02
    plot_residual(
        turn[forward],
        {name: values[forward] for name, values in residual.items()},
        xlabel="turn of the screw, forward motion [-]",
        ylabel="",
        ax=axes[2],
    )
    figure.suptitle("EMPS train: the residual names the missing terms")
    save_figure(figure, out / "residuals.png")
