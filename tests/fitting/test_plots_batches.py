"""Plots of many starts, profiles and posteriors: what is drawn and said, one parameter only, and all starts failed."""

import jax.numpy as jnp
import matplotlib
import matplotlib.pyplot
import numpy as np
import pytest

from fitting.mixing import effective_size, r_hat
from fitting.multistart import MultistartResult
from fitting.plots_multistart import plot_parallel, plot_waterfall
from fitting.plots_posterior import plot_pairs, plot_posterior
from fitting.plots_profile import plot_profile, plot_profiles
from fitting.posterior_result import Posterior
from fitting.profile import Profile, ProfileResult
from fitting.result import FitResult
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

matplotlib.use("Agg")

MASS = Parameter("plant.mass", "kg", 10.0, 1000.0, scale="log")
RATIO = Parameter("ratio", "", 0.0, 4.0)


@pytest.fixture(autouse=True)
def _close():
    yield
    matplotlib.pyplot.close("all")


def many(values, costs, clusters, parameters=(MASS, RATIO)):
    stops = np.asarray(
        [
            "converged" if c >= 0 else "too_many_steps" if np.isfinite(x) else "not_finite"
            for c, x in zip(clusters, costs, strict=True)
        ]
    )
    values = np.asarray(values, dtype=float)
    return MultistartResult(
        space=ParameterSpace(parameters),
        starts=values,
        values=values,
        costs=np.asarray(costs, dtype=float),
        stops=stops,
        steps=np.zeros(len(costs), dtype=int),
        clusters=np.asarray(clusters),
        results={},
    )


SEVEN = many(
    [[100, 1], [10, 4], [100, 1], [1000, 0], [np.nan, np.nan], [50, 2], [np.nan, np.nan]],
    [2.0, 5.0, 2.0, 3.0, np.nan, 9.0, np.nan],
    [0, 2, 0, 1, -1, -1, -1],
)
FAILED = many(np.full((3, 2), np.nan), np.full(3, np.nan), [-1, -1, -1])


