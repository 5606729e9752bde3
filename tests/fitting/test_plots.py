"""Plots of fits: labels with units, the data drawn, marks for what has no interval, and cases with nothing to draw."""

import dataclasses

import matplotlib
import matplotlib.pyplot
import numpy as np
import pytest

from fitting.fit import fit
from fitting.plots import plot_comparison, plot_correlation, plot_intervals, plot_residual, save_figure
from fitting.plots_convergence import plot_convergence
from fitting.plots_diagnostics import plot_autocorrelation, plot_diagnostics, plot_quantiles, plot_sequence
from tests.fitting.curves import LINE_X as X
from tests.fitting.curves import LINE_Y as Y
from tests.fitting.curves import Line, LineResidual
from twin._axes import grid_or_new
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

matplotlib.use("Agg")


RESIDUAL = LineResidual(X, Y, 0.1)
START = Line(1.0, 1.0, 4.0)
BOUNDED = ParameterSpace([Parameter("a", "m", 0.0, 2.0), Parameter("b", "m/s"), Parameter("unused", "kg")])


@pytest.fixture(autouse=True)
def _close():
    yield
    matplotlib.pyplot.close("all")


@pytest.fixture(scope="module")
def result():
    return fit(RESIDUAL, START, ParameterSpace([Parameter("a", "m"), Parameter("b", "m/s")]))


@pytest.fixture(scope="module")
def bounded():
    return fit(RESIDUAL, START, BOUNDED)


@pytest.fixture(scope="module")
def failed():
    bad = LineResidual(X, np.where(X > 1, np.nan, Y), 0.1)
    return fit(bad, START, ParameterSpace([Parameter("a", "m"), Parameter("b", "m/s")]))


def labels(ax):
    return ax.get_xlabel(), ax.get_ylabel()


def legend(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def drawn(ax, label):
    (line,) = [line for line in ax.lines if line.get_label() == label]
    return np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)


def test_comparison_and_residual():
    ax = plot_comparison(X, Y, Y + 1, label="position", unit="m")
    assert labels(ax) == ("time [s]", "position [m]")
    np.testing.assert_array_equal(drawn(ax, "simulated")[1], Y + 1)
    assert plot_residual(X, {"one": Y, "two": 2 * Y}, xlabel="x [m]", ylabel="error [N]", ax=ax) is ax
    assert labels(ax) == ("x [m]", "error [N]")


def test_intervals(result):
    ax = plot_intervals(result, truth={"a": 3.0})
    assert ax.get_xlabel() == "deviation from the estimate [%]"
    assert [t.get_text() for t in ax.get_yticklabels()] == ["a", "b"]
    np.testing.assert_allclose(drawn(ax, "true value")[0], 100 * (3.0 / result.values[0] - 1))
    ends = ax.collections[0].get_segments()
    np.testing.assert_allclose(
        ends[1][:, 0], 100 * (result.intervals()[1] / result.values[1] - 1) * [-1, -1], rtol=1e-6
    )


def test_intervals_mark_what_has_none(bounded):
    ax = plot_intervals(bounded)
    assert "at the upper bound" in legend(ax) and "no interval" in legend(ax)
    assert drawn(ax, "at the upper bound")[1] == [0]
    assert drawn(ax, "no interval")[1] == [2]
    assert drawn(ax, "estimate")[1] == [1]
    names = [t.get_text() for t in ax.get_yticklabels()]
    assert names == ["a\n(at its upper bound)", "b", "unused\n(not determined)"]


def test_correlation_has_numbers_and_crosses(result, bounded):
    ax = plot_correlation(result)
    numbers = [t.get_text() for t in ax.texts]
    assert numbers[0] == "1.00" and numbers[1] == f"{result.correlation[0, 1]:.2f}".replace("-", "−")
    assert [t.get_text() for t in ax.get_xticklabels()] == ["a", "b"]
    assert [t.get_text() for t in plot_correlation(bounded).texts].count("×") == 8


def test_failed_fits_can_be_drawn(failed):
    assert "no interval" in legend(plot_intervals(failed))
    assert {t.get_text() for t in plot_correlation(failed).texts} == {"×"}
    assert legend(plot_convergence(failed)) == ["not converged"]
    with pytest.raises(InputError, match="40 entries, of which"):
        plot_diagnostics(np.full(40, np.nan))


