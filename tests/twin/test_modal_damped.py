"""Damped modes: against state space, closed forms and finite differences."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.drives import SpringDampers, TwoMass, mauro_axis, two_mass_modes
from twin.laws import ViscousFriction
from twin.linear import SecondOrder
from twin.modal import damped_modes, modes
from twin.paths import set_leaves


def damped_axis():
    """Dampers out of proportion: two modes overdamp nearly, all are complex."""
    return eqx.tree_at(lambda a: a.damping, mauro_axis(), SpringDampers(1.0, 2.0, 6e4, 2e4, 4e4))


def single(mass, viscous, stiffness, hysteretic=0.0):
    matrices = [np.array([[x]]) for x in (mass, viscous, hysteretic, stiffness)]
    return SecondOrder(*matrices, np.eye(1), np.eye(1), ("force",), ("position",))


def test_proportional_damping_gives_the_undamped_shapes():
    system = mauro_axis().second_order()
    found, undamped = damped_modes(system), modes(system)
    assert np.allclose(found.frequency, undamped.frequency, rtol=1e-10)
    assert np.allclose(found.damping_ratio, undamped.damping_ratio, rtol=1e-8)
    assert np.allclose(found.shapes, undamped.shapes, rtol=1e-8, atol=1e-9)
    assert np.array_equal(found.oscillating, [False] + [True] * 5)


def test_poles_are_those_of_the_state_space():
    system = damped_axis().second_order(friction_speed=10.0)
    found = damped_modes(system)
    inverse = np.linalg.inv(system.mass)
    a = np.block([[np.zeros((6, 6)), np.eye(6)], [-inverse @ system.stiffness, -inverse @ system.viscous]])
    poles = np.linalg.eigvals(a)
    for pole in found.poles[np.asarray(found.oscillating)]:
        assert np.min(np.abs(poles - pole)) < 1e-8 * np.abs(pole)
    s = found.poles
    dynamic = s[:, None, None] ** 2 * system.mass + s[:, None, None] * system.viscous + system.stiffness
    residual = np.einsum("mij,jm->im", dynamic, found.shapes)
    size = np.einsum("mij,jm->im", np.abs(dynamic), np.abs(found.shapes))
    assert np.all(np.abs(residual)[:, 1:] <= 1e-11 * size[:, 1:].max(axis=0))


def test_response_is_the_sum_of_the_modes():
    """Receptance Σ ψψᵀ/(2j·ω_d·(jω - s)) + conjugate, all pairs of poles oscillating: the normalisation is right."""
    base = damped_axis().second_order()
    system = eqx.tree_at(lambda s: s.stiffness, base, base.stiffness + jnp.diag(jnp.diag(base.mass)) * 1e5)
    found = damped_modes(system)
    assert np.all(found.oscillating)
    frequency = np.array([20.0, 150.0, 900.0])
    response = system.response(jnp.asarray(frequency))
    for i, w in enumerate(2 * np.pi * frequency):
        terms = found.shapes / (2j * np.imag(found.poles) * (1j * w - found.poles))
        mirrored = np.conj(found.shapes) / (-2j * np.imag(found.poles) * (1j * w - np.conj(found.poles)))
        total = terms @ found.shapes.T + mirrored @ np.conj(found.shapes).T
        expected = response[:, :, i]
        assert np.allclose(total @ system.input_map, expected, rtol=1e-7, atol=1e-9 * np.max(np.abs(expected)))


def test_two_mass_with_friction_in_closed_form():
    drive = TwoMass(3e-3, 5e-3, 900.0, 0.05, ViscousFriction(0.02), ViscousFriction(0.2))
    found, exact = damped_modes(drive.second_order()), two_mass_modes(drive)
    assert np.isclose(found.damping_ratio[1], exact.damping_ratio, rtol=1e-9)
    assert found.frequency[0] == 0.0
    assert found.damping_ratio[0] == 0.0


def test_one_mass():
    light = damped_modes(single(2.0, 8.0, 5000.0))
    assert np.isclose(light.poles[0], -2.0 + 1j * np.sqrt(2500.0 - 4.0), rtol=1e-13)
    hysteretic = damped_modes(single(2.0, 0.0, 5000.0, 200.0))
    assert np.isclose(hysteretic.poles[0], 1j * np.sqrt(2500.0 + 100j), rtol=1e-13)
    slow = damped_modes(single(1.0, 10.0, 16.0))
    assert np.isclose(slow.poles[0], -2.0)
    assert slow.damping_ratio[0] == 1.0
    assert not slow.oscillating[0]
    assert np.isclose(np.abs(slow.shapes[0, 0]), 1.0)


@pytest.mark.slow
def test_derivatives():
    """In both modes, against differences, first and second order, with the rigid body's defective pole beside."""

    @jax.jit
    def everything(k):
        system = set_leaves(damped_axis(), {"springs.support": k}).second_order()
        system = eqx.tree_at(lambda s: s.hysteretic, system, 0.02 * system.stiffness)
        found = damped_modes(system)
        return jnp.concatenate([found.frequency, found.damping_ratio, found.shapes.real.ravel()])

    k, h = 4e8, 4e4
    forward, backward = jax.jit(jax.jacfwd(everything))(k), jax.jit(jax.jacrev(everything))(k)
    difference = (everything(k + h) - everything(k - h)) / (2 * h)
    assert np.all(np.isfinite(forward))
    scale = np.concatenate([np.full(12, np.max(np.abs(difference[:12]))), np.full(36, np.max(np.abs(difference[12:])))])
    assert np.all(np.abs(forward - backward) <= 1e-9 * scale)
    assert np.all(np.abs(forward - difference) <= 1e-6 * scale)
    second = jax.jit(jax.jacfwd(jax.jacfwd(lambda k: everything(k)[1:12])))(k)
    step = 4e6
    expected = ((everything(k + step) - 2 * everything(k) + everything(k - step)) / step**2)[1:12]
    assert np.allclose(second[:5], expected[:5], rtol=1e-2, atol=1e-4 * np.max(np.abs(expected[:5])))
    assert np.allclose(second[6:], expected[6:], rtol=1e-2, atol=1e-4 * np.max(np.abs(expected[6:])))


def test_batches_are_the_single_ones():
    def frequency(k):
        return damped_modes(set_leaves(damped_axis(), {"springs.nut": k}).second_order()).damping_ratio

    stiffnesses = jnp.array([1e9, 1.5e9, 2e9])
    batch = jax.jit(jax.vmap(frequency))(stiffnesses)
    single_ = jax.jit(frequency)
    assert np.allclose(batch, [single_(k) for k in stiffnesses], rtol=1e-10)


def test_damped_modes_refuse():
    with pytest.raises(InputError, match="mass matrix is not positive definite"):
        damped_modes(single(0.0, 1.0, 1.0))