def legend(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_waterfall():
    ax = plot_waterfall(SEVEN)
    assert ax.get_title() == "best cost 2, 2 of 7 starts failed"
    assert legend(ax) == [
        "minimum 1 (2 starts)",
        "minimum 2 (1 start)",
        "minimum 3 (1 start)",
        "not converged (1 start)",
    ]
    assert (ax.get_xlabel(), ax.get_yscale()) == ("start, in order of its cost", "log")
    assert ax.get_ylabel() == "cost above the best [-],\ndrawn from 2e-06 up"
    found = {line.get_label()[:9]: (list(line.get_xdata()), np.asarray(line.get_ydata())) for line in ax.lines}
    assert found["minimum 1"][0] == [1, 2] and found["not conve"][0] == [5]
    np.testing.assert_allclose(found["minimum 3"][1], 3.0 + 2e-6)


def test_waterfall_of_perfect_data_and_many_minima():
    exact = many([[100, 1]] * 3, [0.0, 1e-8, 1.0], [0, 1, 2])
    assert plot_waterfall(exact).get_ylabel() == "cost above the best [-],\ndrawn from 1e-11 up"
    crowd = many([[100, 1]] * 10, np.arange(1.0, 11.0), np.arange(10))
    assert legend(plot_waterfall(crowd))[-1] == "4 higher minima (4 starts)"


def test_parallel_places_ends_between_the_bounds():
    ax = plot_parallel(SEVEN)
    names = [t.get_text() for t in ax.get_yticklabels()]
    assert names == ["plant.mass [kg]\n10 … 1000, log", "ratio\n0 … 4"]
    lines = {line.get_label(): line for line in ax.lines}
    np.testing.assert_allclose(lines["minimum 1 (2 starts)"].get_xdata(), [0.5, 0.25])
    np.testing.assert_allclose(lines["minimum 3 (1 start)"].get_xdata(), [0.0, 1.0], atol=1e-12)
    assert lines["minimum 1 (2 starts)"].get_zorder() > lines["minimum 2 (1 start)"].get_zorder()
    assert len(ax.lines) == 5
    assert ax.get_title() == "2 of 7 starts failed"


def test_parallel_without_bounds_spans_what_was_found():
    free = many([[1.0], [3.0], [2.0]], [1.0, 2.0, 1.0], [0, 1, 0], [Parameter("k", "N/m")])
    ax = plot_parallel(free)
    assert [t.get_text() for t in ax.get_yticklabels()] == ["k [N/m]\n1 … 3, as found"]
    assert sorted(float(line.get_xdata()[0]) for line in ax.lines) == [0.0, 0.5, 1.0]


@pytest.mark.parametrize("plot", [plot_waterfall, plot_parallel])
def test_all_starts_failed(plot):
    ax = plot(FAILED)
    assert ax.get_title() == "all starts failed"
    assert ax.texts[0].get_text() == "nothing to draw"
    figure, own = matplotlib.pyplot.subplots()
    assert plot(SEVEN, ax=own) is own and own.figure is figure


def straight(path, unit, estimate, error, open_=(False, False)):
    ratio = np.linspace(-2.2, 2.2, 9)
    interval = tuple(
        side * np.inf if o else estimate + side * 2 * error for side, o in zip((-1, 1), open_, strict=True)
    )
    values = estimate + error * ratio
    return Profile(path, unit, estimate, values, ratio, values[:, None], interval, open_)


PROFILES = ProfileResult(
    (straight("k", "N/m", 5.0, 0.5), straight("ratio", "", 1.0, 0.1, (False, True))), 0.95, 2.0, None, ""
)


def fitted(parameters, values, errors):
    size = len(values)
    space = ParameterSpace(parameters)
    scaled = np.asarray(space.scaled(jnp.asarray(values)))
    slopes = np.asarray(space.slopes(jnp.asarray(values)))
    nothing = np.zeros(size, dtype=bool)
    return FitResult(
        model=None,
        space=space,
        values=np.asarray(values),
        scaled=scaled,
        scaled_covariance=np.diag((np.asarray(errors) / slopes) ** 2),
        factor=np.eye(size),
        condition_number=1.0,
        degrees_of_freedom=10,
        unseen=nothing,
        active=nothing,
        residual=np.ones(12),
        cost_history=np.ones(1),
        steps=1,
        stop="converged",
        offset=0.0,
    )


FIT = fitted([Parameter("k", "N/m"), Parameter("ratio")], [5.0, 1.0], [0.5, 0.1])


def test_profile_with_level_ends_and_linear_theory():
    ax = plot_profile(PROFILES, "k", fit=FIT)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("k [N/m]", "profile t [-]")
    assert ax.get_title() == "95 % interval: 4 … 6 N/m"
    assert set(legend(ax)) == {"profile", "estimate", "critical level", "linear theory"}
    lines = {line.get_label(): line for line in ax.lines}
    x, y = lines["linear theory"].get_data()
    np.testing.assert_allclose(y, (np.asarray(x) - 5.0) / 0.5, atol=1e-9)
    ends = sorted(float(line.get_xdata()[0]) for line in ax.lines if line.get_linestyle() == ":")
    assert ends == [4.0, 6.0]


def test_squared_profile_of_an_open_side():
    ax = plot_profile(PROFILES, "ratio", squared=True)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("ratio", "2·(C − Ĉ)/s² [-]")
    assert ax.get_title() == "95 % interval: 0.8 … ∞"
    assert [t.get_text() for t in ax.texts] == ["no limit above"]
    np.testing.assert_allclose(ax.lines[0].get_ydata(), PROFILES["ratio"].ratio ** 2)
    with pytest.raises(InputError, match="'c' was not profiled"):
        plot_profile(PROFILES, "c")


def test_grid_of_profiles():
    axes = plot_profiles(PROFILES, fit=FIT)
    assert [ax.get_xlabel() for ax in axes] == ["k [N/m]", "ratio"]
    assert [ax.get_ylabel() for ax in axes] == ["profile t [-]", ""]
    (one,) = plot_profiles(ProfileResult(PROFILES.profiles[:1], 0.95, 2.0, None, ""))
    assert one.figure.legends
    figure, given = matplotlib.pyplot.subplots(1, 2)
    assert plot_profiles(PROFILES, axes=given)[1] is given[1] and not figure.legends


def sampled(parameters, values):
    space = ParameterSpace(parameters)
    return Posterior(space, values, r_hat(values), effective_size(values), 0, np.full(4, 0.8), 1000, 12, "estimated")


NOISE = np.random.default_rng(2).standard_normal((4, 1000, 2))
POSTERIOR = sampled(FIT.space.parameters, np.asarray([5.0, 1.0]) + NOISE * [0.5, 0.1])


def test_marginals_with_linear_theory_and_profile():
    axes = plot_posterior(POSTERIOR, fit=FIT, profile=PROFILES)
    assert [ax.get_xlabel() for ax in axes] == ["k [N/m]", "ratio"]
    said = [text.get_text() for text in axes[0].figure.legends[0].get_texts()]
    assert said == ["chains", "posterior", "95 % credible", "linear theory", "95 % profile interval"]
    lines = {line.get_label(): line for line in axes[0].lines}
    x, y = (np.asarray(v) for v in lines["linear theory"].get_data())
    assert np.trapezoid(y, x) == pytest.approx(0.985, abs=0.02)
    steps = axes[0].patches[4].get_data()
    assert np.sum(steps.values * np.diff(steps.edges)) == pytest.approx(1.0, abs=0.005)
    assert len(axes[1].lines) == 2, "an end at infinity is not drawn"


def test_marginal_of_one_parameter_on_a_log_axis():
    values = np.exp(np.log(100) + NOISE[:, :, :1])
    (ax,) = plot_posterior(sampled([MASS], values), fit=fitted([MASS], [100.0], [100.0]))
    assert (ax.get_xlabel(), ax.get_xscale()) == ("plant.mass [kg]", "log")
    x, y = (np.asarray(v) for v in ax.lines[0].get_data())
    assert np.trapezoid(y, np.log(x)) == pytest.approx(0.99, abs=0.02)
    grid = plot_pairs(sampled([MASS], values))
    assert grid.shape == (1, 1) and grid[0, 0].get_xlabel() == "plant.mass [kg]"


def test_pairs():
    grid = plot_pairs(POSTERIOR)
    assert grid.shape == (2, 2)
    assert (grid[1, 0].get_xlabel(), grid[1, 0].get_ylabel()) == ("k [N/m]", "ratio")
    assert len(grid[1, 0].lines) == 4
    assert sum(line.get_xdata().size for line in grid[1, 0].lines) == 2000
    assert not grid[0, 1].axison
    assert plot_pairs(POSTERIOR, paths=["ratio"]).shape == (1, 1)
    with pytest.raises(InputError, match="'c' was not sampled"):
        plot_pairs(POSTERIOR, paths=["c"])
