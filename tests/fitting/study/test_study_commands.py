"""The commands that answer a study file, from text to result folder, as a user types them."""

import json
import tomllib

import jax
import numpy as np
import pytest

from fitting.cli import main
from fitting.study.study_file import read_study
from twin._tree_names import leaf_name
from twin.drives import TwoMass
from twin.io.parameter_file import read_parameters
from twin.laws import ViscousFriction
from twin.modal import damped_modes
from twin.references import SampledSignal
from twin.simulation import simulate

MODEL = """
[study]
title = "two masses"

[model]
type = "TwoMass"
motor_inertia = "2e-3 kg m^2"
load_inertia = "30 kg cm^2"
stiffness = "100 N m/rad"
damping = "0.02 N m s/rad"
gain = "0.5 N m/A"
motor_friction = { type = "ViscousFriction", viscous = "5e-3 N m s/rad" }
load_friction = { type = "ViscousFriction", viscous = "2e-3 N m s/rad" }
"""
FIT = """
[free]
load_inertia = { lower = "5e-4 kg m^2", upper = "2e-2 kg m^2", scale = "log" }
stiffness = { lower = "10 N m/rad", upper = "1000 N m/rad", scale = "log" }
damping = { lower = "0 N m s/rad", upper = "0.2 N m s/rad" }

[data.run1]
file = "records/run1.csv"
inputs = { command = "current" }

[data.run1.channels]
current = { column = "i" }
position = { column = "phi_m", deviation = "0.01 deg" }
load_position = { column = "phi_l", deviation = "0.01 deg" }
"""
TRUTH = {"load_inertia": 4.1e-3, "stiffness": 130.0, "damping": 0.03}


def truth(**changes):
    values = {"motor_inertia": 2e-3, "load_inertia": 3e-3, "stiffness": 100.0, "damping": 0.02} | changes
    return TwoMass(**values, motor_friction=ViscousFriction(5e-3), load_friction=ViscousFriction(2e-3), gain=0.5)


