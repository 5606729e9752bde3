"""Response and settling time: closed forms, order of the interpolation, derivatives, moves that never arrive."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.performance import response_time as _response_time
from twin.performance import settling_time as _settling_time

response_time = eqx.filter_jit(_response_time)
settling_time = eqx.filter_jit(_settling_time)


def lag(times, rate):
    """First-order lag from 0.2 to 1.2 m, its position and speed."""
    return 0.2 + 1 - jnp.exp(-rate * times), rate * jnp.exp(-rate * times)


def oscillation(times, damping=0.15, omega=20.0):
    """Second-order step from 0 to 1."""
    s, d = damping * omega, omega * np.sqrt(1 - damping**2)
    wave = jnp.cos(d * times) + s / d * jnp.sin(d * times)
    return 1 - jnp.exp(-s * times) * wave, jnp.exp(-s * times) * jnp.sin(d * times) * (d + s**2 / d)


@given(st.floats(3.0, 40.0), st.floats(0.1, 0.999))
@settings(max_examples=30, deadline=None)
def test_first_order_lag(rate, share):
    t = jnp.linspace(0.0, 4.0, 4001)
    rate, share = jnp.asarray(rate), jnp.asarray(share)
    x, v = lag(t, rate)
    exact = float(-np.log1p(-share) / rate)
    assert float(response_time(t, x, 1.2, share=share, velocity=v)) == pytest.approx(exact, abs=1e-9)
    # A straight line is off by at most h²·rate/8 in time.
    assert float(response_time(t, x, 1.2, share=share)) == pytest.approx(exact, abs=1.01e-6 * float(rate) / 8)


def test_order_of_the_interpolation():
    """Straight lines gain a factor of four from half the step, cubics sixteen."""
    exact = -np.log(0.01) / 5
    for cubic, order in ((False, 2), (True, 4)):
        off = []
        # The instant stays at the same place within its interval.
        for count in (8, 16, 32):
            step = exact / (count + 0.4)
            t = step * jnp.arange(3 * count)
            x, v = lag(t, 5.0)
            off.append(abs(float(response_time(t, x, 1.2, start=0.2, velocity=v if cubic else None)) - exact))
        rates = np.log2(np.array(off[:-1]) / np.array(off[1:]))
        assert np.all(rates > order - 0.4)


def test_downwards_and_later_begin():
    t = jnp.linspace(3.0, 7.0, 2001)
    x, v = lag(t - 3.0, 5.0)
    assert float(response_time(t, -x, -1.2, velocity=-v)) == pytest.approx(-np.log(0.01) / 5, rel=1e-7)


def test_first_and_last_time():
    t = jnp.linspace(0.0, 2.0, 4001)
    x, v = oscillation(t)
    first = float(response_time(t, x, 1.0, velocity=v))
    last = float(response_time(t, x, 1.0, velocity=v, settle=True))
    above = np.asarray(x >= 0.99)
    assert first == pytest.approx(float(t[np.argmax(above)]), abs=1e-3)
    assert last == pytest.approx(float(t[np.flatnonzero(~above)[-1]]), abs=1e-3)
    assert first < last


def test_settling_time_of_an_oscillation():
    t = jnp.linspace(0.0, 3.0, 6001)
    x, v = oscillation(t)
    for tolerance in (0.5, 0.05, 0.02, 0.001):
        outside = np.flatnonzero(np.abs(np.asarray(x) - 1) > tolerance)
        found = float(settling_time(t, x, 1.0, tolerance, velocity=v))
        assert t[outside[-1]] <= found <= t[outside[-1] + 1]
    assert float(settling_time(t, x, 1.0, 2.0)) == 0.0


def test_a_jump_across_the_band_is_met_on_its_own_side():
    t = np.array([0.0, 1.0, 2.0, 3.0])
    # From above the band to inside it but below the target: outside until x = 1.1, nine tenths of the way.
    assert float(settling_time(t, np.array([2.0, 2.0, 0.95, 1.0]), 1.0, 0.1)) == pytest.approx(1 + 0.9 / 1.05)


@pytest.mark.parametrize("settle", [False, True])
@pytest.mark.parametrize("cubic", [False, True])
def test_derivatives_agree_with_central_differences(settle, cubic):
    t = jnp.linspace(0.0, 2.0, 201)

    @jax.jit
    def time(x):
        omega, end, share, begin = x
        place, speed = oscillation(t, omega=omega)
        velocity = speed if cubic else None
        return response_time(t, place, end, start=begin, share=share, velocity=velocity, settle=settle)

    x = jnp.array([20.0, 1.0, 0.97, 0.01])
    forward = jax.jit(jax.jacfwd(time))(x)
    np.testing.assert_allclose(forward, jax.jit(jax.jacrev(time))(x), rtol=1e-10)
    for i in range(x.size):
        step = jnp.zeros(x.size).at[i].set(1e-6)
        assert float(forward[i]) == pytest.approx(float(time(x + step) - time(x - step)) / 2e-6, rel=1e-5)


def test_derivative_of_the_settling_time():
    t = jnp.linspace(0.0, 3.0, 601)

    @jax.jit
    def time(x):
        place, speed = oscillation(t, omega=x[0])
        return settling_time(t, place, x[1], x[2], velocity=speed)

    x = jnp.array([20.0, 1.0, 0.03])
    exact = jax.jit(jax.jacfwd(time))(x)
    for i in range(x.size):
        step = jnp.zeros(x.size).at[i].set(1e-6)
        assert float(exact[i]) == pytest.approx(float(time(x + step) - time(x - step)) / 2e-6, rel=1e-5)


def test_never_reached_is_marked_and_its_derivative_too():
    t = jnp.linspace(0.0, 1.0, 11)
    assert np.isnan(response_time(t, 0.5 * t, 1.0))
    assert np.isnan(jax.grad(lambda a: response_time(t, a * t, 1.0))(0.5))
    # Reached once, but not there at the end.
    hump = jnp.sin(jnp.pi * t)
    assert np.isfinite(response_time(t, hump, 0.9)) and np.isnan(response_time(t, hump, 0.9, settle=True))
    assert np.isnan(settling_time(t, hump, 0.9, 0.01))
    assert np.isnan(jax.grad(lambda a: settling_time(t, a * hump, 0.9, 0.01))(1.0))


def test_a_failed_run_and_no_travel_are_marked():
    t = jnp.linspace(0.0, 1.0, 11)
    broken = t.at[-1].set(jnp.nan)
    assert np.isnan(response_time(t, broken, 0.5)) and np.isnan(settling_time(t, broken, 0.5, 0.1))
    assert np.isnan(response_time(t, t, 0.5, velocity=broken))
    marked = jax.vmap(lambda target: response_time(t, t, target))(jnp.array([0.0, 0.5, 2.0]))
    np.testing.assert_allclose(marked, [np.nan, 0.495, np.nan])


def test_there_already():
    t = jnp.linspace(0.0, 1.0, 11)
    assert float(response_time(t, 1.0 + t, 1.0, start=0.0)) == 0.0
    assert float(response_time(t, 1.0 + t, 1.0, start=0.0, settle=True)) == 0.0
    assert np.isfinite(jax.grad(lambda a: response_time(t, a + t, 1.0, start=0.0))(1.0))


def test_bad_input_is_named():
    t = np.linspace(0.0, 1.0, 11)
    with pytest.raises(InputError, match="no travel"):
        _response_time(t, t, 0.0)
    with pytest.raises(InputError, match="share"):
        _response_time(t, t, 1.0, share=0.0)
    with pytest.raises(InputError, match="tolerance"):
        _settling_time(t, t, 1.0, -1e-6)
    with pytest.raises(InputError, match="times"):
        _settling_time(t[::-1].copy(), t, 1.0, 1e-6)
