"""Sums of friction laws, with and without memory."""

import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.laws import CoulombFriction, CoulombViscousFriction, LuGreFriction, SumFriction, ViscousFriction


def test_sum_of_coulomb_and_viscous():
    total = SumFriction((CoulombFriction(20.0, 1e-3), ViscousFriction(200.0)))
    v = jnp.linspace(-0.1, 0.1, 11)
    assert total.initial_state() == ((), ())
    assert total.rate(total.initial_state(), 0.1) == ((), ())
    np.testing.assert_allclose(
        total.force(total.initial_state(), v, 0.0), CoulombViscousFriction(20.0, 200.0, 1e-3)(v), rtol=1e-14
    )


def test_each_term_keeps_its_own_state():
    lugre = LuGreFriction(20.0, 30.0, 0.02, 1e6, 300.0, 100.0, 1e-4)
    total = SumFriction((ViscousFriction(200.0), lugre, lugre))
    state = total.initial_state()
    state = (state[0], state[1]._replace(deflection=jnp.array(1e-5)), state[2])
    v = 0.01
    expected = 200.0 * v + lugre.force(state[1], v, 0.0) + lugre.force(state[2], v, 0.0)
    assert float(total.force(state, v, 0.0)) == pytest.approx(float(expected), rel=1e-14)
    rate = total.rate(state, v)
    assert rate[0] == ()
    assert rate[1].deflection == lugre.rate(state[1], v).deflection
    assert rate[2].deflection == pytest.approx(v)


def test_an_empty_sum_is_refused():
    with pytest.raises(InputError, match="terms"):
        SumFriction(())
