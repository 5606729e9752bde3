"""Stability margins against closed forms: an integrator with dead time, and a triple lag."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import TypeCheckError

from twin._checks import InputError
from twin.frf import FRF
from twin.linear import StateSpace
from twin.performance import stability_margin

F = jnp.geomspace(0.1, 200.0, 5_000)


def integrator_with_delay(gain=10.0, delay=0.02):
    return StateSpace([[0.0]], [[1.0]], [[gain]], [[0.0]], ("u",), ("y",), delay)


def triple_lag(gain, frequency=F):
    return gain / (1 + 2j * jnp.pi * frequency) ** 3


def test_integrator_with_dead_time():
    """G = k·e^(-sT)/s: ω_c = k, phase margin π/2 - kT, gain margin π/(2kT)."""
    found = stability_margin(integrator_with_delay(), F)
    assert float(found.gain_margin) == pytest.approx(np.pi / 0.4, rel=1e-5)
    assert float(found.phase_crossover) == pytest.approx(np.pi / 0.04 / (2 * np.pi), rel=1e-4)
    assert float(found.phase_margin) == pytest.approx(np.pi / 2 - 0.2, rel=1e-6)
    assert float(found.gain_crossover) == pytest.approx(10 / (2 * np.pi), rel=1e-4)
    s = 2j * np.pi * np.asarray(F)
    assert float(found.sensitivity_peak) == pytest.approx(np.max(np.abs(s / (s + 10 * np.exp(-0.02 * s)))), rel=1e-12)


@pytest.mark.parametrize(("gain", "margin"), [(2.0, 4.0), (8.0, 1.0), (16.0, 0.5)])
def test_triple_lag(gain, margin):
    """k/(1 + s)³ crosses -180° at ω = √3 with |G| = k/8; beyond k = 8 the margins say that it is unstable."""
    found = stability_margin(triple_lag(gain), F)
    assert float(found.gain_margin) == pytest.approx(margin, rel=1e-5)
    exact = np.pi - 3 * np.arctan(np.sqrt(gain ** (2 / 3) - 1))
    assert float(found.phase_margin) == pytest.approx(exact, abs=1e-5)


def test_no_crossing_is_infinite():
    lag = 0.5 / (1 + 2j * jnp.pi * F)
    found = stability_margin(lag, F)
    assert np.isinf(found.gain_margin) and np.isinf(found.phase_margin)
    assert np.isnan(found.phase_crossover) and np.isnan(found.gain_crossover)
    assert float(found.sensitivity_peak) <= 1.0


def test_response_system_and_values_are_the_same_loop():
    system = integrator_with_delay()
    values = system.response(F)
    response = FRF(F, values, ("y",), ("u",))
    for other in (stability_margin(response), stability_margin(values[0, 0], F)):
        np.testing.assert_array_equal(jnp.stack(other), jnp.stack(stability_margin(system, F)))


def test_smooth_peak_is_above_the_sharp_one_within_its_bound():
    sharp = stability_margin(integrator_with_delay(), F).sensitivity_peak
    for width in (1e-1, 1e-2, 1e-3):
        smooth = stability_margin(integrator_with_delay(), F, width=width).sensitivity_peak
        assert float(sharp) <= float(smooth) <= float(sharp) + width * np.log(F.size)


@pytest.mark.parametrize("width", [None, 0.02])
def test_derivatives_agree_with_central_differences(width):
    grid = jnp.geomspace(0.1, 200.0, 2000)

    @jax.jit
    def margins(x):
        return jnp.stack(stability_margin(integrator_with_delay(x[0], x[1]), grid, width=width))

    x = jnp.array([10.0, 0.02])
    exact = jax.jit(jax.jacfwd(margins))(x)
    assert np.all(np.isfinite(exact))
    for i, size in enumerate((1e-5, 1e-8)):
        step = jnp.zeros(2).at[i].set(size)
        numeric = (margins(x + step) - margins(x - step)) / (2 * size)
        np.testing.assert_allclose(exact[:, i], numeric, rtol=1e-4, atol=1e-6)
    # π/(2kT) by k and T.
    np.testing.assert_allclose(exact[1], [-np.pi / 4, -np.pi / 0.008], rtol=3e-3)


def test_a_loop_that_is_not_finite_is_marked():
    values = triple_lag(2.0).at[7].set(jnp.nan)
    assert np.all(np.isnan(jnp.stack(stability_margin(values, F))))
    marked = jax.vmap(lambda k: stability_margin(triple_lag(k), F).gain_margin)(jnp.array([2.0, jnp.nan]))
    np.testing.assert_allclose(marked, [4.0, np.nan], rtol=1e-5)


def test_bad_input_is_named():
    two = StateSpace([[0.0]], [[1.0]], [[1.0], [2.0]], [[0.0], [0.0]], ("u",), ("y", "z"))
    with pytest.raises(InputError, match="y, z"):
        stability_margin(two, F)
    with pytest.raises(InputError, match="frequencies"):
        stability_margin(two)
    with pytest.raises(InputError, match="own frequencies"):
        stability_margin(FRF(F, triple_lag(1.0)[None, None], ("y",), ("u",)), F)
    with pytest.raises((InputError, TypeCheckError), match="frequency"):
        stability_margin(triple_lag(1.0)[:-1], F)
    with pytest.raises(InputError, match="width"):
        stability_margin(triple_lag(1.0), F, width=0.0)
    stability_margin(two, F, output="z")
