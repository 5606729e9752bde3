"""Backlash: a dead zone that is smooth, odd and never negative in slope."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.laws import Backlash

PLAY, WIDTH = 40e-6, 1e-7


def test_dead_within_and_straight_outside():
    law = Backlash(PLAY, WIDTH)
    delta = np.asarray([-1e-3, -60e-6, -10e-6, 0.0, 10e-6, 60e-6, 1e-3])
    sharp = np.sign(delta) * np.maximum(np.abs(delta) - PLAY / 2, 0)
    np.testing.assert_allclose(law(delta), sharp, atol=2e-9)
    np.testing.assert_allclose(law.contact(delta), [1, 1, 0, 0, 0, 1, 1], atol=2e-3)


def test_without_play_it_is_the_deflection():
    delta = jnp.linspace(-1e-4, 1e-4, 21)
    np.testing.assert_array_equal(Backlash(0.0)(delta), delta)
    np.testing.assert_allclose(Backlash(0.0).contact(delta), 1.0, rtol=1e-15)


_slope = jax.jit(jax.grad(lambda delta, play, width: Backlash(play, width)(delta)))


@settings(deadline=None)
@given(st.floats(-1e-3, 1e-3), st.floats(0.0, 2e-4), st.floats(1e-9, 1e-5))
def test_contact_is_the_slope_and_a_share(delta, play, width):
    law = Backlash(play, width)
    share = float(law.contact(delta))
    assert -1e-12 <= share <= 1 + 1e-12
    assert float(law(-delta)) == -float(law(delta))
    assert share == pytest.approx(float(_slope(delta, play, width)), abs=1e-9)


@pytest.mark.parametrize("delta", [0.0, PLAY / 2, -PLAY / 2, 5e-5])
def test_derivatives_at_the_edges_agree_with_differences(delta):
    def force(x, play, width):
        return Backlash(play, width)(x)

    at = (jnp.asarray(delta), jnp.asarray(PLAY), jnp.asarray(WIDTH))
    exact = jax.jit(jax.grad(force, argnums=(0, 1, 2)))(*at)
    for i, h in enumerate((1e-11, 1e-11, 1e-11)):
        up, down = (force(*(x + (j == i) * s for j, x in enumerate(at))) for s in (h, -h))
        assert float(exact[i]) == pytest.approx(float((up - down) / (2 * h)), abs=2e-6)


@pytest.mark.parametrize(("arguments", "named"), [((-1e-6,), "play"), ((1e-6, 0.0), "width")])
def test_bad_input_is_named(arguments, named):
    with pytest.raises(InputError, match=named):
        Backlash(*arguments)
