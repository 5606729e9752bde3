"""Bounded Levenberg-Marquardt: known minima, bounds never left, and an honest reason for stopping."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from scipy.optimize import least_squares

from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.solvers.stop import Stop

SOLVER = BoundedLevenbergMarquardt()
TIMES = np.linspace(0.0, 4.0, 25)


def _rosenbrock(x, args=None):
    return jnp.stack([10 * (x[1] - x[0] ** 2), 1 - x[0]])


def _beale(x, args=None):
    return jnp.stack([c - x[0] * (1 - x[1] ** k) for c, k in ((1.5, 1), (2.25, 2), (2.625, 3))])


def _decay(x, factors=(1.0, 1.0, 1.0)):
    """a·exp(-b·t) + c against data of a = 2, b = 1.3, c = 0.5 with a fixed disturbance; x in any units."""
    x = x / jnp.asarray(factors)
    data = 2 * np.exp(-1.3 * TIMES) + 0.5 + 0.02 * np.sin(40 * TIMES)
    return x[0] * jnp.exp(-x[1] * TIMES) + x[2] - data


def _two_decays(x, args=None):
    data = 3 * np.exp(-0.4 * TIMES) + 1.5 * np.exp(-4.0 * TIMES)
    return x[0] * jnp.exp(-x[1] * TIMES) + x[2] * jnp.exp(-x[3] * TIMES) - data


# Function, start, lower and upper bounds (None: free).
PROBLEMS = {
    "rosenbrock": (_rosenbrock, [-1.2, 1.0], None, None),
    "rosenbrock far": (_rosenbrock, [-12.0, 10.0], None, None),
    "rosenbrock bound": (_rosenbrock, [-1.2, 1.0], [-2.0, -2.0], [0.5, 2.0]),
    "rosenbrock corner": (_rosenbrock, [-1.2, 1.0], [-2.0, 0.5], [0.5, 2.0]),
    "beale": (_beale, [1.0, 1.0], None, None),
    "beale bound": (_beale, [1.0, 1.0], [-4.5, -4.5], [2.5, 4.5]),
    "decay": (_decay, [1.0, 1.0, 0.0], None, None),
    "decay bound": (_decay, [1.0, 2.0, 0.0], [0.0, 1.5, 0.0], [5.0, 9.0, 9.0]),
    "decay start on a bound": (_decay, [1.0, 0.5, 0.0], [0.0, 0.5, 0.0], [5.0, 9.0, 9.0]),
    "two decays": (_two_decays, [2.0, 0.1, 1.0, 2.0], None, None),
    "two decays bound": (_two_decays, [2.0, 0.1, 1.0, 2.0], [0.0] * 4, [9.0, 9.0, 9.0, 3.0]),
}
HELD = ("rosenbrock bound", "rosenbrock corner", "beale bound", "decay bound", "two decays bound")


def _solve(function, start, lower=None, upper=None, args=None, max_steps=500):
    start = np.asarray(start)
    lower = np.full(start.shape, -np.inf) if lower is None else np.asarray(lower)
    upper = np.full(start.shape, np.inf) if upper is None else np.asarray(upper)
    return _compiled(function, start, lower, upper, args, max_steps)


@eqx.filter_jit
def _compiled(function, start, lower, upper, args, max_steps):
    """Compiled once for each function, as bounds and arguments are arrays."""
    options = {"lower": lower, "upper": upper}
    return optx.least_squares(function, SOLVER, start, args, options=options, max_steps=max_steps, throw=False)


def _reason(solution):
    return str(Stop[solution.stats["reason"]])


def _arguments(function):
    return np.ones(3) if function is _decay else None


@pytest.mark.parametrize("name", PROBLEMS)
def test_same_minimum_as_scipy(name):
    function, start, lower, upper = PROBLEMS[name]
    solution = _solve(function, start, lower, upper, _arguments(function))
    bounds = (-np.inf, np.inf) if lower is None else (lower, upper)
    inside = np.clip(start, bounds[0] + np.asarray(1e-6), bounds[1] - np.asarray(1e-6))
    expected = least_squares(
        lambda x: np.asarray(function(x)), inside, bounds=bounds, xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    assert _reason(solution) == str(Stop[Stop.converged])
    assert solution.result == optx.RESULTS.successful
    np.testing.assert_allclose(solution.value, expected.x, rtol=1e-5, atol=1e-6)
    cost = 0.5 * float(jnp.sum(function(solution.value) ** 2))
    assert cost <= expected.cost * (1 + 1e-9) + 1e-15
    active = np.asarray(solution.state.active)
    if lower is not None:
        assert np.all((np.asarray(lower) <= solution.value) & (solution.value <= np.asarray(upper)))
        np.testing.assert_array_equal(
            active, (solution.value == np.asarray(lower)) | (solution.value == np.asarray(upper))
        )
    assert active.any() == (name in HELD)


def test_history_falls_and_starts_at_the_start():
    solution = _solve(_rosenbrock, [-1.2, 1.0])
    history = np.asarray(solution.state.history)
    steps = int(solution.state.steps)
    assert history[0] == pytest.approx(0.5 * 24.2)
    assert np.all(np.diff(history[: steps + 1]) <= 0)
    assert np.all(np.isnan(history[steps + 1 :]))
    assert history[steps] == pytest.approx(0.5 * float(jnp.sum(solution.state.residual**2)))


_seen = []


def _recorded(function):
    """The function, every point at which it is evaluated noted, and NaN outside the bounds."""

    def recorded(x, bounds):
        jax.debug.callback(lambda point: _seen.append(np.array(point)), x)
        inside = jnp.all((x >= bounds[0]) & (x <= bounds[1]))
        return jnp.where(inside, function(x), jnp.nan)

    return recorded


_RECORDED = {function: _recorded(function) for function in (_rosenbrock, _decay)}


@pytest.mark.parametrize("name", ["rosenbrock bound", "rosenbrock corner", "decay bound", "decay start on a bound"])
def test_never_evaluates_outside_the_bounds(name):
    function, start, lower, upper = PROBLEMS[name]
    _seen.clear()
    solution = _solve(_RECORDED[function], start, lower, upper, (np.asarray(lower), np.asarray(upper)))
    jax.effects_barrier()
    assert _reason(solution) == str(Stop[Stop.converged])
    points = np.stack(_seen).reshape(-1, len(start))
    assert len(points) > int(solution.state.steps)
    assert np.all((points >= lower) & (points <= upper))


def test_trap_29_a_start_on_a_bound_leaves_it():
    function, _, lower, upper = PROBLEMS["decay start on a bound"]
    for corner in (lower, upper):
        solution = _solve(function, corner, lower, upper, np.ones(3))
        np.testing.assert_allclose(solution.value, [2.0, 1.3, 0.5], rtol=0.05)
        assert not np.any(solution.state.active)


def test_trap_28_directions_that_the_data_do_not_see_stay_put():
    def sums(x, _):
        total = x[0] + x[1]
        return jnp.stack([total - 3.0, total - 3.2, jnp.exp(0.1 * total) - 1.3]) + 0 * x[2]

    solution = _solve(sums, [0.5, 0.5, 7.0])
    assert _reason(solution) == str(Stop[Stop.converged])
    np.testing.assert_allclose(float(solution.value[0]), float(solution.value[1]), rtol=1e-9)
    assert 2.9 < float(solution.value[0] + solution.value[1]) < 3.3
    assert float(solution.value[2]) == pytest.approx(7.0, rel=1e-14)


def test_more_unknowns_than_residuals():
    solution = _solve(lambda x, _: jnp.stack([x[0] * x[1] - 2.0]), [1.0, 1.0])
    assert _reason(solution) == str(Stop[Stop.converged])
    assert float(solution.value[0] * solution.value[1]) == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize(
    "spoil", [lambda r, x: r / (x[0] + 1.2), lambda r, x: r + jnp.sqrt(x[0] + 1.2)], ids=["value", "slope"]
)
def test_a_start_that_is_not_finite(spoil):
    solution = _solve(lambda x, _: spoil(_rosenbrock(x), x), [-1.2, 1.0])
    assert _reason(solution) == str(Stop[Stop.not_finite])
    assert solution.result == optx.RESULTS.nonfinite
    np.testing.assert_array_equal(solution.value, [-1.2, 1.0])
    assert np.all(np.isnan(solution.state.history))


def test_a_step_to_where_the_residual_is_not_finite_is_not_made():
    """The full first step of this problem leads to a negative argument of the logarithm."""
    solution = _solve(lambda x, _: jnp.stack([jnp.log(x[0]), 0.1 * (x[0] - 1)]), [8.0])
    assert _reason(solution) == str(Stop[Stop.converged])
    assert float(solution.value[0]) == pytest.approx(1.0, rel=1e-7)


def _wrong_by(factor):
    """Rosenbrock's function with a derivative that is wrong by a factor."""

    @jax.custom_jvp
    def function(x):
        return _rosenbrock(x)

    @function.defjvp
    def function_jvp(primals, tangents):
        values, slopes = jax.jvp(_rosenbrock, primals, tangents)
        return values, factor * slopes

    return lambda x, _: function(x)


