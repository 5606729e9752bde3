"""Ellinger and Zaeh on the reference machine, as the command line repeats it: tables 2 to 5, and every truth."""

import json

import numpy as np
import pandas as pd
import pytest
from reproduced import reproduced

pytestmark = pytest.mark.slow
MEASURES = ("frac", "csf", "macxp", "ndd")
# Tables 2 to 5: worst, 5 % percentile, mean, median [%].
PRINTED = {
    2: {
        "frac": (84.93, 86.21, 94.92, 96.12),
        "csf": (91.72, 92.78, 97.17, 98.04),
        "macxp": (99.86, 99.88, 99.97, 100.00),
        "ndd": (4.10, 1.99, 0.52, 0.27),
    },
    3: {
        "frac": (79.17, 79.41, 90.21, 91.63),
        "csf": (88.43, 88.78, 94.19, 95.58),
        "macxp": (99.86, 99.89, 99.98, 100.00),
        "ndd": (5.48, 4.73, 1.07, 0.24),
    },
    4: {
        "frac": (92.15, 96.70, 99.26, 99.85),
        "csf": (95.73, 97.15, 99.49, 99.91),
        "macxp": (99.92, 99.96, 99.99, 100.00),
        "ndd": (1.69, 1.51, 0.40, 0.25),
    },
    5: {
        "frac": (97.53, 98.41, 99.60, 99.83),
        "csf": (97.36, 98.36, 99.64, 99.91),
        "macxp": (88.57, 89.78, 98.65, 99.99),
        "ndd": (40.65, 39.83, 6.05, 0.43),
    },
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return reproduced(
        "ellinger", tmp_path_factory.mktemp("ellinger"), says="Ideal model, 20 random truths", timeout=1800
    )


@pytest.fixture(scope="module")
def summary(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def test_the_ideal_model_gives_every_truth(summary):
    by_truth = summary["ideal"]["by_truth"]
    assert len(by_truth) == 20
    assert sum(one["stiffness_worst_percent"] <= 0.1 for one in by_truth) == 20
    assert sum(one["damping_worst_percent"] <= 1.0 for one in by_truth) == 20
    assert len(summary["ideal"]["stiffness_error_percent"]) == 16
    assert len(summary["ideal"]["damping_error_percent"]) == 11
    assert max(one["worst"] for one in summary["ideal"]["stiffness_error_percent"].values()) <= 0.1


def test_the_disturbed_model_comes_close(summary):
    by_truth = summary["disturbed"]["by_truth"]
    assert len(by_truth) == 10
    assert sum(one["stiffness_median_percent"] <= 0.5 for one in by_truth) >= 9
    assert sum(one["stiffness_worst_percent"] <= 1.0 for one in by_truth) >= 9
    assert min(one["validation"]["macxp_worst"] for one in by_truth) >= 99.0
    assert min(one["validation"]["frac_mean"] for one in by_truth) >= 99.8


@pytest.mark.parametrize("number", sorted(PRINTED))
def test_tables_are_better_in_every_entry_after_the_joint_fit(summary, folder, number):
    case = "ideal" if number < 4 else "disturbed"
    where = "identification" if number % 2 == 0 else "validation"
    ours = summary[case]["tables"]["refined"][where]
    written = pd.read_csv(folder / f"table{number}.csv", header=[0, 1], index_col=0)
    for measure in MEASURES:
        # As printed, with two digits: 100.00 cannot be beaten.
        found, printed = np.round(list(ours[measure].values()), 2), np.asarray(PRINTED[number][measure])
        assert np.all(found <= printed if measure == "ndd" else found >= printed), measure
        np.testing.assert_array_equal(written[measure.upper(), "paper"], printed)
    assert ours["frac"]["worst"] > 99.0
    assert ours["unpaired"] == 0


def test_the_published_procedure_is_repeated_in_full(summary):
    assert summary["gsa"]["n"] == 1024 and summary["gsa"]["analyses"] == 120
    assert len(summary["gsa"]["searched_per_problem"]) == 60
    assert 0 < min(summary["gsa"]["searched_per_problem"]) <= max(summary["gsa"]["searched_per_problem"]) <= 16
    assert summary["multistart"]["solves"] == 6000
    assert all(failed < 300 for failed in summary["failed_by_case"].values())
    screening = summary["gsa"]["screening"]
    assert screening["cleared"] > 500 and screening["cleared_wrongly"] == 0
    selected = summary["ideal"]["paper_selection"]
    # As in the paper most stiffnesses come out well and a few do not; the joint fit mends all.
    assert selected["published"]["stiffness_median"] < 3.0
    assert selected["published"]["stiffness_worst"] > 1.0
    assert selected["refined"]["stiffness_worst"] < 0.1
    assert selected["refined"]["damping_worst"] < 1.0
    # Under model error the printed rule picks runs that end on a bound; the robust one is right in the median.
    selected = summary["disturbed"]["paper_selection"]
    assert selected["published"]["stiffness_worst"] > 10.0
    assert selected["robust"]["stiffness_median"] < 1.0


def test_dampings_dealt_to_others_are_worse(summary):
    tables = summary["ideal"]["tables"]
    assert tables["permuted"]["validation"]["ndd"]["mean"] > tables["published"]["validation"]["ndd"]["mean"]


def test_files_are_written(folder):
    names = {path.name for path in folder.iterdir()}
    tables = {f"table{i}.csv" for i in (2, 3, 4, 5)}
    pictures = {"fig2_runs.png", "fig5_sensitivity.png", "fig6_deviations.png", "fig7_response.png"}
    pictures |= {"fig8_deviations.png", "fig9_response.png", "effects_macxp.png", "effects_ndd.png"}
    studies = {f"{what}_{case}.csv" for what in ("sensitivity", "problems") for case in ("ideal", "disturbed")}
    assert names >= tables | pictures | studies | {"summary.json", "parameters.toml"}
