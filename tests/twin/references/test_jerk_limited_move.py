"""The jerk-limited move: exact end, limits, shortest duration, derivatives in all cases and at their borders."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.references import JerkLimitedMove, MotionPoint

# Distance, velocity limit, acceleration limit, jerk limit: one move of each of the four cases.
CASES = {
    "all seven phases": (0.5, 0.5, 2.0, 50.0),
    "no full acceleration": (0.5, 0.05, 2.0, 50.0),
    "no cruise": (0.05, 0.5, 2.0, 50.0),
    "jerk only": (0.001, 0.5, 2.0, 50.0),
}
# Where one case passes into the next, in numbers that are exact in binary.
BORDERS = {
    "velocity limit just reached": (0.625, 0.5, 0.5, 2.0),
    "full acceleration just reached": (0.125, 0.5, 0.5, 2.0),
    "both just reached": (0.25, 0.25, 0.5, 1.0),
    "no distance": (0.0, 0.5, 2.0, 50.0),
}


def _closed_form_duration(distance, velocity, acceleration, jerk):
    """The four cases written out, with plain numbers."""
    d = abs(distance)
    if velocity * jerk >= acceleration**2:
        if d >= velocity**2 / acceleration + velocity * acceleration / jerk:
            return d / velocity + velocity / acceleration + acceleration / jerk
    elif d >= 2 * velocity * np.sqrt(velocity / jerk):
        return d / velocity + 2 * np.sqrt(velocity / jerk)
    if d >= 2 * acceleration**3 / jerk**2:
        return acceleration / jerk + np.sqrt((acceleration / jerk) ** 2 + 4 * d / acceleration)
    return 4 * np.cbrt(d / (2 * jerk))


def _position(parameters, t):
    return JerkLimitedMove(*parameters)(t).position


@jax.jit
def _sample(parameters):
    """The move at 201 times from before its start to after its end, with its duration and switching times."""
    move = JerkLimitedMove(*parameters)
    times = move.start_time + move.duration() * jnp.linspace(-0.1, 1.1, 201)
    return move.duration(), move.switching_times(), times, jax.vmap(move)(times), jax.vmap(move.jerk)(times)


_AT = jax.jit(lambda parameters, t: JerkLimitedMove(*parameters)(t))
_DURATION = jax.jit(lambda parameters: JerkLimitedMove(*parameters).duration())
_DURATION_SLOPES = jax.jit(jax.grad(lambda parameters: JerkLimitedMove(*parameters).duration()))
_VALUES = jax.jit(jax.vmap(_position, in_axes=(None, 0)))
_FORWARD = jax.jit(jax.vmap(jax.jacfwd(_position, argnums=(0, 1)), in_axes=(None, 0)))
_REVERSE = jax.jit(jax.vmap(jax.jacrev(_position, argnums=(0, 1)), in_axes=(None, 0)))
_OF_ALL = jax.jit(jax.vmap(jax.jacfwd(lambda p, t: JerkLimitedMove(*p)(t), argnums=(0, 1)), in_axes=(None, 0)))

# XLA flushes subnormal numbers to zero.
_position_range = st.floats(-3.0, 3.0, allow_subnormal=False)
_moves = st.tuples(
    _position_range,
    st.floats(1e-3, 3.0),
    st.floats(1e-2, 30.0),
    st.floats(1e-1, 1e4),
    st.floats(-10.0, 10.0, allow_subnormal=False),
    _position_range,
)


def _array(parameters):
    return jnp.array([*parameters, 0.0, 0.0][:6])


@given(_moves)
@settings(max_examples=50, deadline=None)
def test_any_move(parameters):
    distance, velocity_limit, acceleration_limit, jerk_limit, start_time, start = parameters
    duration, switching, times, point, jerk = _sample(jnp.array(parameters))
    duration = float(duration)

    # As short as the closed form, with the end exact.
    assert duration == pytest.approx(_closed_form_duration(*parameters[:4]), rel=1e-11, abs=1e-14)
    after = times > start_time + duration
    np.testing.assert_allclose(point.position[after], start + distance, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(point.position[times < start_time], start)
    end = _AT(jnp.array(parameters), switching[-1])
    assert float(end.position) == pytest.approx(start + distance, rel=0, abs=1e-14 * (1 + abs(start)))

    # Never above a limit, and at every moment at one of them: nothing could be faster.
    assert np.all(np.abs(point.velocity) <= velocity_limit * (1 + 1e-12))
    assert np.all(np.abs(point.acceleration) <= acceleration_limit * (1 + 1e-12))
    at_limit = (
        np.isclose(np.abs(jerk), jerk_limit, rtol=1e-12)
        | np.isclose(np.abs(point.acceleration), acceleration_limit, rtol=1e-9)
        | np.isclose(np.abs(point.velocity), velocity_limit, rtol=1e-9)
    )
    moving = (times > start_time) & (times < start_time + duration)
    assert np.all(at_limit[moving])

    # Monotone, and the same seen from its end.
    steps = np.diff(point.position) * (1 if distance >= 0 else -1)
    assert np.all(steps >= -1e-15 * (1 + abs(start)))
    from_start, to_end = point.position - start, start + distance - point.position[::-1]
    np.testing.assert_allclose(from_start, to_end, atol=1e-12 * (1 + abs(start) + velocity_limit * abs(start_time)))

    assert np.all(np.diff(switching) >= 0)
    assert switching[0] == start_time


@given(_moves)
@settings(max_examples=20, deadline=None)
def test_mirrored_distance_mirrors_the_move(parameters):
    _, _, _, there, jerk_there = _sample(jnp.array([*parameters[:5], 0.0]))
    _, _, _, back, jerk_back = _sample(jnp.array([-parameters[0], *parameters[1:5], 0.0]))
    for a, b in zip([*there, jerk_there], [*back, jerk_back], strict=True):
        np.testing.assert_array_equal(a, -b)


@pytest.mark.parametrize("case", CASES)
def test_each_channel_is_the_derivative_of_the_one_before(case):
    _, switching, times, point, jerk = _sample(_array(CASES[case]))
    by_time = _OF_ALL(_array(CASES[case]), times)
    away = np.min(np.abs(times[:, None] - switching), axis=1) > 1e-9
    np.testing.assert_allclose(by_time.position[1], point.velocity, atol=1e-12)
    np.testing.assert_allclose(by_time.velocity[1], point.acceleration, atol=1e-11)
    np.testing.assert_allclose(by_time.acceleration[1][away], jerk[away], atol=1e-9)


@pytest.mark.parametrize("case", CASES)
def test_continuous_at_the_switching_times(case):
    parameters = _array(CASES[case])
    _, switching, *_ = _sample(parameters)
    before, after = (jax.vmap(_AT, in_axes=(None, 0))(parameters, switching + s * 1e-12) for s in (-1, 1))
    for a, b in zip(before, after, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9)


def test_known_move():
    move = JerkLimitedMove(0.3, 0.5, 2.0, 50.0, start_time=1.0, start_position=-0.1)
    np.testing.assert_allclose(move.switching_times(), 1 + np.array([0, 0.04, 0.25, 0.29, 0.6, 0.64, 0.85, 0.89]))
    assert float(move.duration()) == pytest.approx(0.89, rel=1e-14)
    middle = move(1.445)
    assert isinstance(middle, MotionPoint)
    assert [float(x) for x in middle] == pytest.approx([0.05, 0.5, 0.0], abs=1e-14)
    assert [float(move.jerk(t)) for t in (0.99, 1.0, 1.1, 1.26, 1.4, 1.62, 1.7, 1.86, 1.9)] == [
        0, 50, 0, -50, 0, -50, 0, 50, 0,
    ]  # fmt: skip


def test_no_distance_stays():
    _, switching, _, point, jerk = _sample(jnp.array([0.0, 0.5, 2.0, 50.0, 1.0, 0.7]))
    np.testing.assert_array_equal(switching, 1.0)
    np.testing.assert_array_equal(point.position, 0.7)
    for still in (point.velocity, point.acceleration, jerk):
        np.testing.assert_array_equal(still, 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("case", CASES)
def test_derivatives_match_central_differences(case, sign):
    parameters = _array(CASES[case]).at[0].multiply(sign)
    duration = float(_DURATION(parameters))
    times = duration * jnp.array([-0.1, 0.03, 0.13, 0.27, 0.45, 0.51, 0.62, 0.77, 0.88, 0.97, 1.2])
    by_parameters, _ = _FORWARD(parameters, times)
    np.testing.assert_allclose(by_parameters, _REVERSE(parameters, times)[0], rtol=1e-9, atol=1e-14)
    duration_slopes = _DURATION_SLOPES(parameters)
    for k in range(6):
        h = 1e-6 * max(abs(float(parameters[k])), 1e-2)
        up, down = (parameters.at[k].add(s * h) for s in (1, -1))
        difference = (_VALUES(up, times) - _VALUES(down, times)) / (2 * h)
        np.testing.assert_allclose(by_parameters[:, k], difference, rtol=1e-5, atol=1e-7)
        difference = (_DURATION(up) - _DURATION(down)) / (2 * h)
        assert float(duration_slopes[k]) == pytest.approx(float(difference), rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("border", BORDERS)
def test_derivatives_are_finite_at_the_borders(border):
    parameters = _array(BORDERS[border])
    _, switching, times, *_ = _sample(parameters)
    times = jnp.concatenate([times, switching])
    for derivative in jax.tree.leaves((_OF_ALL(parameters, times), _REVERSE(parameters, times))):
        assert np.all(np.isfinite(derivative))
    assert np.all(np.isfinite(_DURATION_SLOPES(parameters)))


@pytest.mark.parametrize("border", [b for b in BORDERS if b != "no distance"])
@pytest.mark.parametrize("k", [0, 1, 2, 3])
def test_derivatives_at_the_borders_are_those_of_one_side(border, k):
    parameters = _array(BORDERS[border])
    here, slope = float(_DURATION(parameters)), float(_DURATION_SLOPES(parameters)[k])
    sides = [s * (float(_DURATION(parameters.at[k].add(s * 1e-7))) - here) / 1e-7 for s in (1, -1)]
    assert min(abs(slope - side) for side in sides) < 1e-5 * (1 + abs(slope))


def test_a_finished_move_follows_its_distance_also_from_zero():
    for distance in (0.0, 1e-300, -1e-300, 0.3):
        by_parameters, _ = _FORWARD(_array((distance, 0.5, 2.0, 50.0)), jnp.array([-0.1, 5.0]))
        np.testing.assert_allclose(by_parameters[:, 0], [0, 1], atol=1e-15)


def test_a_batch_of_moves():
    batch = jnp.stack([_array(p) for p in [*CASES.values(), *BORDERS.values()]])
    durations = jax.vmap(_DURATION)(batch)
    np.testing.assert_allclose(durations, [_closed_form_duration(*p[:4]) for p in batch.tolist()], rtol=1e-13)
    slopes = jax.vmap(_DURATION_SLOPES)(batch)
    np.testing.assert_allclose(slopes, [_DURATION_SLOPES(p) for p in batch], rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan])
def test_a_bad_sample_of_a_batch_is_marked(k, bad):
    parameters = _array(CASES["no cruise"]).at[k].set(bad)
    assert np.all(np.isnan(jnp.stack(_AT(parameters, 0.1))))
    assert np.isnan(_DURATION(parameters))


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ((np.nan, 0.5, 2.0, 50.0), "distance"),
        ((0.3, 0.0, 2.0, 50.0), "velocity_limit"),
        ((0.3, 0.5, -2.0, 50.0), "acceleration_limit"),
        ((0.3, 0.5, 2.0, 0.0), "jerk_limit"),
        ((0.3, 0.5, 2.0, np.inf), "jerk_limit"),
        ((0.3, 0.5, 2.0, 50.0, np.nan), "start_time"),
        ((0.3, 0.5, 2.0, 50.0, 0.0, np.inf), "start_position"),
    ],
)
def test_bad_input_is_named(arguments, named):
    with pytest.raises(InputError, match=named):
        JerkLimitedMove(*arguments)