@pytest.mark.parametrize(
    ("function", "start"),
    [
        (_wrong_by(-1.0), [-1.2, 1.0]),
        (lambda x, _: jnp.stack([jnp.abs(x[0] - 1.0) + 1.0, 0.0 * x[0]]), [3.0]),
        (lambda x, _: jnp.stack([jnp.round(x[0]) + 0.3 + x[0] - jax.lax.stop_gradient(x[0]), 1.0 + 0 * x[0]]), [3.0]),
    ],
    ids=["wrong sign", "kink", "staircase"],
)
def test_trap_25_a_stall_is_no_success(function, start):
    solution = _solve(function, start)
    assert _reason(solution) == str(Stop[Stop.stalled])
    assert solution.result != optx.RESULTS.successful
    assert int(solution.state.steps) < 500


def test_out_of_steps():
    solution = _solve(_rosenbrock, [-1.2, 1.0], max_steps=4)
    assert _reason(solution) == str(Stop[Stop.too_many_steps])
    assert solution.result != optx.RESULTS.successful
    assert int(solution.state.steps) == 3


def test_bounds_that_are_held_cost_no_digits():
    """The gradient at a bound is large; what is left along it must still be told from rounding."""
    solution = _solve(*PROBLEMS["decay bound"], np.ones(3))
    assert float(solution.state.offset) < 1e-8
    assert int(solution.state.steps) < 20


