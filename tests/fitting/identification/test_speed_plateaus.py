"""Constant speeds found in a record of several."""

import json

import numpy as np
import pandas as pd
import pytest

from fitting.cli import main
from fitting.identification.speed_plateaus import speed_plateaus
from tests.fitting.study.current_axis_study import LEAD, MOVES, TORQUE_CONSTANT, TRUTH, motion, write_axis
from twin._checks import InputError
from twin.record import Record

SPEEDS = sorted(way * top for top, _ in MOVES for way in (1.0, -1.0))


def record(noise=0.0, names=("velocity",)):
    _, velocity, _ = motion()
    measured = velocity + noise * np.random.default_rng(1).standard_normal(velocity.size)
    channels = {"velocity": measured, "set": velocity}
    return Record.create(
        1e-3 * np.arange(velocity.size), {n: channels[n] for n in names}, dict.fromkeys(names, "m/s"), name="moves"
    )


@pytest.mark.parametrize("noise", [0.0, 2e-3])
@pytest.mark.parametrize("setpoint", [None, "set"])
def test_every_speed_is_found(noise, setpoint):
    found = speed_plateaus(record(noise, ("velocity", "set")), setpoint=setpoint)
    means = sorted(float(np.mean(np.asarray(one.channel("velocity")))) for one in found)
    np.testing.assert_allclose(means, SPEEDS, rtol=0.01)
    for one in found:
        values = np.asarray(one.channel("velocity"))
        assert np.abs(values - values.mean()).max() < 0.02 * abs(values.mean()) + 5 * noise


def test_a_ramp_is_no_plateau():
    ramp = Record.create(1e-3 * np.arange(4000), {"velocity": np.linspace(0.0, 1.0, 4000)}, {"velocity": "m/s"})
    found = speed_plateaus(ramp, tolerance=0.005)
    assert all(float(one.times[-1] - one.times[0]) < 3.0 for one in found)
    assert speed_plateaus(ramp.slice(0.0, 1.0), tolerance=0.005) == ()


def test_lengths_that_cannot_be():
    with pytest.raises(InputError, match="needs 16"):
        speed_plateaus(record(), shortest=5e-3)
    with pytest.raises(InputError, match="tolerance"):
        speed_plateaus(record(), tolerance=0.0)


STUDY = """
[model]
type = "CurrentDrivenAxis"
torque_constant = "0.8 N m/A"
travel_per_turn = "10 mm"
mass = "1000 kg"
friction = { type = "CoulombViscousFriction", coulomb = "1 N", viscous = "1 N s/m", width = "1 mm/s" }
[data.run1]
file = "axis.csv"
[data.run1.channels]
position = { column = "Istposition", unit = "mm" }
current = { column = "Motorstrom", unit = "A" }
[identify]
procedure = "friction_curve"
"""


def test_a_curve_from_positions_and_currents_of_one_file(tmp_path, capsys):
    write_axis(tmp_path / "axis.csv")
    (tmp_path / "study.toml").write_text(STUDY)
    assert main(["identify", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]) == 0
    assert "run1: 10 stretches of constant speed" in capsys.readouterr().out
    table = pd.read_csv(tmp_path / "out" / "friction.csv")
    radius = LEAD / 2 / np.pi
    speed = table["speed [rad/s]"].to_numpy() * radius
    np.testing.assert_allclose(np.sort(speed), SPEEDS, rtol=0.01)
    force = TRUTH["friction.coulomb"] * np.sign(speed) + TRUTH["friction.viscous"] * speed + TRUTH["offset"]
    np.testing.assert_allclose(table["friction torque [N m]"], force * radius, rtol=0.01)
    assert len(json.loads((tmp_path / "out" / "summary.json").read_text())["points"]) == 10
    assert TORQUE_CONSTANT == 0.8
