"""The demo: a servo axis with known parameters is simulated, recorded with noise, and identified from the records."""

import time
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fitting.identification.output_error import output_error
from fitting.json_file import write_json
from fitting.plots import plot_comparison, plot_intervals, save_figure
from fitting.result import FitResult
from twin.control import SampledLoop, SampledPositionVelocity
from twin.drives import ServoAxis
from twin.io.parameter_file import ParameterEntry, write_parameters
from twin.laws import StribeckFriction
from twin.parameters import Parameter, ParameterSpace
from twin.record import Record
from twin.references import JerkLimitedMove, SumReference
from twin.simulation import simulate
from twin.stepping import ConstantSteps

PERIOD = 1e-3
"""Period of the controller [s]."""
DEVIATION = {"position": 1e-6, "force": 1.0}
"""Standard deviation of the noise on the records [m, N]."""
STEPPING = ConstantSteps(substeps=4)
"""Integration steps between two ticks."""


def demo_axis() -> SampledLoop:
    """A ball-screw axis of 95 kg with Stribeck friction under a sampled cascade; all values chosen, none measured."""
    friction = StribeckFriction(
        coulomb=18.0, static=26.0, stribeck_velocity=8e-3, viscous=210.0, width=5e-4, exponent=1.0
    )
    axis = ServoAxis(mass=95.0, friction=friction, gain=35.0, offset=-3.0)
    return SampledLoop(axis, SampledPositionVelocity(160.0, 240.0, command_limit=10.0), PERIOD)


def demo_reference() -> SumReference:
    """Three moves there and back at different speeds, jerk-limited."""
    moves, start = [], 0.1
    for distance, speed in ((0.2, 0.25), (-0.2, 0.12), (0.05, 0.03), (-0.05, 0.015)):
        move = JerkLimitedMove(distance, speed, 2.0, 60.0, start_time=start)
        moves.append(move)
        start += float(move.duration()) + 0.15
    return SumReference(tuple(moves))


def demo_space() -> ParameterSpace:
    """What the demo identifies."""
    return ParameterSpace(
        [
            Parameter("plant.mass", "kg", 10.0, 1000.0, scale="log"),
            Parameter("plant.friction.coulomb", "N", 0.0, 200.0),
            Parameter("plant.friction.static", "N", 0.0, 200.0),
            Parameter("plant.friction.stribeck_velocity", "m/s", 1e-3, 0.1, scale="log"),
            Parameter("plant.friction.viscous", "N s/m", 0.0, 2000.0),
            Parameter("plant.offset", "N", -50.0, 50.0),
        ]
    )


def make_record(loop: SampledLoop, reference: SumReference, seed: int = 1) -> Record:
    """Simulate and add noise.

    Args:
        loop: axis with its controller.
        reference: motion.
        seed: of the noise.
    """
    end = float(reference.switching_times()[-1]) + 0.2
    times = jnp.arange(int(end / PERIOD)) * PERIOD
    trajectory = eqx.filter_jit(simulate)(loop, reference, times, stepping=STEPPING)
    noise = np.random.default_rng(seed)
    channels = {
        name: np.asarray(trajectory.channel(name)) + sd * noise.standard_normal(times.size)
        for name, sd in DEVIATION.items()
    }
    return Record.create(np.asarray(times), channels, {"position": "m", "force": "N"}, name="simulated axis")


def run_demo(out: Path) -> str:
    """Simulate, identify, write `summary.json`, `parameters.toml` and plots, and return the table.

    Args:
        out: folder for the results.
    """
    clock = time.perf_counter()
    truth, reference, space = demo_axis(), demo_reference(), demo_space()
    record = make_record(truth, reference)
    # The start knows nothing: a round number for each parameter, far from the truth.
    start = space.with_values(truth, jnp.asarray([50.0, 10.0, 12.0, 2e-2, 100.0, 0.0]))
    result = output_error(record, start, reference, space, deviation=DEVIATION, stepping=STEPPING)
    seconds = time.perf_counter() - clock

    true_values = dict(zip(space.paths, np.asarray(space.values(truth)).tolist(), strict=True))
    table = result.to_dataframe()[["unit", "estimate", "standard error", "95 % from", "95 % to"]]
    table.insert(1, "true", list(true_values.values()))
    _write(out, result, true_values, seconds)
    _draw(out, record, result, reference, true_values)
    text = table.round(7).to_string()
    return f"{text}\n{result.message}\n{seconds:.1f} s; results in {out}"


def _write(out: Path, result: FitResult, truth: dict[str, float], seconds: float) -> None:
    low_high = dict(zip(result.space.paths, result.intervals().tolist(), strict=True))
    summary = {
        "parameters": {
            path: {**estimate._asdict(), "true": truth[path], "interval_95": low_high[path]}
            for path, estimate in result.estimates().items()
        },
        "status": result.message,
        "steps": result.steps,
        "condition_number": result.condition_number,
        "seconds": seconds,
    }
    write_json(out / "summary.json", summary)
    entries = [
        ParameterEntry(p.path, float(v), p.unit, float(se), p.lower, p.upper, "demo, simulated records")
        for p, v, se in zip(result.space.parameters, result.values, result.standard_errors, strict=True)
    ]
    write_parameters(out / "parameters.toml", entries)


def _draw(out: Path, record: Record, result: FitResult, reference: SumReference, truth: dict[str, float]) -> None:
    from matplotlib import pyplot

    fitted = eqx.filter_jit(simulate)(result.model, reference, record.times, stepping=STEPPING)
    figure, axes = pyplot.subplots(3, 1, figsize=(8, 7), layout="constrained", sharex=True)
    plot_comparison(
        record.times, record.channel("position"), fitted.channel("position"), label="position", unit="m", ax=axes[0]
    )
    plot_comparison(record.times, record.channel("force"), fitted.channel("force"), label="force", unit="N", ax=axes[1])
    axes[2].plot(record.times, record.channel("force") - fitted.channel("force"), lw=0.5)
    axes[2].set_ylabel("measured - simulated [N]")
    for ax in axes[:2]:
        ax.set_xlabel("")
    axes[2].set_xlabel("time [s]")
    axes[0].set_title("Demo: simulated servo axis, record and fit")
    save_figure(figure, out / "record_and_fit.png")
    ax = plot_intervals(result, truth=truth)
    ax.set_title("Demo: what the record says about each parameter")
    save_figure(ax.figure, out / "intervals.png")
