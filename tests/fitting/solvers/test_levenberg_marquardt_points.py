"""Bounded Levenberg-Marquardt at awkward points: no false success, no stall, no step outside."""

import subprocess
import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.solvers.stop import Stop

SOLVER = BoundedLevenbergMarquardt()
TIMES = np.linspace(0.0, 4.0, 25)


@eqx.filter_jit
def _compiled(function, start, lower, upper, args):
    options = {"lower": lower, "upper": upper}
    return optx.least_squares(function, SOLVER, start, args, options=options, max_steps=300, throw=False)


def _solve(function, start, lower=-np.inf, upper=np.inf, args=None):
    start = np.asarray(start, dtype=float)
    lower, upper = (np.broadcast_to(np.asarray(b, dtype=float), start.shape) for b in (lower, upper))
    return _compiled(function, start, lower, upper, args)


def _reason(solution):
    return str(Stop[solution.stats["reason"]])


def _name(stop):
    return str(Stop[stop])


def _decay(x, _):
    return x[0] * jnp.exp(-x[1] * TIMES) - 2 * np.exp(-1.3 * TIMES) - 0.02 * np.sin(40 * TIMES)


def test_one_unknown():
    solution = _solve(lambda x, _: jnp.exp(-x * TIMES) - np.exp(-0.7 * TIMES), [3.0])
    assert _reason(solution) == _name(Stop.converged)
    assert float(solution.value[0]) == pytest.approx(0.7, rel=1e-9)


def test_bounds_that_meet_hold_a_variable():
    solution = _solve(_decay, [1.0, 1.0], [-np.inf, 1.0], [np.inf, 1.0])
    assert _reason(solution) == _name(Stop.converged)
    assert float(solution.value[1]) == 1.0
    shape = np.exp(-TIMES)
    expected = shape @ (2 * np.exp(-1.3 * TIMES) + 0.02 * np.sin(40 * TIMES)) / (shape @ shape)
    assert float(solution.value[0]) == pytest.approx(expected, rel=1e-9)


def test_bounds_that_all_meet_leave_nothing_to_do():
    solution = _solve(_decay, [1.0, 1.0], [1.0, 1.0], [1.0, 1.0])
    assert _reason(solution) == _name(Stop.converged)
    assert int(solution.state.steps) == 0


@pytest.mark.parametrize("corner", [(0.0, 0.0), (0.0, 5.0), (5.0, 0.0), (5.0, 5.0)])
def test_trap_29_every_corner_is_left(corner):
    solution = _solve(_decay, corner, [0.0, 0.0], [5.0, 5.0])
    np.testing.assert_allclose(solution.value, [2.0, 1.3], rtol=0.05)
    assert not np.any(solution.state.active)


def test_a_residual_that_nothing_moves_is_no_success():
    solution = _solve(lambda x, _: jnp.ones(3) + 0 * x[0], [1.0, 2.0])
    assert _reason(solution) == _name(Stop.stalled)
    np.testing.assert_array_equal(solution.value, [1.0, 2.0])


def _in_steps(size):
    """Exact data of a model whose values come in steps, with the slopes of the smooth one."""

    def function(x, _):
        smooth = x[0] * jnp.exp(-x[1] * TIMES) - 2 * np.exp(-1.3 * TIMES)
        return smooth + jax.lax.stop_gradient(size * (jnp.round(smooth / size) + 0.3) - smooth)

    return function


@pytest.mark.parametrize(
    ("size", "start", "stop"),
    [
        (1e-9, [1.0, 1.0], Stop.at_precision),
        # Much is left by the weights of the data, however far the start was; or beside the start, however small.
        (1e-3, [1e8, 1.0], Stop.stalled),
        (1e-9, [2.0 + 1e-6, 1.3], Stop.stalled),
    ],
)
def test_a_stall_where_nothing_of_the_data_is_left_is_a_success(size, start, stop):
    solution = _solve(_in_steps(size), start)
    assert _reason(solution) == _name(stop)
    np.testing.assert_allclose(solution.value, [2.0, 1.3], rtol=10 * size)


def test_a_variable_that_nothing_depends_on_stays():
    solution = _solve(lambda x, _: _decay(x, _) + 0 * x[2], [1.0, 1.0, 7.0])
    assert _reason(solution) == _name(Stop.converged)
    assert float(solution.value[2]) == 7.0


def test_trap_28_two_variables_of_one_effect_share_it():
    solution = _solve(lambda x, _: (x[0] + x[2]) * jnp.exp(-x[1] * TIMES) + _decay(0 * x, _), [1.0, 1.0, 1.0])
    assert _reason(solution) == _name(Stop.converged)
    assert float(solution.value[0]) == pytest.approx(float(solution.value[2]), rel=1e-6)


def test_a_minimum_where_the_jacobian_is_singular_is_a_success():
    """Freudenstein and Roth's other minimum: the offset stays at one, though the gradient is zero."""

    def function(x, _):
        first = -13 + x[0] + ((5 - x[1]) * x[1] - 2) * x[1]
        return jnp.stack([first, -29 + x[0] + ((x[1] + 1) * x[1] - 14) * x[1]])

    solution = _solve(function, [0.5, -2.0])
    assert _reason(solution) == _name(Stop.at_precision)
    assert float(solution.state.offset) > 0.5
    assert 2 * float(solution.state.history[int(solution.state.steps)]) == pytest.approx(48.98425367924, rel=1e-10)


