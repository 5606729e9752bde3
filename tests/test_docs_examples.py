"""The examples of the documentation run, and do what their pages say."""

import importlib.util
import runpy
import shutil
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.cli import main
from twin.control import SampledLoop
from twin.drives import TwoMass
from twin.laws import ViscousFriction

DOCS = Path(__file__).parents[1] / "docs"
EXAMPLES = DOCS / "examples"


def example(name):
    """A module of the examples."""
    spec = importlib.util.spec_from_file_location(f"docs_example_{Path(name).stem}", EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def added(monkeypatch):
    """Lets a package have the examples of a folder, as if they lay in it."""

    def add(package, folder):
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(EXAMPLES / folder)])

    before = set(sys.modules)
    yield add
    for name in set(sys.modules) - before:
        if name.rpartition(".")[2] in {file.stem for file in EXAMPLES.rglob("*.py")}:
            del sys.modules[name]


def swivel(**changes):
    friction = example("friction_law").ArctanFriction(coulomb=0.5, viscous=0.1, width=0.01)
    values = {"inertia": 0.4, "unbalance": 3.0, "friction": friction, "torque_constant": 1.5, **changes}
    return example("drive").SwivelAxis(**values)


def test_friction_law_is_odd_and_has_its_slope():
    law = example("friction_law").ArctanFriction(coulomb=2.0, viscous=3.0, width=0.1)
    np.testing.assert_allclose(law(-0.7), -law(0.7), rtol=1e-14)
    np.testing.assert_allclose(jax.grad(law)(0.0), 2.0 * 2 / np.pi / 0.1 + 3.0, rtol=1e-12)


def test_drive_swings_with_its_natural_frequency():
    from twin.linear import linearise

    drive = swivel(friction=example("friction_law").ArctanFriction(coulomb=0.0, viscous=0.0, width=0.01))
    poles = jnp.linalg.eigvals(linearise(drive).a)
    np.testing.assert_allclose(jnp.max(jnp.abs(poles)), np.sqrt(3.0 / 0.4), rtol=1e-10)


def test_controller_brings_the_drive_to_its_target():
    from twin.references import JerkLimitedMove
    from twin.simulation import simulate

    loop = SampledLoop(swivel(), example("controller").SampledPid(60.0, 200.0, 6.0), 1e-3)
    found = simulate(loop, JerkLimitedMove(1.0, 2.0, 20.0, 400.0), 1e-3 * jnp.arange(2000))
    assert abs(float(found.channel("position")[-1]) - 1.0) < 1e-2


def test_residual_finds_the_stiffness_of_the_bump_test():
    from fitting import fit
    from twin.parameters import Parameter, ParameterSpace

    free = ViscousFriction(0.0)
    drive = TwoMass(2e-3, 3e-3, stiffness=60.0, damping=0.02, motor_friction=free, load_friction=free, gain=0.5)
    evidence = example("residual").BumpTestResidual(frequency=[44.9, 45.0, 45.1], deviation=0.1)
    found = fit(evidence, drive, ParameterSpace([Parameter("stiffness", "N m/rad", 1.0, 1e4, scale="log")]))
    expected = (2 * np.pi * 45.0) ** 2 / (1 / 2e-3 + 1 / 3e-3)
    np.testing.assert_allclose(found["stiffness"].value, expected, rtol=1e-4)
    np.testing.assert_allclose(found["stiffness"].standard_error, 2 * expected * 0.1 / 45.0 / np.sqrt(3), rtol=1e-3)


def test_procedure_is_found_by_its_file(added, tmp_path, capsys):
    from fitting.study import procedures

    added(procedures, "procedures")
    rows = [f"{0.01 * i},{0.2 + 0.01 * (-1) ** i}" for i in range(50)]
    (tmp_path / "standing.csv").write_text("\n".join(["t [s],i [A]", *rows]) + "\n")
    study = tmp_path / "study.toml"
    study.write_text(
        '[model]\ntype = "ServoAxis"\nmass = "80 kg"\nfriction = { type = "ViscousFriction", viscous = "9 N s/m" }\n'
        '[data.standing]\nfile = "standing.csv"\n[data.standing.channels]\ncurrent = { column = "i", unit = "A" }\n'
        '[identify]\nprocedure = "holding_force"\nforce_constant = "60 N/A"\n'
    )
    assert main(["identify", str(study), "--out", str(tmp_path / "out")]) == 0
    assert "standing: 12 N" in capsys.readouterr().out
    assert (tmp_path / "out" / "forces.csv").is_file()


def test_command_is_found_by_its_file(added, capsys):
    from fitting import commands

    added(commands, "commands")
    assert main(["si", "1500 rpm"]) == 0
    assert "157.0796327" in capsys.readouterr().out


def test_format_is_found_by_its_content(added, tmp_path):
    from twin.io import formats
    from twin.io.measurement import read_measurement

    added(formats, "formats")
    samples = np.linspace(0.0, 1.0, 16, dtype="<f4")
    (tmp_path / "run.trace").write_bytes(b"TRACE 2000\n" + samples.tobytes())
    found = read_measurement(tmp_path / "run.trace", unit="V")
    assert found.format == "trace" and found["trace"].unit == "V" and found["trace"].rate == pytest.approx(2000.0)
    np.testing.assert_array_equal(found["trace"].values, samples)


def test_benchmark_section_is_found_by_its_file(added, tmp_path):
    from tests.benchmarks import sections

    added(sections, "sections")
    assert "modes_in_batch" in sections.names()
    found = sections.run("modes_in_batch", sections.Options(tmp_path, rounds=1))
    assert found.summary[0].ratio > 0


@pytest.mark.slow
def test_first_fit_finds_the_axis_behind_the_record(tmp_path, monkeypatch):
    making = example("make_axis_csv")
    making.write_csv(tmp_path / "axis.csv")
    shutil.copy(EXAMPLES / "first_fit.py", tmp_path)
    monkeypatch.chdir(tmp_path)
    result = runpy.run_path("first_fit.py")["result"]
    truth = making.true_axis().plant
    assert result.success
    for path, true in (("plant.mass", truth.mass), ("plant.friction.coulomb", truth.friction.coulomb)):
        assert abs(result[path].value - float(true)) < 5 * result[path].standard_error
