"""Pictures of a machine's identification: what is drawn, in the axes given."""

import jax.numpy as jnp
import matplotlib
import matplotlib.pyplot
import numpy as np
import pytest

from fitting.identification.machine_part_runs import PartRuns
from fitting.identification.machine_selection import select_stiffness
from fitting.plots_machine import plot_conformity, plot_deviations, plot_part_runs
from twin._checks import InputError
from twin.frf import FRF
from twin.parameters import Parameter, ParameterSpace

matplotlib.use("Agg")

SPACE = ParameterSpace([Parameter(f"joints.foot.stiffness.{d}", "N/m", 1.0, 3.0) for d in "xy"])
PATH = SPACE.paths[0]


@pytest.fixture(autouse=True)
def _close():
    yield
    matplotlib.pyplot.close("all")


@pytest.fixture
def selection():
    """Two problems that search the first stiffness, the second of which agrees; its last run failed."""
    value = np.full((3, 4, 2), 2.0)
    value[0, :, 0] = (1.0, 1.5, 2.5, 3.0)
    value[1, :, 0] = (2.0, 2.01, 2.02, 2.9)
    searched = np.array([[True, False], [True, False], [False, True]])
    stop = np.full((3, 4), "converged", dtype=object)
    stop[1, 3] = "too_many_steps"
    macxp = np.full((3, 4), 0.999)
    steps, again = np.ones((3, 4), dtype=int), np.zeros((3, 4), dtype=int)
    problems = ("mode 1 at +0 mm", "mode 2 at +0 mm", "mode 3 at +0 mm")
    runs = PartRuns(SPACE, np.arange(2), problems, searched, value, value, macxp, macxp, stop, steps, again)
    return select_stiffness(runs)


def test_runs_that_did_not_fail_are_drawn_and_the_chosen_problem_is_red(selection):
    ax = plot_part_runs(selection, PATH, truth=2.0, name="k_x")
    points = [line for line in ax.lines if line.get_marker() == "."]
    assert [line.get_ydata().size for line in points] == [4, 3]
    assert [line.get_color() for line in points] == ["0.45", "C3"]
    assert [text.get_text() for text in ax.get_xticklabels()] == ["mode 1 at +0 mm", "mode 2 at +0 mm"]
    assert ax.get_ylabel() == "k_x [N/m]"


def test_a_stiffness_that_was_not_searched_is_refused(selection):
    with pytest.raises(InputError, match="no stiffness of these runs"):
        plot_part_runs(selection, "joints.foot.stiffness.z")


def test_the_histogram_names_median_and_worst():
    ax = plot_deviations({"ME1 k_x": -21.2, "ME1 k_y": 0.0, "ME1 k_z": 1.0}, bins=3)
    assert sum(patch.get_height() for patch in ax.patches) == 3
    texts = " ".join(text.get_text() for text in ax.get_legend().get_texts())
    assert "median 0 %" in texts and "ME1 k_x, -21 %" in texts
    assert "[%]" in ax.get_xlabel()


@pytest.mark.parametrize("bad", [{}, {"k": np.nan}])
def test_a_histogram_of_nothing_is_refused(bad):
    with pytest.raises(InputError, match="finite number"):
        plot_deviations(bad)


def test_responses_lie_over_each_other_with_an_inset():
    frequency = np.linspace(10.0, 100.0, 50)
    reference = FRF(
        jnp.asarray(frequency),
        jnp.asarray((1e-8 / (1 + 0.02j * frequency))[None, None]),
        ("N6 x",),
        ("N6 x",),
        "receptance",
    )
    ax = plot_conformity(reference, {"identified": reference}, "N6 x", "N6 x", linear=(20.0, 60.0))
    assert ax.get_yscale() == "log"
    (inset,) = ax.child_axes
    assert inset.get_yscale() == "linear" and inset.get_xlim() == (20.0, 60.0)
    np.testing.assert_allclose(ax.lines[1].get_ydata(), np.abs(reference.values[0, 0]))
    inside = (frequency >= 20) & (frequency <= 60)
    np.testing.assert_allclose(inset.lines[0].get_ydata()[inside], 1e6 * np.abs(reference.values[0, 0])[inside])