def write_record(file, *, model=None, seed=1, count=1200):
    """A pseudo-random current through the drive: semicolons, decimal commas, milliseconds, degrees."""
    file.parent.mkdir(exist_ok=True, parents=True)
    random = np.random.default_rng(seed)
    times = np.arange(count) * 5e-4
    current = np.repeat(random.choice([-2.0, 2.0], count // 20 + 1), 20)[:count] * (times > 0.02)
    plant = model or truth(**TRUTH)
    rest = plant.rest_inputs()
    names = [leaf_name(keys) for keys, _ in jax.tree_util.tree_leaves_with_path(rest)]
    signal = SampledSignal(times, type(rest)(*(current if name == "command" else 0 * times for name in names)))
    outputs = simulate(plant, signal, times).outputs
    noise = np.radians(0.01) * random.standard_normal((2, count))
    columns = [times * 1e3, current, *np.degrees(np.stack([outputs.position, outputs.load_position]) + noise)]
    rows = [";".join(f"{value:.6f}".replace(".", ",") for value in row) for row in np.transpose(columns)]
    file.write_text("Zeit [ms];i [A];phi_m [deg];phi_l [deg]\n" + "\n".join(rows) + "\n", encoding="utf-8")


def write_study(folder, text, name="study.toml"):
    folder.mkdir(exist_ok=True, parents=True)
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fitted")
    write_record(folder / "records" / "run1.csv")
    study = write_study(folder, MODEL + FIT)
    code = main(["fit", study, "--out", str(folder / "out")])
    return folder, code


def test_fit_finds_the_truth(fitted):
    folder, code = fitted
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert code == 0
    assert summary["converged"]
    for path, true in TRUTH.items():
        one = summary["parameters"][path]
        assert abs(one["value"] - true) < 4 * one["standard_error"]
        low, high = one["interval_95"]
        assert low < one["value"] < high
        assert one["verdict"] == "identified"
    assert 0.9 < summary["rms"] < 1.1
    assert all(control["passed"] for control in summary["controls"])
    assert len(summary["controls"]) == 2
    assert "jax" in summary["versions"]
    assert len(summary["data"]["run1"]["sha256"]) == 64


def test_result_folder_is_complete(fitted):
    folder, _ = fitted
    out = folder / "out"
    entries = {entry.path: entry for entry in read_parameters(out / "parameters.toml")}
    assert entries["stiffness"].unit == "N m/rad"
    page = (out / "report.html").read_text()
    assert "two masses" in page
    assert "<script>" not in page.replace('<script type="text/javascript">', "")
    assert (out / "fit_run1.png").stat().st_size > 10_000


def test_a_run_can_be_repeated_from_its_folder(fitted, capsys):
    folder, _ = fitted
    before = json.loads((folder / "out" / "summary.json").read_text())
    assert main(["fit", str(folder / "out" / "study.toml"), "--out", str(folder / "again"), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["parameters"] == before["parameters"]
    assert again["data"] == before["data"]


def test_the_fitted_study_goes_on(fitted, capsys):
    folder, _ = fitted
    model = read_study(folder / "out" / "fitted.toml").model
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert float(model.stiffness) == summary["parameters"]["stiffness"]["value"]
    assert main(["modes", str(folder / "out" / "fitted.toml"), "--out", str(folder / "modes"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["modes"]
    assert len(found) == 1
    assert found[0]["frequency_Hz"] == pytest.approx(float(damped_modes(model.second_order()).frequency[0]), rel=1e-9)


def test_fit_does_not_write_over_results(fitted, capsys):
    folder, _ = fitted
    assert main(["fit", str(folder / "study.toml"), "--out", str(folder / "out")]) == 2
    assert "--force" in capsys.readouterr().err


@pytest.mark.slow
def test_many_starts_and_data_held_back(tmp_path, capsys):
    write_record(tmp_path / "records" / "run1.csv")
    write_record(tmp_path / "records" / "run2.csv", seed=2)
    second = FIT[FIT.index("[data.run1]") :].replace("run1", "run2")
    more = '\n[fit]\nstarts = 8\nhold_back = ["run2"]\n'
    assert (
        main(["fit", write_study(tmp_path, MODEL + FIT + second + more), "--out", str(tmp_path / "out"), "--json"]) == 0
    )
    summary = json.loads(capsys.readouterr().out)
    assert summary["held_back"] == ["run2"]
    assert summary["starts"]["drawn"] == 8
    assert summary["relative_errors"]["run2"]["position"] < 0.05
    assert any("held back" in control["name"] and control["passed"] for control in summary["controls"])
    assert "waterfall" in (tmp_path / "out" / "report.html").read_text().lower() or summary["starts"]["converged"] >= 1


BAD_DATA = [
    ('file = "records/run1.csv"', 'file = "records/run9.csv"', "does not exist"),
    ('file = "records/run1.csv"', 'file = "../../../etc"', "does not exist"),
    ('column = "i"', 'column = "j"', "j"),
    ('{ command = "current" }', '{ comand = "current" }', "Did you mean 'command'"),
    ('{ command = "current" }', '{ command = "curent" }', "Did you mean 'current'"),
    ('inputs = { command = "current" }', 'reference = "current"\ninputs = { command = "current" }', "stands beside"),
    ('inputs = { command = "current" }', "", "what drove the drive"),
    ('inputs = { command = "current" }', 'inputs = { command = "current" }\ncompare = ["speed"]', "speed"),
    ('deviation = "0.01 deg"', 'deviation = "0.01 mm"', "expected"),
    ('deviation = "0.01 deg"', 'deviation = "-1 deg"', "must be positive"),
    ('column = "phi_m"', 'colum = "phi_m"', "Did you mean 'column'"),
    ('column = "phi_m"', 'column = "phi_m", unit = "mm"', ""),
    ('inputs = { command = "current" }', 'inputs = { command = "current" }\nstart = "9 s"', ""),
    ('inputs = { command = "current" }', 'inputs = { command = "current" }\nrate = "-5 Hz"', "must be positive"),
    ('inputs = { command = "current" }', 'inputs = { command = "current" }\nkind = "film"', "known are"),
    ("[data.run1]", '[data.run1]\nformat = "docx"', "docx"),
]


@pytest.mark.parametrize(("old", "new", "told"), BAD_DATA)
def test_bad_data_sections_are_one_line(tmp_path, capsys, old, new, told):
    text = MODEL + FIT
    assert old in text
    write_record(tmp_path / "records" / "run1.csv", count=200)
    code = main(["fit", write_study(tmp_path, text.replace(old, new, 1)), "--out", str(tmp_path / "out")])
    error = capsys.readouterr().err
    assert code == 2
    assert error.startswith("drivetwin: study file")
    assert "line " in error
    assert told in error
    assert "Traceback" not in error


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
    table = np.genfromtxt(tmp_path / "out" / "sweep.csv", delimiter=",", names=True)
    for row in table:
        model = truth(stiffness=row[0])
        found = damped_modes(model.second_order())
        chosen = int(np.flatnonzero(np.asarray(found.oscillating))[0])
        assert row[1] == pytest.approx(float(found.frequency[chosen]), rel=1e-6)
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
    # Without the torque constant everything is in units of it.
    assert found["plant.stiffness"] == pytest.approx(130.0 / 0.5, rel=1e-3)
    assert found["plant.load_inertia"] == pytest.approx(4.1e-3 / 0.5, rel=1e-3)
    assert (tmp_path / "out" / "report.html").exists()
