"""The mesh of pinion and rack: force, potential, inverse and derivatives, in both readings of k(F)."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.drives.leipe import DAMPING, STIFFNESS
from twin.drives.rack_pinion_operation import small_signal
from twin.laws import Backlash, HyperbolicDamping, RootStiffness, SecantMesh, TangentMesh

PLAY, WIDTH = 40e-6, 1e-7
READINGS = [TangentMesh, SecantMesh]
# k1, k2, d1, d2, d3, play
LEIPE = np.array([*STIFFNESS, *DAMPING, PLAY])
RIGID = np.array([*STIFFNESS, *DAMPING, 0.0])
FORCES = np.array([-2e4, -300.0, -1.0, -1e-3, -1e-9, 0.0, 1e-9, 1e-3, 1.0, 300.0, 2e4, 1e6])


def _mesh(reading, p):
    return reading(RootStiffness(p[0], p[1]), HyperbolicDamping(p[2], p[3], p[4]), Backlash(p[5]))


def _force(reading, delta, rate, load, p):
    return _mesh(reading, p).force(delta, rate, load)


def _deflection(reading, force, p):
    return _mesh(reading, p).deflection(force)


def _jitted(function, **kwargs):
    return {r: jax.jit(jax.vmap(lambda *a, r=r: function(r, *a), **kwargs)) for r in READINGS}


def _slopes(reading, delta, rate, load, p):
    return jax.jacfwd(lambda *a: _force(reading, *a), argnums=(0, 1, 2, 3))(delta, rate, load, p)


def _resting_slopes(reading, force, p):
    return jax.jacfwd(lambda *a: _deflection(reading, *a), argnums=(0, 1))(force, p)


force = _jitted(_force, in_axes=(0, 0, 0, None))
slopes = _jitted(_slopes, in_axes=(0, 0, 0, None))
deflection = _jitted(_deflection, in_axes=(0, None))
resting_slopes = _jitted(_resting_slopes, in_axes=(0, None))
one_force = {r: jax.jit(lambda *a, r=r: _force(r, *a)) for r in READINGS}


def _alike(n, *values):
    return [jnp.broadcast_to(jnp.asarray(v, dtype=jnp.float64), n) for v in values]


def test_the_tangent_force_is_the_slope_of_the_potential():
    mesh = _mesh(TangentMesh, LEIPE)
    delta = jnp.concatenate([jnp.linspace(-6e-5, 6e-5, 41), jnp.array([PLAY / 2, -PLAY / 2, PLAY / 2 + WIDTH, 1e-3])])
    slope = jax.vmap(jax.grad(mesh.potential))(delta)
    np.testing.assert_allclose(mesh.elastic(delta), slope, rtol=1e-12, atol=1e-12)
    assert float(mesh.potential(0.0)) == pytest.approx(0.0, abs=1e-15)
    assert np.all(np.asarray(mesh.potential(delta)) >= -1e-15)


def test_the_slope_of_the_force_is_the_stiffness_at_that_force():
    """And the closed form F = [k1·(1 - 1/k2)·ε]^(k2/(k2 - 1))."""
    mesh, f = _mesh(TangentMesh, RIGID), jnp.array([-2e4, -5e3, 7e3, 1e4, 1e5])
    k1, k2 = STIFFNESS
    delta = np.sign(f) * np.abs(f) ** (1 - 1 / k2) / (k1 * (1 - 1 / k2))
    np.testing.assert_allclose(mesh.elastic(delta), f, rtol=1e-6)
    slope = jax.vmap(jax.grad(mesh.elastic))(mesh_rests(TangentMesh, f, RIGID))
    np.testing.assert_allclose(slope, mesh.stiffness(f), rtol=1e-6)
    # Where nothing is pressed together yet, the stiffness is what the law gives at its width.
    assert float(jax.grad(mesh.elastic)(0.0)) == pytest.approx(float(mesh.stiffness(0.0)), rel=1e-12)


def mesh_rests(reading, f, p):
    return deflection[reading](jnp.asarray(f), p)


def test_readings_agree_in_the_stiffness_of_small_motions_and_differ_in_the_way_to_it():
    """k(F) is the slope about a rest under F in both; of F/δ it is all in one, the part 1 - 1/k2 in the other."""
    f = jnp.array([2e4, -1e5])
    tangent, secant = (_mesh(r, RIGID) for r in READINGS)
    for mesh in (tangent, secant):
        for at in f:
            stiffness, damping = small_signal(mesh, at)
            assert float(stiffness) == pytest.approx(float(mesh.stiffness(at)), rel=1e-6)
            assert float(damping) == pytest.approx(float(mesh.damping(at)), rel=1e-6)
    np.testing.assert_allclose(f / mesh_rests(SecantMesh, f, RIGID), secant.stiffness(f), rtol=1e-12)
    ratio = f / mesh_rests(TangentMesh, f, RIGID)
    np.testing.assert_allclose(ratio, (1 - 1 / STIFFNESS[1]) * tangent.stiffness(f), rtol=1e-6)


def test_the_secant_reads_the_motors_force():
    mesh = _mesh(SecantMesh, RIGID)
    k1, k2 = STIFFNESS
    expected = k1 * 900.0 ** (1 / k2) * 2e-5 + (DAMPING[0] / (DAMPING[1] + 900.0) + DAMPING[2]) * 0.01
    assert float(mesh.force(2e-5, 0.01, -900.0)) == pytest.approx(expected, rel=1e-5)
    assert float(_mesh(TangentMesh, RIGID).force(2e-5, 0.01, -900.0)) == float(
        _mesh(TangentMesh, RIGID).force(2e-5, 0.01, 0.0)
    )


@pytest.mark.parametrize("reading", READINGS)
def test_odd(reading):
    delta, rate = jnp.array([0.0, 1e-6, PLAY / 2, 3e-5, 1e-3]), jnp.array([0.0, 0.1, -0.2, 0.05, 0.01])
    load = jnp.array([0.0, 5.0, -800.0, 300.0, 1e4])
    there, back = force[reading](delta, rate, load, LEIPE), force[reading](-delta, -rate, -load, LEIPE)
    np.testing.assert_allclose(there, -back, rtol=1e-13, atol=1e-300)


def _differences(function, at, steps):
    """Derivatives of a function of a vector by central differences of fourth order, (outputs, parts)."""
    columns = []
    for i, h in enumerate(steps):
        unit = np.zeros(len(steps))
        unit[i] = h
        values = [np.asarray(function(at + k * unit)) for k in (-2, -1, 1, 2)]
        columns.append((values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("p", [LEIPE, RIGID], ids=["play", "no play"])
@pytest.mark.parametrize("reading", READINGS)
def test_derivatives_agree_with_differences_at_awkward_points(reading, p):
    delta = np.array([0.0, PLAY / 2, -PLAY / 2, PLAY / 2 + WIDTH, 1e-5, -5e-5, 1e-3])
    _, rate, load = _alike(delta.size, 0.0, 0.02, 700.0)
    by_delta, by_rate, by_load, by_p = slopes[reading](jnp.asarray(delta), rate, load, p)
    exact = np.concatenate([np.stack([by_delta, by_rate, by_load], axis=-1), by_p], axis=1)

    def at(v):
        return force[reading](jnp.asarray(delta + v[0]), rate + v[1], load + v[2], p + v[3:])

    steps = np.array([1e-9, 1e-3, 1.0, *(1e-4 * p[:5]), 1e-9])
    expected = _differences(at, np.zeros(9), steps)
    floor = 1e-6 * np.max(np.abs(expected), axis=0)
    np.testing.assert_array_less(np.abs(exact - expected), 1e-6 * np.abs(expected) + floor + 1e-9)


@pytest.mark.parametrize("reading", READINGS)
def test_value_and_derivatives_are_finite_however_large_the_deflection(reading):
    delta = jnp.array([1.0, -1e3, 1e60, -1e100])
    _, rate, load = _alike(delta.size, 0.0, 0.1, 1e5)
    values = force[reading](delta, rate, load, LEIPE)
    assert np.all(np.isfinite(values))
    assert np.all(np.sign(values) == np.sign(delta))
    for slope in slopes[reading](delta, rate, load, LEIPE):
        assert np.all(np.isfinite(slope))


@pytest.mark.parametrize("p", [LEIPE, RIGID], ids=["play", "no play"])
@pytest.mark.parametrize("reading", READINGS)
def test_the_deflection_is_the_inverse_of_the_force(reading, p):
    rests = deflection[reading](jnp.asarray(FORCES), p)
    back = force[reading](rests, jnp.zeros(FORCES.size), jnp.asarray(FORCES), p)
    np.testing.assert_allclose(back, FORCES, rtol=1e-10, atol=1e-15)
    np.testing.assert_array_equal(rests[FORCES == 0], 0)
    np.testing.assert_allclose(rests, -mesh_rests(reading, -FORCES, p), rtol=1e-10)
    alone = float(_mesh(reading, p).deflection(FORCES[7]))
    assert alone == pytest.approx(float(rests[7]), rel=1e-13)


@pytest.mark.parametrize("p", [LEIPE, RIGID], ids=["play", "no play"])
@pytest.mark.parametrize("reading", READINGS)
def test_the_derivative_of_the_deflection_agrees_with_differences(reading, p):
    f = np.array([-2e4, -300.0, 1e-3, 0.0, 1.0, 5e3])
    by_force, by_p = resting_slopes[reading](jnp.asarray(f), p)
    exact = np.concatenate([np.asarray(by_force)[:, None], by_p], axis=1)
    steps = np.maximum(1e-3 * np.abs(f), 1e-10)
    up = [mesh_rests(reading, f + k * steps, p) for k in (-2, -1, 1, 2)]
    expected = (up[0] - 8 * up[1] + 8 * up[2] - up[3]) / (12 * steps)
    np.testing.assert_allclose(exact[:, 0], expected, rtol=2e-5)
    expected = _differences(lambda v: mesh_rests(reading, f, p + v), np.zeros(6), [*(1e-4 * p[:5]), 1e-9])
    floor = 1e-6 * np.max(np.abs(expected), axis=0)
    np.testing.assert_array_less(np.abs(exact[:, 1:] - expected), 1e-6 * np.abs(expected) + floor + 1e-18)


@jax.jit
def _rests(f, load):
    return _mesh(SecantMesh, LEIPE).deflection(f, load)


def test_the_secants_rest_under_another_motor_force():
    mesh = _mesh(SecantMesh, LEIPE)
    assert float(mesh.force(_rests(500.0, 800.0), 0.0, 800.0)) == pytest.approx(500.0, rel=1e-12)
    by_force, by_load = jax.jit(jax.jacfwd(_rests, argnums=(0, 1)))(500.0, 800.0)
    assert float(by_force) == pytest.approx(float(_rests(500.1, 800.0) - _rests(499.9, 800.0)) / 0.2, rel=1e-6)
    assert float(by_load) == pytest.approx(float(_rests(500.0, 800.1) - _rests(500.0, 799.9)) / 0.2, rel=1e-6)


_parts = st.tuples(
    st.floats(1e5, 1e9), st.floats(1.05, 50.0), st.floats(0.0, 1e7), st.floats(1.0, 1e4), st.floats(0.0, 1e6)
)


@settings(deadline=None)
@given(_parts, st.floats(0.0, 2e-4), st.floats(-3e-4, 3e-4), st.floats(-1.0, 1.0), st.floats(-5e4, 5e4))
def test_damping_never_gives_energy(parts, play, delta, rate, load):
    p = np.array([*parts, play])
    for reading in READINGS:
        moving, still = (float(one_force[reading](delta, v, load, p)) for v in (rate, 0.0))
        assert (moving - still) * rate >= -1e-12 * abs(still * rate)


@pytest.mark.parametrize("k2", [1.0, 0.5])
def test_a_root_of_order_one_has_no_tangent_reading(k2):
    with pytest.raises(InputError, match="k2 of the stiffness must be above 1"):
        TangentMesh(RootStiffness(1e7, k2), HyperbolicDamping(*DAMPING), Backlash(PLAY))
    assert float(SecantMesh(RootStiffness(1e7, k2), HyperbolicDamping(*DAMPING), Backlash(0.0)).deflection(1.0)) > 0
