"""FMUs run as the twin simulates, without Python."""

import shutil

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

pytest.importorskip("fmpy")

import fmpy
from export_cases import CASES, Ticks, drive_names, motion, plant_case, wave, worst
from fmpy.validation import validate_fmu
from fmu_runs import Unit
from reference_systems import ContinuousCascade, two_mass

from twin.control import ClosedLoop
from twin.drives import DriveInputs, mauro_axis
from twin.export import write_fmu
from twin.paths import set_leaves
from twin.references import SampledSignal
from twin.simulation import simulate
from twin.stepping import ConstantSteps

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
VERSIONS = ("2.0", "3.0")


simulated_by = eqx.filter_jit(simulate)


def simulated(case):
    system, reference, times, inputs, stepping = CASES[case]()
    run = simulated_by(system, reference, jnp.asarray(times), stepping=stepping)
    return run, inputs, float(times[1])


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("case", CASES)
def test_runs_as_the_twin_simulates(case, version, written, tmp_path):
    path = written(case, version)
    assert validate_fmu(str(path)) == []
    run, inputs, period = simulated(case)
    unit = Unit(path, tmp_path)
    rows = unit.run(inputs, period, run.outputs._fields)
    unit.close()
    assert worst(rows, run.outputs) < 1e-10
    assert np.ptp(rows[:, 0]) > 0