def test_columns_of_very_different_size_are_no_success_by_underflow():
    """One exponential is gone, with a column of 1e-150; what the others promise must still be seen."""

    def function(x, _):
        return x[0] + x[1] * jnp.exp(-x[2] * TIMES) - 2 * np.exp(-1.3 * TIMES)

    solution = _solve(function, [5.0, 1.0, 2200.0])
    squares = float(jnp.sum(solution.state.residual**2))
    best_constant = np.sum((2 * np.exp(-1.3 * TIMES[1:]) - np.mean(2 * np.exp(-1.3 * TIMES[1:]))) ** 2)
    assert squares <= best_constant * (1 + 1e-6)


def test_trap_24_variables_twelve_decades_apart():
    """Brown's badly scaled function: the step of the small variable is lost in the size of the large one."""
    solution = _solve(lambda x, _: jnp.stack([x[0] - 1e6, x[1] - 2e-6, x[0] * x[1] - 2]), [1.0, 1.0])
    np.testing.assert_allclose(solution.value, [1e6, 2e-6], rtol=1e-9)


@pytest.mark.parametrize("start", [0.0, 1e-9, 1e9])
def test_a_start_far_off_in_size(start):
    solution = _solve(lambda x, _: jnp.stack([x[0] - 3.0, 0.1 * (x[0] * x[1] - 6), 0.1 * (x[1] - 1.0)]), [start, start])
    assert _reason(solution) in (_name(Stop.converged), _name(Stop.at_precision))
    assert float(solution.value[0]) == pytest.approx(3.0, rel=0.05)


def test_residuals_that_overflow_are_not_finite():
    solution = _solve(lambda x, _: jnp.stack([1e200 * x[0], x[0] - 1.0]), [1.0])
    assert _reason(solution) == _name(Stop.not_finite)


def test_a_wall_of_no_number_is_walked_along():
    """The straight way from start to minimum crosses a disc in which the residual is not finite."""

    def function(x, _):
        blocked = (x[0] ** 2 + x[1] ** 2) < 1.0
        return jnp.where(blocked, jnp.nan, jnp.stack([x[0] - 3.0, x[1] - 0.1]))

    solution = _solve(function, [-3.0, 0.4])
    assert np.all(np.isfinite(solution.value))
    if _reason(solution) == _name(Stop.converged):
        np.testing.assert_allclose(solution.value, [3.0, 0.1], rtol=1e-6)


_seen: list[np.ndarray] = []


def _recorded(x, box):
    """Three exponentials that note where they are evaluated and are not finite outside the box."""
    jax.debug.callback(lambda point: _seen.append(np.array(point)), x)
    inside = jnp.all((x >= box[0]) & (x <= box[1]))
    curve = x[0] * jnp.exp(-x[1] * TIMES) + x[2] * TIMES - 2 * np.exp(-1.3 * TIMES) - 0.3 * TIMES
    return jnp.where(inside, curve, jnp.nan)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_no_point_outside_the_bounds_is_ever_evaluated(seed):
    random = np.random.default_rng(seed)
    ends = np.sort(random.normal(0, 3, (2, 3)) * 10.0 ** random.uniform(-3, 3, 3), axis=0)
    meeting = random.uniform(size=3) < 0.1
    lower, upper = ends[0], np.where(meeting, ends[0], ends[1])
    start = np.clip(lower + random.uniform(-0.3, 1.3, 3) * (upper - lower), lower, upper)
    _seen.clear()
    solution = _solve(_recorded, start, lower, upper, (lower, upper))
    jax.effects_barrier()
    points = np.stack(_seen).reshape(-1, 3)
    assert len(points) >= int(solution.state.steps) + 1
    assert np.all((points >= lower) & (points <= upper))


_ON_THREADS = """
from concurrent.futures import ThreadPoolExecutor
import jax
jax.config.update("jax_enable_x64", True)
import equinox as eqx, jax.numpy as jnp, numpy as np, optimistix as optx
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt

x = jnp.linspace(0.0, 1.0, 200)

@eqx.filter_jit
@eqx.filter_vmap
def run(start):
    def curve(b, _):
        return jnp.sin(x * b[0]) * b[1] + jnp.exp(-b[2] * x) * b[3] + b[4] * x**2 - 1.0
    return optx.least_squares(curve, BoundedLevenbergMarquardt(), start, max_steps=60, throw=False).value

starts = jnp.asarray(np.random.default_rng(0).uniform(0.5, 3.0, (64, 5)))
run(starts)
with ThreadPoolExecutor(4) as pool:
    list(pool.map(lambda _: run(starts).block_until_ready(), range(16)))
"""


@pytest.mark.slow
def test_trap_23_batches_on_several_threads_end():
    """With LAPACK's batched QR in the loop this hangs within a second."""
    subprocess.run([sys.executable, "-c", _ON_THREADS], timeout=120, check=True)
