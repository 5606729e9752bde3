"""What a study's fit tells of names that do not match, of samples taken otherwise, and of noise taken too large."""

import dataclasses
import json

import numpy as np
import pytest

from fitting.cli import main
from fitting.study.evidence import read_data
from fitting.study.fit_run import fit_study
from fitting.study.lowered_noise import lowered_noise
from fitting.study.study_file import read_study
from tests.fitting.study.two_mass_study import FIT, MODEL, TRUTH, truth, write_record, write_study


def test_a_channel_that_is_not_used_is_told(tmp_path):
    write_record(tmp_path / "records" / "run1.csv", count=100)
    study = read_study(write_study(tmp_path, MODEL + FIT.replace("load_position = {", "position_2 = {")))
    (told,) = read_data(study).warnings
    assert "'position_2' is not used" in told
    assert "load_position" in told
    assert read_data(read_study(write_study(tmp_path, MODEL + FIT, "whole.toml"))).warnings == ()


def test_samples_read_as_held_are_found_out_and_the_exit_code_says_so(tmp_path, capsys):
    write_record(tmp_path / "records" / "run1.csv")
    study = write_study(tmp_path, MODEL + FIT.replace("inputs =", "hold = true\ninputs ="))
    code = main(["fit", study, "--out", str(tmp_path / "out"), "--json"])
    summary = json.loads(capsys.readouterr().out)
    assert "set hold = false" in summary["warnings"][0]
    assert code == (0 if all(control["passed"] for control in summary["controls"]) else 1)


def test_noise_is_lowered_to_what_the_fit_leaves(tmp_path):
    write_record(tmp_path / "records" / "run1.csv")
    data = read_data(read_study(write_study(tmp_path, MODEL + FIT)))
    (one,) = data.records
    true, sigma = truth(**TRUTH), np.radians(0.01)
    assert lowered_noise(data, ["run1"], true) is None  # it was given, not read
    read = {"noise_read": ("position",)}
    large = dataclasses.replace(one, deviation={"position": 10 * sigma, "load_position": 10 * sigma}, **read)
    found = lowered_noise(dataclasses.replace(data, records=(large,)), ["run1"], true)
    assert found is not None
    assert found.records[0].deviation["position"] == pytest.approx(sigma, rel=0.1)
    assert found.records[0].deviation["load_position"] == 10 * sigma
    assert "lowered" in found.remarks[-1]
    # What is left above the noise is the model's fault, and is not called noise.
    small = dataclasses.replace(one, deviation={"position": sigma / 10, "load_position": sigma}, **read)
    assert lowered_noise(dataclasses.replace(data, records=(small,)), ["run1"], true) is None


def test_too_few_steps_say_what_to_write(tmp_path, capsys):
    write_record(tmp_path / "records" / "run1.csv", count=200)
    study = write_study(tmp_path, MODEL + FIT + "[fit]\nmax_steps = 1\ncontrols = false\n")
    assert main(["fit", study, "--out", str(tmp_path / "out")]) == 1
    told = capsys.readouterr().out
    assert "max_steps = 4" in told
    assert "fitted.toml" in told


def test_noise_that_nobody_gave_does_not_change_the_answer(tmp_path):
    write_record(tmp_path / "records" / "run1.csv")
    given = fit_study(read_study(write_study(tmp_path, MODEL + FIT + "[fit]\ncontrols = false\n"))).result
    bare = FIT.replace(', deviation = "0.01 deg"', "")
    read = fit_study(read_study(write_study(tmp_path, MODEL + bare + "[fit]\ncontrols = false\n", "bare.toml"))).result
    np.testing.assert_allclose(read.values, given.values, atol=0.5 * given.standard_errors.max(), rtol=1e-2)
    assert 0.8 < read.rms < 1.25
