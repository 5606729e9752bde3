"""Leipe et al. on the simulated bench, as the command line repeats it: each figure of merit, and beyond."""

import json

import numpy as np
import pytest
from reproduced import reproduced

pytestmark = pytest.mark.slow
PUBLISHED_TORQUE_ERRORS = (0.4042, 0.3271)
FITTED = [8.0, 12.0, 20.0, 30.0, 50.0, 75.0, 100.0]
LAWS = [
    f"drive.train_1.mesh.{name}" for name in ("stiffness.k1", "stiffness.k2", "damping.d1", "damping.d2", "damping.d3")
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return reproduced("leipe", tmp_path_factory.mktemp("leipe"), says="Validation move", timeout=900)


@pytest.fixture(scope="module")
def summary(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def test_printed_laws_come_back(summary):
    printed = {"stiffness": {"k1": 1.8709e7, "k2": 5.6406}, "damping": {"d1": 9.5376e5, "d2": 148.3813, "d3": 2.0734e4}}
    for kind, limit in (("stiffness", 4.01), ("damping", 4.51)):
        for name, value in printed[kind].items():
            assert summary["curve_fit"][kind][name] == pytest.approx(value, rel=1e-6)
        scattered = summary["curve_fit"][kind]["with_4_percent_scatter"]
        assert scattered["error_percent"] <= limit
        for name, value in printed[kind].items():
            low, high = scattered[name]["interval_95"]
            assert (low is None or low <= value) and (high is None or value <= high)


def chain(summary, estimator):
    return {row["preload_percent"]: row for row in summary["chain"] if row["estimator"] == estimator}


@pytest.mark.parametrize(("estimator", "k_limit", "d_limit"), [("paper", 0.06, 0.10), ("exact", 0.01, 0.04)])
def test_chain_reads_totals(summary, estimator, k_limit, d_limit):
    rows = chain(summary, estimator)
    assert [p for p, row in rows.items() if row["used"]] == FITTED
    for percent in FITTED:
        row = rows[percent]
        assert row["k"] == pytest.approx(row["k_true"], rel=k_limit)
        assert row["d"] == pytest.approx(row["d_true"], rel=d_limit)


def test_bias_of_the_printed_estimator_is_the_one_derived(summary):
    # Both estimators read one point; their ratio is 1 + 1/|G|² exactly, near 1 + 4·D².
    paper, exact = chain(summary, "paper"), chain(summary, "exact")
    for percent in FITTED:
        ratio = paper[percent]["k"] / exact[percent]["k"]
        assert ratio == pytest.approx(1 + 1 / exact[percent]["magnitude"] ** 2, rel=1e-12)
        assert 1.02 < ratio < 1.06


def test_natural_frequency_and_peak_rise_with_preload(summary):
    rows = [chain(summary, "exact")[percent] for percent in FITTED]
    assert np.all(np.diff([row["natural_frequency_hz"] for row in rows]) > 0)
    magnitude = np.asarray([row["magnitude"] for row in rows])
    assert magnitude[-1] > 1.1 * magnitude[0]
    # Neighbours differ by less than the random error of a sweep allows to tell.
    assert np.all(np.diff(magnitude) > -0.01 * magnitude[:-1])


def test_sweep_is_linear_at_high_preload_and_not_at_low(summary):
    rows = {row["preload_percent"]: row for row in summary["linearised"]}
    for percent in (50.0, 75.0, 100.0):
        assert rows[percent]["over_random_error"] < 1.2
    assert rows[8.0]["over_random_error"] > 2.0
    assert rows[0.0]["relative_error"] > 10 * rows[100.0]["relative_error"]


@pytest.mark.parametrize("evidence", ["frf", "time", "joint"])
def test_direct_fits_find_the_curves(summary, evidence):
    found = summary["direct"][evidence]
    assert found["largest_stiffness_error_percent"] < 1.0
    assert found["largest_damping_error_percent"] < 3.0


def test_joint_intervals_are_no_wider(summary):
    errors = {
        name: [summary["direct"][name]["parameters"][path]["standard_error"] for path in LAWS]
        for name in ("frf", "time", "joint")
    }
    curves = {name: summary["direct"][name]["largest_interval_percent"] for name in errors}
    for single in ("frf", "time"):
        assert np.all(np.asarray(errors["joint"]) <= errors[single])
        assert all(curves["joint"][law] <= curves[single][law] for law in ("stiffness", "damping"))


def test_validation_torques(summary):
    errors = summary["validation"]["mae_nm"]
    assert all(error < published for error, published in zip(errors, PUBLISHED_TORQUE_ERRORS, strict=True))
    assert max(errors + summary["validation"]["mae_while_moving_nm"]) < 0.15


def test_swarm_pays_a_hundred_times_more(summary):
    for law in ("stiffness", "damping"):
        counts = summary["swarm"][law]
        assert counts["evaluations"] >= 100 * counts["gradient_evaluations"]


def test_static_play_agrees(summary):
    play = summary["static"]["mesh.backlash.play"]
    assert abs(play["value"] - 40e-6) < 3 * play["standard_error"] + 5e-7


def test_outlook(summary):
    for errors in summary["reconstruction_um"].values():
        assert errors["reconstructed"] < 0.5 * errors["mean of the motors"]
    losses = [choice["extra_loss_w"] for choice in summary["preload_choice"]]
    assert np.all(np.diff(losses) > 0)


def test_pictures_and_parameters_are_written(folder):
    names = ["fig4_responses", "fig5_quadrants", "fig6_stiffness", "fig7_damping", "fig8_validation", "curves"]
    for name in [*names, "preload_choice"]:
        assert (folder / f"{name}.png").stat().st_size > 10_000
    assert "backlash.play" in (folder / "parameters.toml").read_text(encoding="utf-8")