def test_convergence_of_one_and_several(result, bounded):
    ax = plot_convergence(result)
    assert labels(ax) == ("step", "cost: half the sum of squares [-]")
    np.testing.assert_array_equal(drawn(ax, "converged")[1], result.cost_history)
    ax = plot_convergence({"free": result, "bounded": bounded}, above=True)
    assert legend(ax) == ["free, converged", "bounded, converged"]
    assert ax.get_ylabel() == "cost above the lowest [-]"
    stopped = dataclasses.replace(bounded, stop="too_many_steps")
    ax = plot_convergence({"one step": stopped})
    assert legend(ax) == ["one step, not converged"]
    assert ax.lines[-1].get_marker() == "x"


def test_diagnostics_of_a_fit(result):
    axes = plot_diagnostics(result, fitted=Y)
    assert [ax.get_xlabel() for ax in axes] == ["sample", "normal quantile [-]", "lag [samples]", "fitted value"]
    np.testing.assert_array_equal(axes[0].lines[0].get_ydata(), result.residual)
    np.testing.assert_array_equal(axes[3].lines[0].get_xdata(), Y)
    assert plot_diagnostics(result)[3].get_ylabel() == "density [-]"


def test_autocorrelation_keeps_series_apart():
    """Alternating signs: -1 at lag 1 but for the ends; the band is that of all samples."""
    values = np.tile([1.0, -1.0], 50)
    ax = plot_autocorrelation(values, series=2, lags=5)
    heights = [segment[1, 1] for segment in ax.collections[0].get_segments()]
    np.testing.assert_allclose(heights[:2], [-0.98, 0.96], rtol=1e-9)
    assert ax.patches[0].get_height() == pytest.approx(2 * 1.96 / 10)
    ax = plot_sequence(values, series=4)
    assert [line.get_xdata()[0] for line in ax.lines[2:]] == [24.5, 49.5, 74.5]
    with pytest.raises(InputError, match="100 residuals do not divide into 3 series"):
        plot_autocorrelation(values, series=3)
    with pytest.raises(InputError, match="fitted has 3 values, but the residual 100"):
        plot_diagnostics(values, fitted=np.ones(3))


def test_quantiles_of_normal_values_lie_on_their_line():
    values = 2 + 3 * np.random.default_rng(1).standard_normal(20_000)
    ax = plot_quantiles(values)
    x, y = (np.asarray(v) for v in ax.lines[0].get_data())
    np.testing.assert_allclose(y[100:-100], 2 + 3 * x[100:-100], atol=0.15)
    assert legend(ax) == ["normal, deviation 2.98"]


def test_priors_are_no_residuals(result):
    space = ParameterSpace([Parameter("a", "m", prior=(3.0, 0.1)), Parameter("b", "m/s")])
    axes = plot_diagnostics(dataclasses.replace(result, space=space, residual=np.append(result.residual, 7.0)))
    np.testing.assert_array_equal(axes[0].lines[0].get_ydata(), result.residual)


def test_axes_given_are_used_and_counted(tmp_path):
    figure, grid = matplotlib.pyplot.subplots(2, 2)
    assert plot_diagnostics(Y, axes=grid)[3] is grid[1, 1]
    with pytest.raises(InputError, match="axes holds 4 axes, but 3 are drawn"):
        grid_or_new(grid, 3)
    assert len(grid_or_new(None, 4)[0].figure.axes) == 4
    save_figure(figure, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 1000


def test_an_estimate_near_zero_hides_no_other(result):
    near = dataclasses.replace(result, values=result.values * [1e-4, 1.0], scaled=result.scaled * [1e-4, 1.0])
    ax = plot_intervals(near)
    assert ax.get_xscale() == "symlog"
    ends = [segment[:, 0] for segment in ax.collections[0].get_segments()]
    shown = [np.ptp(ax.transData.transform([[x, 0.0] for x in one])[:, 0]) for one in ends]
    assert min(shown) > 0.05 * max(shown)
    assert all(float(tick.get_text()) == tick.get_position()[0] for tick in ax.get_xticklabels())


def test_the_legend_covers_no_curve():
    ax = plot_comparison(X, Y, Y + 1, label="position", unit="m")
    ax.figure.canvas.draw()
    assert ax.get_legend().get_window_extent().y0 >= ax.get_window_extent().y1
