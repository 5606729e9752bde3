"""`drivetwin fit`, from text to result folder, as a user types it."""

import json

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.cli import main
from fitting.result import FitResult
from fitting.study.study_file import read_study
from tests.fitting.study.two_mass_study import FIT, MODEL, TRUTH, write_record, write_study
from twin.io.parameter_file import read_parameters
from twin.modal import damped_modes


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
    assert summary["warnings"] == []
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
    exact = damped_modes(model.second_order())
    vibrating = np.asarray(exact.frequency)[np.asarray(exact.oscillating)]
    assert found[0]["frequency_Hz"] == pytest.approx(float(vibrating[0]), rel=1e-9)
    ratio = found[0]["damping_ratio"]
    assert found[0]["damped_frequency_Hz"] == pytest.approx(found[0]["frequency_Hz"] * np.sqrt(1 - ratio**2))
    assert found[0]["frequency_error_Hz"] == pytest.approx(_carried_over(folder, model), rel=1e-3)
    # A folder stands for the fit in it; a study that no fit wrote has no errors.
    assert main(["modes", str(folder / "out"), "--out", str(folder / "modes2")]) == 0
    assert " ± " in capsys.readouterr().out
    assert main(["modes", str(folder / "study.toml"), "--out", str(folder / "modes3")]) == 0
    assert " ± " not in capsys.readouterr().out


def _carried_over(folder, model):
    """√(J·Σ·Jᵀ) of the first frequency, by differences."""
    fit = FitResult.load(folder / "out" / "fit.npz", model)

    def frequency(values):
        found = damped_modes(fit.space.with_values(model, jnp.asarray(values)).second_order())
        return float(np.asarray(found.frequency)[np.asarray(found.oscillating)][0])

    steps = np.diag(1e-5 * fit.values)
    slopes = [(frequency(fit.values + h) - frequency(fit.values - h)) / (2 * h.max()) for h in steps]
    return np.sqrt(slopes @ fit.covariance @ slopes)


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
