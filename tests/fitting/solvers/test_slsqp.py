"""SLSQP: known answers, bounds never left, honest reasons for stopping, batches, and every kind of awkward start."""

import faulthandler
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting.solvers.quadratic_programme import quadratic_programme
from fitting.solvers.slsqp import SLSQP
from fitting.solvers.stop import CONVERGED, STOPS
from tests.fitting.solvers.slsqp_runs import Answer, minimum, solve_programme
from tests.problems.nonlinear_programme import programme
from tests.problems.programme_runs import QUICK, SlsqpRunner


# Problem 71 of Hock and Schittkowski in variables of any size: x = y·scale.
def _cost(y, scale):
    x = y * scale
    return x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]


def _sphere(y, scale):
    return jnp.sum((y * scale) ** 2)[None] - 40.0


def _product(y, scale):
    return jnp.prod(y * scale)[None] - 25.0


SOLUTION = np.array([1.0, 4.742999637, 3.821149979, 1.379408293])
ONES = np.ones(4)


def _solve_71(start, scale=ONES, mode="fwd"):
    bounds = (1.0 / scale, 5.0 / scale)
    return solve_programme(_cost, _sphere, _product, np.asarray(start, float) / scale, *bounds, scale, mode)


@pytest.mark.parametrize(
    "start", [[1, 5, 5, 1], [2, 9, 9, -1], [5, 5, 5, 5], [1, 1, 1, 1]], ids=["usual", "outside", "upper", "lower"]
)
def test_known_answer_from_starts_inside_on_and_outside_the_bounds(start):
    answer = _solve_71(start)
    assert answer.why in CONVERGED and answer.successful
    np.testing.assert_allclose(answer.x, SOLUTION, atol=1e-6)
    assert answer.violation <= 1e-8
    np.testing.assert_allclose(answer.multipliers, [-0.161468564, 0.552293655], rtol=1e-5)


def test_reverse_mode_agrees_with_forward_mode():
    forward, reverse = (_solve_71([1, 5, 5, 1], mode=mode) for mode in ("fwd", "rev"))
    np.testing.assert_allclose(reverse.x, forward.x, rtol=1e-9)
    assert reverse.steps == forward.steps and reverse.why == forward.why


@pytest.mark.parametrize("exponents", [[1, 1, 1, 1], [-1, -1, -1, -1], [1, 0, -1, 0]])
def test_variables_ten_times_larger_or_smaller_give_the_same_answer(exponents):
    scale = 10.0 ** np.array(exponents)
    answer = _solve_71([1, 5, 5, 1], scale)
    assert answer.why in CONVERGED
    np.testing.assert_allclose(answer.x * scale, SOLUTION, atol=1e-5)


@pytest.mark.parametrize("exponents", [[7, 7, 7, 7], [-7, -7, -7, -7]])
def test_variables_far_from_one_are_no_false_success(exponents):
    """Trap 24: unscaled parameters gave silent false success."""
    scale = 10.0 ** np.array(exponents)
    answer = _solve_71([1, 5, 5, 1], scale)
    if answer.why in CONVERGED:
        np.testing.assert_allclose(answer.value, 17.0140173, rtol=1e-5)
        assert answer.violation <= 1e-7


def test_a_batch_of_1000_starts_neither_hangs_nor_differs_from_single_runs():
    """Trap 23: another SLSQP in JAX hung for ever at 100 starts on two cores, inside a batched LU."""
    starts = jnp.asarray(np.random.default_rng(1).uniform(1, 5, (1000, 4)))
    solve = partial(minimum, _cost, _sphere, _product)
    batch = jax.jit(jax.vmap(lambda start: solve(start, ONES, 5 * ONES, ONES)), compiler_options=QUICK)
    compiled = batch.lower(starts).compile()
    # A hang inside compiled code cannot be interrupted otherwise.
    faulthandler.dump_traceback_later(300, exit=True)
    try:
        answers = Answer(*jax.tree.map(np.asarray, compiled(starts)))
    finally:
        faulthandler.cancel_dump_traceback_later()
    assert np.mean(answers.successful) > 0.95
    assert np.all(answers.violation[answers.successful] <= 1e-8)
    # The others are at a vertex that is a minimum as well.
    assert np.mean(np.abs(answers.value - 17.0140173) <= 1e-6) > 0.7
    for lane in range(0, 1000, 50):
        single = _solve_71(starts[lane])
        np.testing.assert_allclose(answers.x[lane], single.x, rtol=1e-12, atol=1e-12)
        assert answers.reason[lane] == single.reason and answers.steps[lane] == single.steps


def _valley(x):
    return 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2


def _disc(x):
    return 4 - x[0] ** 2 - x[1] ** 2


