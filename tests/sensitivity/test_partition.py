"""Partition by total effect: the three classes, groups, the paper's rule, and what a reader sees."""

import numpy as np
import pytest

from sensitivity import SobolIndices, partition, sobol
from tests.sensitivity_functions import ISHIGAMI, LINEAR, ishigami, linear
from twin.parameters import Parameter, ParameterSpace

SPACE = ParameterSpace([Parameter(path, "N/m", 1.0, 2.0) for path in ("a.k", "b.k", "c.k", "d.k")])


def study(total, half, groups=SPACE.paths):
    total, half = np.atleast_2d(total), np.atleast_2d(half)
    shape = (1, *total.shape)
    empty = np.zeros((total.shape[0], 0, 0))
    return SobolIndices(
        space=SPACE,
        groups=groups,
        outputs=tuple(f"mode {i + 1}" for i in range(total.shape[0])),
        variance=np.ones(total.shape[0]),
        sizes=np.asarray([64]),
        S1_by_size=np.zeros(shape),
        S1_conf_by_size=np.zeros(shape),
        ST_by_size=total[None],
        ST_conf_by_size=half[None],
        S2=empty,
        S2_conf=empty,
        seed=1,
        confidence=0.95,
        resamples=100,
    )


def test_three_classes_by_where_the_interval_lies():
    found = partition(study([0.5, 0.012, 0.008, 0.001], [0.1, 0.005, 0.005, 0.002]), 0.01)
    assert found.verdict.tolist() == [["in", "undecided", "undecided", "out"]]
    assert found.searched("mode 1") == found.searched(0) == ("a.k", "b.k", "c.k")
    assert found.searched_per_problem == {"mode 1": 3}
    assert found.never_searched == ("d.k",)


def test_the_paper_compares_the_estimate_alone():
    found = partition(study([0.5, 0.012, 0.008, 0.001], [0.1, 0.005, 0.005, 0.002]), 0.01, interval=False)
    assert found.verdict.tolist() == [["in", "in", "out", "out"]]


@pytest.mark.parametrize("total, half, verdict", [(0.01, 0.0, "out"), (0.0, 0.0, "out"), (0.02, 0.01, "undecided")])
def test_an_interval_that_ends_on_the_threshold(total, half, verdict):
    assert partition(study([total] * 4, [half] * 4), 0.01).verdict[0, 0] == verdict


def test_a_group_is_searched_as_a_whole():
    indices = study([0.5, 0.001, 0.2], [0.0, 0.0, 0.0], groups=("mount", "b.k", "mount", "d.k"))
    found = partition(indices)
    assert found.names == ("mount", "b.k", "d.k")
    assert found.searched("mode 1") == ("a.k", "c.k", "d.k")
    assert found.searched_per_problem == {"mode 1": 3}


def test_a_reader_sees_one_row_per_output():
    found = partition(study([[0.05, 0.6, 0.02, 0.0], [0.0, 0.0, 0.9, 0.0]], [[0.01, 0.1, 0.05, 0.0], [0.0] * 4]))
    table = found.to_dataframe()
    assert table.loc["mode 1", "c.k"] == "undecided"
    assert table.loc["mode 2"].tolist() == ["out", "out", "in", "out"]
    summary = found.summary()
    assert summary.loc["mode 1"].tolist() == [3, "b.k, a.k", "c.k"]
    assert repr(found).startswith("mode 1: b.k, a.k (undecided: c.k)\nmode 2: c.k\n")
    assert "1 to 3 of 4 parameters searched per output" in repr(found)
    assert "No output sees d.k" in repr(found)
    assert "<table" in found._repr_html_()


def test_ishigami_searches_all_and_a_linear_model_leaves_out_what_has_no_slope():
    assert partition(sobol(ishigami, ISHIGAMI, n=256, seed=1)).searched(0) == ("x1", "x2", "x3")
    found = partition(sobol(linear, LINEAR, n=256, seed=1))
    assert found.searched(0) == ("x1", "x2", "x3")
    assert found.verdict[0, 3] == "out"
