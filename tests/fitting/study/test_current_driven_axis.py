"""An axis whose controller nobody knows, from its CSV to mass and friction, as a user types it."""

import json
import tomllib

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.cli import main
from tests.fitting.study.current_axis_study import GAIN, LEAD, TORQUE_CONSTANT, TRUTH, write_axis
from twin._checks import InputError
from twin.drives import CurrentDrivenAxis, ServoAxis
from twin.laws import CoulombViscousFriction
from twin.references import SampledSignal
from twin.simulation import simulate

FRICTION = CoulombViscousFriction(600.0, 3000.0, 1e-3)


@pytest.fixture
def study(tmp_path):
    """A study file as `drivetwin new` writes it, with the data sheet's values."""
    write_axis(tmp_path / "Achse.csv")
    file = tmp_path / "axis.toml"
    assert main(["new", "current-driven-axis", "--data", str(tmp_path / "Achse.csv"), "--out", str(file)]) == 0
    text = file.read_text()
    text = text.replace('torque_constant = "0.5 N m/A" ', f'torque_constant = "{TORQUE_CONSTANT} N m/A" ')
    file.write_text(text.replace('travel_per_turn = "0.01 m"', 'travel_per_turn = "10 mm"'))
    return file


def identify(study, capsys, *, code=0):
    capsys.readouterr()
    assert main(["identify", str(study), "--out", str(study.parent / "out"), "--force"]) == code
    return capsys.readouterr().out, json.loads((study.parent / "out" / "summary.json").read_text())


def changed(study, old, new):
    text = study.read_text()
    assert old in text
    study.write_text(text.replace(old, new))


def test_it_moves_as_the_servo_axis_of_the_same_force_constant():
    own = CurrentDrivenAxis(TORQUE_CONSTANT, LEAD, 2400.0, FRICTION, offset=50.0)
    same = ServoAxis(2400.0, FRICTION, gain=GAIN, offset=50.0)
    times = np.linspace(0.0, 0.1, 50)
    command = SampledSignal(times, type(own.rest_inputs())(jnp.full(50, 3.0), jnp.zeros(50)))
    found = [np.asarray(simulate(plant, command, times).channel("position")) for plant in (own, same)]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12)
    assert float(own.gain) == pytest.approx(GAIN)
    assert float(own.motor_inertia) == pytest.approx(2400.0 * (LEAD / 2 / np.pi) ** 2)


@pytest.mark.parametrize(
    ("values", "told"),
    [((0.0, LEAD, 1.0), "torque_constant"), ((1.0, 0.0, 1.0), "lead"), ((1.0, LEAD, -1.0), "mass")],
)
def test_values_that_cannot_be(values, told):
    with pytest.raises(InputError, match=told):
        CurrentDrivenAxis(values[0], values[1], values[2], FRICTION)


def test_channels_and_start_are_filled_in(study):
    data = tomllib.loads(study.read_text())["data"]["run1"]
    assert {name: one["column"] for name, one in data["channels"].items()} == {
        "position": "Istposition",
        "current": "Motorstrom",
    }
    assert data["initial"] == {"initial_position": "position"}
    assert "# not in the model: position_setpoint" in study.read_text()


def test_identify_finds_the_truth_within_its_intervals(study, capsys):
    told, summary = identify(study, capsys)
    for path, value in TRUTH.items():
        one = summary["parameters"][path]
        assert abs(one["value"] - value) < 3 * one["standard_error"], path
    assert summary["parameters"]["mass"]["value"] == pytest.approx(2400.0, rel=0.005)
    assert summary["parameters"]["friction.coulomb"]["value"] == pytest.approx(600.0, rel=0.03)
    inertia = summary["derived"]["inertia at the motor"]
    assert inertia["value"] == pytest.approx(2400.0 * (LEAD / 2 / np.pi) ** 2, rel=0.005)
    assert inertia["standard_error"] / inertia["value"] == pytest.approx(
        summary["parameters"]["mass"]["standard_error"] / 2400.0, rel=0.01
    )
    assert "inertia at the motor" in told and "rows were left out, being slower than 8" in told
    assert summary["rows_left_out"] > 0 and all(one["passed"] for one in summary["controls"])
    page = (study.parent / "out" / "report.html").read_text()
    for part in ("Fit against measurement", "Residuals", "Controls", "inertia at the motor", "rows were left out"):
        assert part in page
    assert "Standard errors allow for errors that hang together" in page
    # A fit can go on from there.
    fitted = tomllib.loads((study.parent / "out" / "fitted.toml").read_text())["model"]
    assert float(fitted["mass"].split()[0]) == summary["parameters"]["mass"]["value"]


def test_errors_that_hang_together_are_counted(study, capsys):
    write_axis(study.parent / "Achse.csv", lost=20.0)
    told, summary = identify(study, capsys)
    for path, value in TRUTH.items():
        one = summary["parameters"][path]
        assert abs(one["value"] - value) < 3 * one["standard_error"], path
    assert "Warning: The residual of run1: force is far from noise" in told
    assert "fit with correlated errors" not in told
    assert summary["warnings"]


def test_all_at_bounds_is_no_success(study, capsys):
    for old, new in (
        ('"1 kg", upper = "100 t"', '"500 kg", upper = "1500 kg"'),
        (
            '"friction.coulomb" = { lower = "0 N", upper = "50 kN"',
            '"friction.coulomb" = { lower = "100 N", upper = "300 N"',
        ),
        ('"0 N s/m", upper = "200 kN s/m"', '"500 N s/m", upper = "1500 N s/m"'),
        ('lower = "-20 kN", upper = "20 kN"', 'lower = "-5 N", upper = "5 N"'),
    ):
        changed(study, old, new)
    told, summary = identify(study, capsys, code=1)
    assert "Warning: At a bound: mass, friction.coulomb, friction.viscous, offset" in told
    assert any("At a bound" in warning for warning in summary["warnings"])


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            'free = ["mass",',
            'free = ["friction.static", "friction.stribeck_velocity",',
            "Remove friction.stribeck_velocity from [free]",
        ),
        ('free = ["mass",', 'free = ["masss",', "Did you mean 'mass'"),
        (
            'free = ["mass",',
            'free = ["torque_constant", "mass",',
            "it scales all other parameters. Remove torque_constant",
        ),
        ('# slowest = "10 mm/s"  ', 'slowest = "2 m/s"     ', "are as fast as 2 m/s"),
    ],
)
def test_what_identify_cannot_do_is_named(study, capsys, old, new, told):
    changed(study, old, new)
    changed(study, "# torque_constant = {", "torque_constant = {")
    assert main(["identify", str(study), "--out", str(study.parent / "out")]) == 2
    assert told in capsys.readouterr().err