def test_a_residual_of_zero_at_the_start():
    solution = _solve(_rosenbrock, [1.0, 1.0])
    assert _reason(solution) == str(Stop[Stop.converged])
    assert int(solution.state.steps) == 0


@pytest.mark.parametrize("factors", [[1e7, 1.0, 1.0], [1.0, 1e-7, 1.0], [1e7, 1e-7, 1e3]])
@pytest.mark.parametrize("name", ["decay", "decay bound"])
def test_trap_24_rescaled_parameters_give_the_same_steps(name, factors):
    function, start, lower, upper = PROBLEMS[name]
    factors = np.asarray(factors)
    plain = _solve(function, start, lower, upper, np.ones(3))
    bounds = (None, None) if lower is None else (lower * factors, upper * factors)
    scaled = _solve(function, start * factors, *bounds, factors)
    np.testing.assert_allclose(scaled.value / factors, plain.value, rtol=1e-7)
    # The last steps, which change the cost by rounding only, may differ.
    steps = int(min(scaled.state.steps, plain.state.steps))
    assert steps >= 2
    np.testing.assert_allclose(scaled.state.history[: steps + 1], plain.state.history[: steps + 1], rtol=1e-7)


def test_a_tree_of_unknowns_and_auxiliary_output():
    def tree(y, data):
        shift = y["shift"]
        return {"a": y["gain"] * data + shift - 2 * data - 1, "b": 0.1 * shift - 0.1}, shift

    solution = optx.least_squares(
        tree,
        SOLVER,
        {"gain": jnp.asarray(0.0), "shift": jnp.asarray(0.0)},
        jnp.asarray(TIMES),
        has_aux=True,
        options={"upper": {"gain": jnp.asarray(5.0), "shift": jnp.asarray(5.0)}},
    )
    assert float(solution.value["gain"]) == pytest.approx(2.0)
    assert float(solution.aux) == pytest.approx(1.0)


@eqx.filter_jit
@eqx.filter_vmap
def _batch(start):
    options = {"lower": jnp.asarray([-20.0, -20.0]), "upper": jnp.asarray([20.0, 20.0])}
    return optx.least_squares(_rosenbrock, SOLVER, start, options=options, max_steps=200, throw=False)


@pytest.mark.slow
def test_a_bad_lane_is_marked_and_harms_no_other():
    random = np.random.default_rng(0)
    starts = random.uniform(-10, 10, (8, 2))
    clean = _batch(jnp.asarray(starts))
    starts[3] = np.nan
    solution = _batch(jnp.asarray(starts))
    good = np.arange(8) != 3
    np.testing.assert_array_equal(np.asarray(solution.stats["reason"] == Stop.not_finite), ~good)
    np.testing.assert_array_equal(np.asarray(solution.stats["reason"] == Stop.converged), good)
    np.testing.assert_allclose(solution.value[good], 1.0, rtol=1e-7)
    np.testing.assert_array_equal(solution.value[good], clean.value[good])


@pytest.mark.slow
def test_trap_23_a_batch_of_a_thousand_ends():
    starts = np.random.default_rng(1).uniform(-10, 10, (1000, 2))
    solution = _batch(jnp.asarray(starts))
    assert np.all(np.asarray(solution.stats["reason"] == Stop.converged))
    np.testing.assert_allclose(solution.value, 1.0, rtol=1e-6)
