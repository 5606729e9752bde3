"""Constant velocity after a half-cosine ramp."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate

from twin._checks import InputError
from twin.references import ConstantVelocity

FEED = {"velocity": 0.3, "ramp_time": 0.4, "start_time": 0.5, "start_position": 2.0}


def test_position_velocity_and_acceleration_are_one_motion():
    feed = ConstantVelocity(**FEED)
    t = np.linspace(0, 2, 201) + 1e-4
    path = jax.vmap(feed)(t)
    velocity, acceleration = jax.vmap(lambda at: jax.jvp(lambda s: feed(s)[:2], (at,), (jnp.ones(()),))[1])(t)
    np.testing.assert_allclose(velocity, path.velocity, atol=1e-14)
    np.testing.assert_allclose(acceleration, path.acceleration, atol=1e-13)
    for end in (0.7, 1.5):
        travelled, _ = scipy.integrate.quad(lambda s: float(feed(s).velocity), 0.5, end, points=[0.9], epsabs=1e-12)
        assert float(feed(end).position) == pytest.approx(2.0 + travelled, abs=1e-10)


def test_rests_before_and_travels_on():
    feed = ConstantVelocity(**FEED)
    assert tuple(map(float, feed(0.2))) == (2.0, 0.0, 0.0)
    np.testing.assert_allclose(feed(100.0), [2.0 + 0.3 * (99.5 - 0.2), 0.3, 0.0], rtol=1e-14)
    np.testing.assert_allclose(feed.switching_times(), [0.5, 0.9])
    for at in (0.5, 0.9):
        for before, after in zip(feed(at - 1e-9), feed(at + 1e-9), strict=True):
            assert float(after - before) == pytest.approx(0.0, abs=1e-7)


def test_a_mirrored_velocity_mirrors_the_motion():
    t = np.linspace(0, 2, 50)
    there, back = (jax.vmap(ConstantVelocity(v, 0.5))(t) for v in (0.3, -0.3))
    for one, other in zip(there, back, strict=True):
        np.testing.assert_array_equal(one, -other)


def test_derivatives_with_respect_to_every_parameter():
    at = jnp.array([0.2, 0.7, 1.5])

    @jax.jit
    def read(p):
        return jnp.stack(jax.vmap(ConstantVelocity(*p))(at))

    p = jnp.array(list(FEED.values()))
    exact = jax.jit(jax.jacfwd(read))(p)
    for i in range(p.size):
        by_difference = (read(p.at[i].add(1e-6)) - read(p.at[i].add(-1e-6))) / 2e-6
        np.testing.assert_allclose(exact[..., i], by_difference, atol=1e-8)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"ramp_time": 0.0}, "ramp_time must be positive"),
        ({"ramp_time": -1.0}, "ramp_time must be positive"),
        ({"velocity": np.nan}, "velocity must be finite"),
        ({"start_time": np.inf}, "start_time must be finite"),
        ({"start_position": np.nan}, "start_position must be finite"),
    ],
)
def test_bad_input_is_named(arguments, named):
    with pytest.raises(InputError, match=named):
        ConstantVelocity(**(FEED | arguments))
