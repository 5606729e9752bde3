"""Many starts: every minimum found, failed starts marked, no start disturbs another."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.constraints import Equality
from fitting.fit import fit
from fitting.multistart import multistart
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.solvers.slsqp import SLSQP
from fitting.starts import sample_starts
from tests.fitting.curves import Coefficients, box, noisy, two_decays
from twin._checks import InputError
from twin.executors import local_processes
from twin.parameters import Parameter, ParameterSpace

TRUTH = [2.0, 0.5, 1.0, 3.0]
SPACE = box(4, 0.01, 10.0, "log")
MODEL = Coefficients(jnp.asarray(TRUTH))


def evidence():
    return noisy(two_decays, TRUTH, np.linspace(0, 5, 60), 0.01)


def starts(count):
    return np.exp(sample_starts(SPACE, count))


@pytest.fixture(scope="module")
def result():
    return multistart(evidence(), MODEL, SPACE, starts=starts(150), keep="consistent", max_steps=200)


def test_both_minima_are_found_and_said_to_be_equal(result):
    assert result.success.all()
    table = result.minima()
    assert len(table) == 2
    assert table["starts"].sum() == 150
    a, b = table.iloc[0, 3:].to_numpy(), table.iloc[1, 3:].to_numpy()
    np.testing.assert_allclose(a, np.roll(b, 2), rtol=1e-6)
    assert "2 minima fit equally well" in result.message
    assert np.all(result.costs[result.clusters == 0] <= result.costs.min() * (1 + 1e-9))


def test_the_best_is_the_fit_from_its_start(result):
    start = result.starts[result.best_start]
    alone = fit(evidence(), Coefficients(jnp.asarray(start)), SPACE, max_steps=200)
    np.testing.assert_allclose(result.best.values, alone.values, rtol=1e-7)
    np.testing.assert_allclose(result.best.standard_errors, alone.standard_errors, rtol=1e-6)
    assert result.best.stop in ("converged", "at_precision")


def test_consistent_keeps_all_ends_that_fit_as_well(result):
    assert len(result.results) == 150
    assert set(result.results) == set(range(150))


def test_a_start_that_is_not_finite_changes_nothing_else(result):
    spoilt = starts(150)
    spoilt[17] = np.nan
    spoilt[40, 1] = 99.0  # outside its bounds
    other = multistart(evidence(), MODEL, SPACE, starts=spoilt, max_steps=200)
    rest = np.setdiff1d(np.arange(150), [17, 40])
    assert other.stops[17] == other.stops[40] == "not_finite"
    assert np.isnan(other.values[[17, 40]]).all()
    np.testing.assert_array_equal(other.values[rest], result.values[rest])
    np.testing.assert_array_equal(other.costs[rest], result.costs[rest])
    assert other.clusters[17] == -1
    assert "148 of 150 starts converged" in other.message


def test_threads_and_order_change_nothing(result):
    turned = multistart(evidence(), MODEL, SPACE, starts=starts(150)[::-1], max_steps=200, threads=1)
    np.testing.assert_array_equal(turned.values[::-1], result.values)


def test_all_starts_failing_is_a_status_and_then_an_error():
    bad = multistart(evidence(), MODEL, SPACE, starts=np.full((5, 4), np.nan), max_steps=200)
    assert not bad.success.any()
    assert "No start could be evaluated" in bad.message
    assert len(bad.minima()) == 0
    with pytest.raises(InputError, match="All 5 starts failed"):
        _ = bad.best


def test_too_few_steps_are_reported_and_the_lowest_end_kept():
    short = multistart(evidence(), MODEL, SPACE, starts=starts(150)[:8], max_steps=2)
    assert set(short.stops) == {"too_many_steps"}
    assert not short.success.any()
    assert not short.best.success
    assert short.best.cost == pytest.approx(np.nanmin(short.costs))


def test_the_number_of_starts_may_be_numpys():
    few = multistart(evidence(), MODEL, SPACE, starts=np.int64(2), max_steps=200)
    assert few.starts.shape == (2, 4)


def total_is_three(model):
    return model.b[0] + model.b[2] - 3.0


def test_constraints_hold_at_every_end():
    found = multistart(
        evidence(), MODEL, SPACE, starts=starts(16), constraints=[Equality(total_is_three)], max_steps=300, keep="all"
    )
    good = found.values[found.success]
    assert len(good) >= 14
    np.testing.assert_allclose(good[:, 0] + good[:, 2], 3.0, atol=1e-7)
    best = found.best
    # What is given needs no data: the two amplitudes are as uncertain as each other, and opposite.
    np.testing.assert_allclose(best.covariance[0, 0], -best.covariance[0, 2], rtol=1e-5)


def test_starts_fill_the_box_and_repeat_with_the_seed():
    space = ParameterSpace([Parameter("a", "", 1.0, 100.0, scale="log"), Parameter("c", "", -1.0, 1.0)])
    for sampler in ("sobol", "latin_hypercube"):
        points = sample_starts(space, 64, sampler=sampler, seed=3)
        np.testing.assert_array_equal(points, sample_starts(space, 64, sampler=sampler, seed=3))
        assert not np.array_equal(points, sample_starts(space, 64, sampler=sampler, seed=4))
        share = (points - np.asarray(space.lower)) / (np.asarray(space.upper) - np.asarray(space.lower))
        assert np.all((share >= 0) & (share <= 1))
        # Every eighth of every parameter's range holds its share of starts.
        counts = np.stack([np.histogram(column, bins=8, range=(0, 1))[0] for column in share.T])
        np.testing.assert_array_equal(counts, 8)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"starts": 0}, "starts must be at least 1"),
        ({"starts": np.ones((3, 2))}, "4 columns"),
        ({"sampler": "random"}, "sampler must be one of"),
        ({"keep": "some"}, "keep must be one of"),
        (
            {"constraints": [Equality(total_is_three)], "solver": BoundedLevenbergMarquardt()},
            "takes no general constraints",
        ),
    ],
)
def test_bad_requests_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        multistart(evidence(), MODEL, SPACE, **change)


def test_bounds_that_are_not_finite_are_named():
    space = ParameterSpace([Parameter("b.0", "kg", 0.0, 1.0, scale="log")])
    with pytest.raises(InputError, match=r"b\.0.*finite bounds above zero"):
        sample_starts(space, 4)


@pytest.mark.slow
def test_both_solvers_find_the_same_minimum(result):
    other = multistart(evidence(), MODEL, SPACE, starts=starts(150)[:16], solver=SLSQP(), max_steps=300)
    assert other.best.cost == pytest.approx(result.best.cost, rel=1e-8)


def test_a_long_run_is_stored_and_goes_on_on_workers(result, tmp_path):
    options = {"starts": starts(150), "max_steps": 200, "keep": "consistent", "progress": False}
    spoilt = starts(150)
    spoilt[17] = np.nan
    first = multistart(evidence(), MODEL, SPACE, **{**options, "starts": spoilt}, store=tmp_path / "spoilt")
    assert first.stops[17] == "not_finite"
    folder = tmp_path / "study"
    multistart(evidence(), MODEL, SPACE, **options, store=folder)
    next(folder.glob("chunks/0000000-*")).unlink()
    with local_processes(1) as pool:
        again = multistart(evidence(), MODEL, SPACE, **options, store=folder, executor=pool)
    np.testing.assert_array_equal(again.values, result.values)
    np.testing.assert_array_equal(again.stops, result.stops)
    assert set(again.results) == set(result.results)
    np.testing.assert_array_equal(again.best.covariance, result.best.covariance)
    with pytest.raises(InputError, match=r"the function .* was changed"):
        multistart(evidence(), MODEL, SPACE, **{**options, "max_steps": 100}, store=folder)


def test_no_start_that_can_be_fitted():
    nothing = multistart(evidence(), MODEL, SPACE, starts=np.full((3, 4), np.nan))
    assert list(nothing.stops) == ["not_finite"] * 3
    with pytest.raises(InputError, match="All 3 starts failed"):
        _ = nothing.best
