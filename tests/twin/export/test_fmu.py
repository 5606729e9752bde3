"""FMUs run as the twin simulates, without Python."""

import shutil
import zipfile

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

pytest.importorskip("fmpy")

import fmpy
from export_cases import CASES, Ticks, drive_names, held, motion, plant_case, servo_loop, wave
from fmpy.validation import validate_fmu
from fmu_runs import Unit
from reference_systems import ContinuousCascade, two_mass

from twin._checks import InputError
from twin.control import ClosedLoop
from twin.drives import DriveInputs, mauro_axis
from twin.export import write_fmu
from twin.paths import set_leaves
from twin.references import SampledSignal
from twin.simulation import simulate
from twin.stepping import AdaptiveSteps, ConstantSteps

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
VERSIONS = ("2.0", "3.0")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Writes each case once for each version, and gives its file."""
    folder, files = tmp_path_factory.mktemp("fmus"), {}

    def write(case, version):
        if (case, version) not in files:
            system, _, times, _, stepping = CASES[case]()
            path = folder / f"{case}_{version[0]}.fmu"
            period = None if case.endswith("loop") else float(times[1])
            files[case, version] = write_fmu(path, system, period=period, stepping=stepping, version=version)
        return files[case, version]

    return write


simulated_by = eqx.filter_jit(simulate)


def simulated(case):
    system, reference, times, inputs, stepping = CASES[case]()
    run = simulated_by(system, reference, jnp.asarray(times), stepping=stepping)
    return run, inputs, float(times[1])


def worst(rows, outputs):
    """Largest error of each output, relative to its largest magnitude."""
    expected = np.stack([np.asarray(x) for x in jax.tree.leaves(outputs)], axis=1)
    peak = np.max(np.abs(expected), axis=0)
    return float(np.max(np.abs(rows - expected) / np.where(peak == 0, 1.0, peak)))


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


def test_what_acts_at_once_is_said(written):
    description = fmpy.read_model_description(str(written("servo_loop", "3.0")))
    through = {u.variable.name: {v.name for v in u.dependencies} for u in description.outputs}
    assert through["position"] == set()
    assert through["command"] == {"reference.position", "injection.command"}


def test_variables_have_units_and_the_right_kind(written):
    description = fmpy.read_model_description(str(written("servo_loop", "2.0")))
    variables = {v.name: v for v in description.modelVariables}
    assert variables["controller.position_gain"].unit == "1/s"
    assert variables["controller.position_gain"].variability == "tunable"
    assert variables["plant.initial_position"].variability == "fixed"
    assert float(variables["plant.mass"].start) == 95.0
    # The memory follows from the position, which a parameter says.
    assert not any(name.startswith("initial.position") for name in variables)
    assert "period" not in variables


def test_the_same_model_gives_the_same_file(tmp_path):
    files = [write_fmu(tmp_path / f"{i}.fmu", two_mass(), period=1e-3, name="axis") for i in (1, 2)]
    assert files[0].read_bytes() == files[1].read_bytes()
    other = write_fmu(tmp_path / "3.fmu", two_mass(), period=2e-3, name="axis")
    guids = {fmpy.read_model_description(str(path)).guid for path in (*files, other)}
    assert len(guids) == 2


def test_few_parameters_other_names_and_source_only(tmp_path):
    path = write_fmu(
        tmp_path / "axis.fmu",
        mauro_axis(),
        period=1e-4,
        parameters=("motor", "slide_mass"),
        rename={"input.command": "u", "position": "x"},
        platforms=(),
    )
    assert validate_fmu(str(path)) == []
    variables = {v.name: v.causality for v in fmpy.read_model_description(str(path)).modelVariables}
    assert variables["u"] == "input" and variables["x"] == "output"
    parameters = {name for name, causality in variables.items() if causality == "parameter" and "initial." not in name}
    assert "slide_mass" in parameters and all(name.startswith("motor.") for name in parameters - {"slide_mass"})
    names = zipfile.ZipFile(path).namelist()
    assert "sources/buildDescription.xml" in names and not any(name.startswith("binaries") for name in names)


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


def test_bad_input_is_refused(tmp_path, monkeypatch):
    axis, path = two_mass(), tmp_path / "axis.fmu"
    with pytest.raises(InputError, match=r"must end in \.fmu"):
        write_fmu(tmp_path / "axis.zip", axis, period=1e-3)
    with pytest.raises(InputError, match="ConstantSteps, but is AdaptiveSteps"):
        write_fmu(path, axis, period=1e-3, stepping=AdaptiveSteps())
    with pytest.raises(InputError, match="period must be"):
        write_fmu(path, axis)
    with pytest.raises(InputError, match=r"ticks every 0\.001 s"):
        write_fmu(path, servo_loop(), period=2e-3)
    with pytest.raises(InputError, match="version"):
        write_fmu(path, axis, period=1e-3, version="1.0")
    with pytest.raises(InputError, match="'mars', but knows linux64"):
        write_fmu(path, axis, period=1e-3, platforms=("mars",))
    with pytest.raises(InputError, match="'shaft', which is no finite number"):
        write_fmu(path, axis, period=1e-3, parameters=("shaft",))
    with pytest.raises(InputError, match="Two variables are called 'position'"):
        write_fmu(path, axis, period=1e-3, rename={"shaft": "position"})
    with pytest.raises(InputError, match="rename names 'gone'"):
        write_fmu(path, axis, period=1e-3, rename={"gone": "here"})
    with pytest.raises(InputError, match="folder"):
        write_fmu(tmp_path / "gone" / "axis.fmu", axis, period=1e-3)
    injected = eqx.tree_at(
        lambda loop: loop.injection,
        servo_loop(),
        held(jnp.arange(3.0), DriveInputs(jnp.ones(3), jnp.ones(3))),
        is_leaf=lambda x: x is None,
    )
    with pytest.raises(InputError, match="injection"):
        write_fmu(path, injected)
    monkeypatch.setenv("CC", "false")
    with pytest.raises(InputError, match="compiler 'false' failed"):
        write_fmu(path, axis, period=1e-3)
    assert list(tmp_path.iterdir()) == []


def test_without_a_compiler_the_cure_is_named(tmp_path, monkeypatch):
    import twin.export.fmu.compile as module

    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(module.shutil, "which", lambda name: None)
    monkeypatch.setattr(module.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"No C compiler.*platforms=\(\)"):
        write_fmu(tmp_path / "axis.fmu", two_mass(), period=1e-3)


@pytest.mark.slow
def test_libraries_for_other_machines(tmp_path):
    pytest.importorskip("ziglang", reason="zig builds for other machines")
    path = write_fmu(tmp_path / "axis.fmu", two_mass(), period=1e-3, version="2.0", platforms=("linux64", "win64"))
    with zipfile.ZipFile(path) as archive:
        assert archive.read("binaries/win64/axis.dll")[:2] == b"MZ"
        assert archive.read("binaries/linux64/axis.so")[1:4] == b"ELF"


def test_holding_differs_from_following():
    """The comparisons above could fail: with inputs that change within a period the motion is another one."""
    system, reference, times, _, stepping = plant_case(
        two_mass(), 1e-3, lambda t: DriveInputs(jnp.asarray(wave(t, 2.0, 60.0)), jnp.zeros(t.size)), drive_names
    )
    following = SampledSignal(reference.times, reference.values)
    one = simulate(system, reference, jnp.asarray(times), stepping=stepping)
    other = simulate(system, following, jnp.asarray(times), stepping=stepping)
    assert np.max(np.abs(one.outputs.position - other.outputs.position)) > 1e-3 * np.max(np.abs(one.outputs.position))
