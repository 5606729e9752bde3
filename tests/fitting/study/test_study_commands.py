"""The commands that ask a study's model, as a user types them."""

import json
import tomllib

import numpy as np
import pandas as pd
import pytest

from fitting.cli import main
from tests.fitting.study.two_mass_study import FIT, MODEL, TRUTH, truth, write_record, write_study
from twin.modal import damped_modes


def vibration(model):
    found = damped_modes(model.second_order())
    return float(found.frequency[int(np.flatnonzero(np.asarray(found.oscillating))[0])])


def test_simulate(tmp_path, capsys):
    text = MODEL + '\n[simulate]\nduration = "50 ms"\nrate = "4 kHz"\ninputs = { command = "1 A" }\n'
    assert main(["simulate", write_study(tmp_path, text), "--out", str(tmp_path / "out"), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["samples"] == 201
    assert summary["channels"]["position"]["unit"] == "rad"
    table = np.genfromtxt(tmp_path / "out" / "trajectory.csv", delimiter=",", names=True)
    assert table["position_rad"][-1] == pytest.approx(summary["channels"]["position"]["last"], rel=1e-12)
    # Both bodies together are accelerated by the torque, friction being slight.
    assert table["position_rad"][-1] == pytest.approx(0.5 * 0.5 / 5e-3 * 0.05**2, rel=0.1)
    assert "Simulation" in (tmp_path / "out" / "report.html").read_text()


def test_simulate_what_a_loop_follows(tmp_path, capsys):
    text = """
[model]
type = "SampledLoop"
period = "1 ms"
[model.plant]
type = "ServoAxis"
mass = "80 kg"
gain = "35 N/V"
friction = { type = "ViscousFriction", viscous = "100 N s/m" }
[model.controller]
type = "SampledPositionVelocity"
position_gain = "160 1/s"
velocity_gain = 240
[simulate]
duration = "0.3 s"
[simulate.reference]
type = "JerkLimitedMove"
distance = "20 mm"
velocity_limit = "0.3 m/s"
acceleration_limit = "5 m/s^2"
jerk_limit = "200 m/s^3"
[sweep]
outputs = ["last_error(position)", "max(command)"]
over = { "plant.mass" = ["60 kg", "80 kg", "100 kg"] }
"""
    study = write_study(tmp_path, text)
    assert main(["simulate", study, "--out", str(tmp_path / "out"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["channels"]["position"]["last"] == pytest.approx(0.02, abs=1e-4)
    assert main(["sweep", study, "--out", str(tmp_path / "sweep"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["points"] == 3
    assert found["failed"] == 0
    assert found["results"]["last_error(position)"]["unit"] == "m"


def test_sweep_of_modes_equals_the_modes(tmp_path, capsys):
    text = MODEL + (
        '\n[sweep]\noutputs = ["frequency(1)", "damping(1)"]\n'
        '[sweep.over]\nstiffness = { from = "50 N m/rad", to = "0.2 N m/mrad", count = 4 }\n'
    )
    assert main(["sweep", write_study(tmp_path, text), "--out", str(tmp_path / "out")]) == 0
    table = pd.read_csv(tmp_path / "out" / "sweep.csv")
    stiffness = next(name for name in table if name.startswith("stiffness"))
    frequency = next(name for name in table if name.startswith("frequency"))
    assert len(table) == 4
    for _, row in table.iterrows():
        assert row[frequency] == pytest.approx(vibration(truth(stiffness=row[stiffness])), rel=1e-6)
    assert (tmp_path / "out" / "sweep_frequency_1.png").exists()


@pytest.mark.parametrize("method", ["sobol", "derivative", "morris"])
def test_rank(tmp_path, capsys, method):
    text = MODEL + FIT.split("[data")[0] + f'\n[rank]\noutputs = ["frequency(1)"]\nsamples = 32\nmethod = "{method}"\n'
    assert main(["rank", write_study(tmp_path, text), "--out", str(tmp_path / "out"), "--json"]) == 0
    ranking = json.loads(capsys.readouterr().out)["ranking"]["frequency(1)"]
    assert next(iter(ranking)) == "stiffness"
    assert ranking["damping"] < 0.2 * ranking["stiffness"]


def test_frf(tmp_path, capsys):
    text = MODEL + '\n[frf]\nfrom = "5 Hz"\nto = "200 Hz"\noutputs = ["position", "load_position"]\n'
    assert main(["frf", write_study(tmp_path, text), "--out", str(tmp_path / "out"), "--json"]) == 0
    peaks = json.loads(capsys.readouterr().out)["peaks"]
    expected = np.sqrt(100.0 * (1 / 2e-3 + 1 / 3e-3)) / (2 * np.pi)
    assert peaks["load_position / command"][0] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(
    ("command", "table", "told"),
    [
        ("simulate", '[simulate]\nduration = "1 s"', "does not say what the model is to do"),
        ("simulate", '[simulate]\nduration = "1 kg"\ninputs = { command = 1 }', "time is expected"),
        ("simulate", '[simulate]\nduration = "1e9 s"\ninputs = { command = 1 }', "samples"),
        ("simulate", '[simulate]\nduration = "1 s"\ninputs = { comand = 1 }', "Did you mean 'command'"),
        ("simulate", '[simulate]\nduration = "1 s"\nreference = { type = "JerkLimitedMove" }', "no controller"),
        ("simulate", '[simulate]\nduraton = "1 s"', "Did you mean 'duration'"),
        ("sweep", "", r"[sweep] is missing"),
        ("sweep", '[sweep]\noutputs = ["frequency(1)"]', "names no parameter"),
        ("sweep", '[sweep]\noutputs = ["frequency(0)"]\nover = { stiffness = ["1 N m/rad"] }', "counted from 1"),
        ("sweep", '[sweep]\noutputs = ["maximum(position)"]\nover = { stiffness = ["1 N m/rad"] }', "known are"),
        (
            "sweep",
            '[sweep]\noutputs = ["max(positon)"]\nover = { stiffness = ["1 N m/rad"] }',
            "Did you mean 'position'",
        ),
        (
            "sweep",
            '[sweep]\noutputs = ["frequency(1)"]\nover = { stifness = ["1 N m/rad"] }',
            "Did you mean 'stiffness'",
        ),
        ("sweep", '[sweep]\noutputs = ["frequency(1)"]\nover = { stiffness = ["1 kg"] }', "expected"),
        ("sweep", '[sweep]\noutputs = ["frequency(1)"]\nover = { stiffness = "1 N m/rad" }', "must be a list"),
        ("rank", '[rank]\noutputs = ["frequency(1)"]', "no parameter is free"),
        ("frf", '[frf]\nfrom = "9 Hz"\nto = "5 Hz"', "does not lie above"),
        ("frf", '[frf]\noutputs = ["speed"]', "speed"),
        ("modes", '[modes]\npreload = "5 N m"', "has no preload"),
        ("identify", "", r"[identify] is missing"),
        ("identify", '[identify]\nprocedure = "twomass"', "Did you mean 'two_mass'"),
        ("identify", '[identify]\nprocedure = "preloaded_drive"', "RackPinionDrive"),
        ("fit", '[free]\nstiffness = { lower = "1 N m/rad", upper = "1e3 N m/rad" }', "there are no data"),
    ],
)
def test_bad_questions_are_one_line(tmp_path, capsys, command, table, told):
    code = main([command, write_study(tmp_path, MODEL + "\n" + table + "\n"), "--out", str(tmp_path / "out")])
    error = capsys.readouterr().err
    assert code == 2
    assert error.startswith("drivetwin: study file")
    assert told in error


def test_new_study_from_a_file(tmp_path, capsys, monkeypatch):
    write_record(tmp_path / "run.csv", count=200)
    monkeypatch.chdir(tmp_path)
    assert main(["new", "two-mass", "--data", "run.csv"]) == 0
    text = (tmp_path / "two-mass.toml").read_text()
    channels = tomllib.loads(text)["data"]["run1"]["channels"]
    assert {one["column"] for one in channels.values()} == {"i", "phi_m", "phi_l"}
    assert main(["new", "two-mass"]) == 2
    assert "--force" in capsys.readouterr().err
    assert main(["new", "three-mass"]) == 2
    assert "known are" in capsys.readouterr().err
    assert main(["new", "--json"]) == 0
    assert "servo-axis" in json.loads(capsys.readouterr().out)["drives"]


def test_identify_two_masses_from_a_response_file(tmp_path, capsys):
    from twin.export import write_frf_csv
    from twin.linear import frequency_response

    model = truth(**TRUTH)
    exact = frequency_response(
        model.second_order(), np.linspace(5.0, 120.0, 400), inputs=("command",), outputs=("position", "load_position")
    )
    write_frf_csv(tmp_path / "response.csv", exact)
    text = """
[model]
type = "TwoMass"
gain = "0.5 N m/A"
motor_inertia = "1 kg m^2"
load_inertia = "1 kg m^2"
stiffness = "1 N m/rad"
damping = "0 N m s/rad"
motor_friction = { type = "ViscousFriction", viscous = "0 N m s/rad" }
load_friction = { type = "ViscousFriction", viscous = "0 N m s/rad" }
[data.sweep]
kind = "frf"
file = "response.csv"
[identify]
procedure = "two_mass"
motor = "position"
load = "load_position"
"""
    assert main(["identify", write_study(tmp_path, text), "--out", str(tmp_path / "out"), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    found = {path: one["value"] for path, one in summary["parameters"].items()}
    assert found["plant.stiffness"] == pytest.approx(130.0, rel=1e-3)
    assert found["plant.load_inertia"] == pytest.approx(4.1e-3, rel=1e-3)
    assert summary["torque_constant"] == 0.5
    # Without a model nobody knows the torque constant, and everything is in units of it.
    bare = text[text.index("[data.sweep]") :]
    study = write_study(tmp_path, bare, "bare.toml")
    assert main(["identify", study, "--out", str(tmp_path / "bare"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["parameters"]
    assert found["plant.stiffness"]["value"] == pytest.approx(130.0 / 0.5, rel=1e-3)
    assert (tmp_path / "out" / "report.html").exists()