@pytest.mark.parametrize("version", VERSIONS)
def test_a_simulation_tool_runs_it(version, written):
    path = written("two_mass", version)
    run, inputs, period = simulated("two_mass")
    times = np.arange(200) * period
    signals = np.array(list(zip(times, *inputs.values(), strict=True)), dtype=[(n, float) for n in ("time", *inputs)])
    result = fmpy.simulate_fmu(
        str(path), stop_time=0.15, step_size=period, output_interval=period, input=signals, output=["load_position"]
    )
    np.testing.assert_allclose(result["load_position"], run.outputs.load_position[:151], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("version", VERSIONS)
def test_parameters_set_at_run_time(version, written, tmp_path):
    system, reference, times, inputs, stepping = CASES["servo_loop"]()
    changed = {"plant.mass": 120.0, "plant.friction.coulomb": 35.0, "controller.position_gain": 90.0}
    changed |= {"plant.initial_position": -0.05}
    other = set_leaves(system, changed)
    run = simulated_by(other, reference, jnp.asarray(times), stepping=stepping)
    unit = Unit(written("servo_loop", version), tmp_path, start=changed)
    rows = unit.run(inputs, 1e-3, run.outputs._fields)
    unit.close()
    assert worst(rows, run.outputs) < 1e-10


@pytest.mark.parametrize("version", VERSIONS)
def test_parameters_tuned_between_steps(version, written, tmp_path):
    system, reference, times, inputs, stepping = CASES["two_mass"]()
    half = 100
    first = simulate(system, reference, jnp.asarray(times[: half + 1]), stepping=stepping)
    stiffer = set_leaves(system, {"stiffness": 90.0})
    at_half = jax.tree.map(lambda rows: rows[-1], first.states)
    second = simulate(stiffer, reference, jnp.asarray(times[half:]), stepping=stepping, initial_state=at_half)
    unit = Unit(written("two_mass", version), tmp_path)
    unit.run({name: values[:half] for name, values in inputs.items()}, 1e-3, ("position",))
    unit.set({"stiffness": 90.0})
    rows = unit.run({name: values[half:] for name, values in inputs.items()}, 1e-3, second.outputs._fields)
    unit.close()
    assert worst(rows, second.outputs) < 1e-10


def test_initial_states_and_start_time(written, tmp_path):
    system, reference, times, inputs, stepping = CASES["two_mass"]()
    start = system.initial_state()._replace(motor_position=jnp.asarray(0.3), load_velocity=jnp.asarray(-2.0))
    run = simulate(system, reference, jnp.asarray(times), stepping=stepping, initial_state=start)
    given = {"initial.motor_position": 0.3, "initial.load_velocity": -2.0}
    unit = Unit(written("two_mass", "3.0"), tmp_path, start=given, start_time=5.0)
    rows = unit.run(inputs, 1e-3, run.outputs._fields)
    assert unit.get(["time"])[0] == pytest.approx(5.2)
    unit.close()
    assert worst(rows, run.outputs) < 1e-10


def test_several_periods_in_one_step(written, tmp_path):
    path = written("two_mass", "3.0")
    one, other = Unit(path, tmp_path, "one"), Unit(path, tmp_path, "other")
    for unit in (one, other):
        unit.set({"input.command": 1.5})
    for _ in range(12):
        one.step(1e-3)
    other.step(5e-3)
    other.step(7e-3)
    np.testing.assert_array_equal(one.get(("position", "load_velocity")), other.get(("position", "load_velocity")))
    # Instances share nothing.
    other.set({"input.command": -8.0})
    other.step(1e-3)
    assert one.get(["position"])[0] != other.get(["position"])[0]
    one.close()
    other.close()


@pytest.mark.parametrize("length", [1.5e-3, 1e-4, 0.0])
def test_steps_that_are_no_whole_number_of_periods_are_refused(length, written, tmp_path):
    unit = Unit(written("two_mass", "3.0"), tmp_path)
    with pytest.raises(Exception, match="fmi3DoStep"):
        unit.step(length)
    assert "must be a whole multiple of the model's period of 0.001" in unit.messages[-1]
    unit.close()


@pytest.mark.parametrize("version", VERSIONS)
def test_states_are_kept_set_and_serialised(version, written, tmp_path):
    _, inputs, period = simulated("preload_loop")
    unit = Unit(written("preload_loop", version), tmp_path)
    names = ("table_position", "torque_1", "force_2", "state.controller.tick")
    unit.run({name: values[:50] for name, values in inputs.items()}, period, names)
    get, put = (
        (unit.fmu.getFMUstate, unit.fmu.setFMUstate) if unit.two else (unit.fmu.getFMUState, unit.fmu.setFMUState)
    )
    serialise, restore = (
        (unit.fmu.serializeFMUstate, unit.fmu.deSerializeFMUstate)
        if unit.two
        else (unit.fmu.serializeFMUState, unit.fmu.deserializeFMUState)
    )
    kept, at = get(), unit.time
    data = serialise(kept)
    rest = {name: values[50:] for name, values in inputs.items()}
    first = unit.run(rest, period, names)
    put(kept)
    unit.time = at
    np.testing.assert_array_equal(unit.run(rest, period, names), first)
    put(restore(data))
    unit.time = at
    np.testing.assert_array_equal(unit.run(rest, period, names), first)
    with pytest.raises(Exception, match="erialize"):
        restore(b"x" * len(data))
    unit.close()


@pytest.mark.parametrize("version", VERSIONS)
def test_reset_begins_anew(version, written, tmp_path):
    run, inputs, period = simulated("two_mass")
    unit = Unit(written("two_mass", version), tmp_path, start={"stiffness": 55.0})
    unit.run(inputs, period, ("position",))
    unit.fmu.reset()
    unit.begin({})
    assert worst(unit.run(inputs, period, run.outputs._fields), run.outputs) < 1e-10
    unit.close()


def test_a_model_that_runs_away_is_an_error(tmp_path):
    path = write_fmu(tmp_path / "away.fmu", mauro_axis(), period=1e-2, stepping=ConstantSteps(1))
    unit = Unit(path, tmp_path / "unpacked")
    unit.set({"input.command": 10.0})
    with pytest.raises(Exception, match="fmi3DoStep"):
        unit.step(5.0)
    assert "NaN or infinite" in unit.messages[-1]
    unit.close()


def test_a_closed_loop_in_continuous_time(tmp_path):
    loop = ClosedLoop(two_mass(), ContinuousCascade(20.0, 0.3, 0.1))
    times = np.arange(150) * 1e-3
    values = motion(times)
    run = simulate(loop, Ticks(jnp.asarray(times), values), jnp.asarray(times), stepping=ConstantSteps())
    inputs = dict(zip(("input.position", "input.velocity", "input.acceleration"), values, strict=True))
    unit = Unit(write_fmu(tmp_path / "loop.fmu", loop, period=1e-3), tmp_path / "unpacked")
    rows = unit.run(inputs, 1e-3, run.outputs._fields)
    unit.close()
    assert worst(rows, run.outputs) < 1e-10


def test_holding_differs_from_following():
    """The comparisons above could fail: with inputs that change within a period the motion is another one."""
    system, reference, times, _, stepping = plant_case(
        two_mass(), 1e-3, lambda t: DriveInputs(jnp.asarray(wave(t, 2.0, 60.0)), jnp.zeros(t.size)), drive_names
    )
    following = SampledSignal(reference.times, reference.values)
    one = simulate(system, reference, jnp.asarray(times), stepping=stepping)
    other = simulate(system, following, jnp.asarray(times), stepping=stepping)
    assert np.max(np.abs(one.outputs.position - other.outputs.position)) > 1e-3 * np.max(np.abs(one.outputs.position))