VALLEY = programme("valley", _valley, [0, 0], inequality=lambda x: [_disc(x)], optimum=0, solution=[1, 1])


@pytest.fixture(scope="module")
def runner() -> SlsqpRunner:
    return SlsqpRunner(classes=((2, 0, 1),))


NUMBER = st.floats(-3, 3, allow_subnormal=False)


@settings(max_examples=40, deadline=None)
@given(NUMBER, NUMBER, NUMBER, NUMBER, st.floats(0, 4), st.floats(0, 4))
def test_bounds_are_never_left_by_any_point_that_is_evaluated(runner, x0, x1, low0, low1, width0, width1):
    lower = np.array([low0, low1])
    run = runner(VALLEY._replace(start=np.array([x0, x1]), lower=lower, upper=lower + np.array([width0, width1])))
    assert run.outside == 0
    if run.success:
        # A promised reduction of 1e-10·f leaves a gradient of √(1e-10·f·curvature): 1e-4 and more, as the curvature
        # here is up to 1e4 and f may be as large.
        assert run.violation <= 1e-8 and run.residual <= 1e-2
    else:
        # A box beyond the disc.
        nearest = np.clip(0.0, lower, run.problem.upper)
        assert run.status == "infeasible" and nearest @ nearest > 4 - 1e-6


def test_an_objective_without_values_outside_the_bounds_takes_the_same_path():
    lower, upper = np.array([-1.5, -0.5]), np.array([0.5, 2.0])

    def guarded(x, args):
        return jnp.where(jnp.all((x >= lower) & (x <= upper)), _valley(x), jnp.nan)

    plain, nan = (
        solve_programme(objective, None, None, np.array([-1.2, 1.0]), lower, upper, None)
        for objective in (_plain_valley, guarded)
    )
    np.testing.assert_allclose(nan.x, [0.5, 0.25], atol=1e-7)
    assert nan.steps == plain.steps and nan.why == plain.why


def test_one_unknown_a_tree_and_python_floats():
    """The unknown is a scalar in a dictionary, start, bounds and argument are Python floats."""

    @partial(jax.jit, compiler_options=QUICK)
    def solve(start, target):
        options = {"lower": {"a": -1.0}, "upper": {"a": 10.0}, "inequality": lambda y, target: target - y["a"]}
        found = optx.minimise(
            lambda y, target: ((y["a"] - 2 * target) ** 2, y["a"] * 2),
            SLSQP(),
            {"a": jnp.asarray(start)},
            args=target,
            has_aux=True,
            options=options,
            throw=False,
        )
        return found.value, found.aux, found.stats["reason"]._value

    value, aux, reason = solve(7.0, 3.0)
    np.testing.assert_allclose(value["a"], 3.0, rtol=1e-9)
    np.testing.assert_allclose(aux, 6.0, rtol=1e-9)
    assert STOPS[int(reason)] in CONVERGED


def test_fifty_unknowns_with_bounds_and_constraints_agree_with_the_quadratic_programme():
    n, rng = 50, np.random.default_rng(4)
    factor = np.tril(rng.normal(size=(n, n))) * 0.1 + np.diag(rng.uniform(0.5, 2, n))
    gradient = rng.normal(size=n)
    normals = rng.normal(size=(6, n))
    values = np.array([0.3, -0.2, -0.1, 0.1, -0.5, 0.0])
    known = jax.jit(partial(quadratic_programme, equalities=2), compiler_options=QUICK)(
        factor, gradient, normals, values, jnp.full(n, -0.3), jnp.full(n, 0.3)
    )
    assert known.feasible
    found = solve_programme(
        lambda x, args: 0.5 * jnp.sum((factor.T @ x) ** 2) + gradient @ x,
        lambda x, args: normals[:2] @ x + values[:2],
        lambda x, args: normals[2:] @ x + values[2:],
        np.zeros(n),
        np.full(n, -0.3),
        np.full(n, 0.3),
        None,
    )
    assert found.why in CONVERGED
    np.testing.assert_allclose(found.x, known.step, atol=1e-4)
    np.testing.assert_allclose(found.violation, 0.0, atol=1e-8)


def test_too_few_steps_are_said_so():
    def solve(start):
        return optx.minimise(_plain_valley, SLSQP(), start, options={}, max_steps=3, throw=False)

    found = jax.jit(lambda start: _reason(solve(start)), compiler_options=QUICK)(jnp.asarray([-1.2, 1.0]))
    assert STOPS[int(found[0])] == "too_many_steps"
    assert not found[1]


def _plain_valley(x, args):
    return _valley(x)


def _reason(found):
    return found.stats["reason"]._value, found.result == optx.RESULTS.successful
