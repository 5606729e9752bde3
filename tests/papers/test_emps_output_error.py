"""Output error on the measured EMPS axis: what the model reaches, fitted on the training record alone."""

import json
from itertools import pairwise

import numpy as np
import pytest

from fitting.identification.emps import run_emps_study, score
from fitting.identification.emps_model import emps_start, pulse_gain
from fitting.identification.emps_report import emps_summary, write_emps_report
from twin.io.data import DataNotFound
from twin.io.emps import read_emps

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def study():
    try:
        return run_emps_study()
    except DataNotFound as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def summary(study):
    return emps_summary(study)


def test_training_record_meets_the_goal(summary):
    """Published 5.85 % and 0.229 %; asked for 2.7 and 0.09, hoped for 1.9 and 0.06."""
    train = summary["output_error"]["train"]
    assert train["force_percent"] < 1.9
    assert train["velocity_percent"] < 0.06


def test_test_record_meets_the_goal(summary):
    """Published 8.94 % and 0.479 %; asked for 4.0 and 0.16, hoped for 3.5 and 0.14; also without the encoder's zero."""
    for key in ("test", "test_without_encoder_zero"):
        assert summary["output_error"][key]["force_percent"] < 3.5
        assert summary["output_error"][key]["velocity_percent"] < 0.14


def test_errors_stay_above_the_repeatability(summary):
    """A model that beats the cycle-to-cycle scatter would have been fed the answer."""
    assert summary["output_error"]["train"]["force_percent"] > summary["output_error"]["repeatability_percent"]


def test_model_is_chosen_on_the_training_record(study):
    held_back = [tried.held_back_square for tried in study.ladder]
    assert study.chosen == int(np.argmin(held_back))
    # Each rung contains the one before, so the fit can only get better.
    fitted = [tried.fitted_square for tried in study.ladder]
    assert all(b <= a * (1 + 1e-6) for a, b in pairwise(fitted))


def test_chosen_fit_converged_and_knows_its_parameters(study):
    assert study.fit.success
    assert np.all(np.isfinite(study.fit.standard_errors))
    assert not study.fit.active.any()
    assert 94.0 < study.fit["plant.plant.mass"].value < 97.0


def test_model_errors_that_hang_together_widen_the_intervals(study):
    """The same fit with independent errors claims far more than it knows."""
    from fitting.uncertainty import correlation_time

    assert correlation_time(study.fit.residual.reshape(2, -1)) > 10


def test_report_is_complete(study, tmp_path):
    text = write_emps_report(study, tmp_path)
    assert "Chosen (*)" in text
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert set(summary) == {"inverse_dynamics", "output_error", "models_tried", "seconds"}
    assert set(summary["inverse_dynamics"]) == {"symmetric", "asymmetric"}
    assert {"model", "train", "test"} <= set(summary["output_error"])
    for row in summary["models_tried"]:
        assert {"model", "parameters", "train", "test", "aic", "bic"} <= set(row)
    for name in ("train.png", "test.png", "residuals.png", "intervals.png", "correlation.png", "parameters.toml"):
        assert (tmp_path / name).stat().st_size > 0


def test_pulse_gain_is_read_from_the_record():
    """The file stores 5.07 V pulses as the byte 5."""
    try:
        data = read_emps(record="test")
    except DataNotFound as error:
        pytest.skip(str(error))
    assert pulse_gain(data) == pytest.approx(1.0139, abs=1e-3)


def test_start_of_the_record_follows_the_control_law():
    """The first two commands of the simulation are the recorded ones: the controller's memory is reconstructed."""
    try:
        data = read_emps()
    except DataNotFound as error:
        pytest.skip(str(error))
    model = emps_start(data)
    assert score(model, data).force_percent < 20
    from fitting.identification.emps import simulate_record

    command, _ = simulate_record(model, data)
    assert command[0] == pytest.approx(float(data.record.channel("voltage")[0]), abs=1e-9)
