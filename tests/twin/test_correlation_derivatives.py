"""Derivatives of what modes and responses are compared by, against differences: distinct, crossing, rigid, complex."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin.correlation import csf, eigenvalue, frac, mac, macxp, macxp_of_modes, ndd_squared, nfd, pair_modes
from twin.linear import SecondOrder, frequency_response
from twin.modal import damped_modes, modes

N = 5
NAMES = tuple("abcde")
TURN = np.linalg.qr(np.random.default_rng(1).standard_normal((N, N)))[0]


def difference(function, x, h):
    """Central differences of sixth order."""
    at = {i: function(x + i * h) for i in (-3, -2, -1, 1, 2, 3)}
    return (45 * (at[1] - at[-1]) - 9 * (at[2] - at[-2]) + (at[3] - at[-3])) / (60 * h)


def assert_same(derivative, expected, accuracy=1e-7):
    assert np.all(np.isfinite(derivative))
    assert np.max(np.abs(derivative - expected)) <= accuracy * np.max(np.abs(expected))


def chain(x, *, ground=1.0, dampers=0.0):
    """Masses in a row whose springs change with x, each in its own way; hysteretic material and two dampers."""
    ends = np.eye(N)[:, :-1] - np.eye(N)[:, 1:]
    springs = 1e4 * jnp.asarray([1.0, 1.3, 1.7, 2.2]) * (1 + x * jnp.asarray([0.3, -0.5, 1.0, 0.2]))
    stiffness = ends @ jnp.diag(springs) @ ends.T + 1e4 * ground * np.diag(np.eye(N)[0])
    viscous = 1.5 * np.eye(N) + dampers * np.diag([0.0, 40.0, 0.0, 5.0, 0.0]) * (1 + x)
    mass = np.diag([1.0, 1.1, 1.2, 1.5, 0.9])
    return SecondOrder(mass, viscous, 0.03 * stiffness, stiffness, np.eye(N)[:, :2], np.eye(N), ("p", "q"), NAMES)


def crossing(x):
    """Two machines that do not touch, seen in turned coordinates: at x = 0 their first and second modes cross."""
    one = np.array([[2.0, -1.0], [-1.0, 2.0]])  # eigenvalues 1, 3
    other = np.array([[3.0, -1.0, 0.0], [-1.0, 5.0, -2.0], [0.0, -2.0, 6.0]])
    values, vectors = np.linalg.eigh(other)
    other = vectors @ np.diag([1.0, values[1], values[2]]) @ vectors.T
    zero = jnp.zeros((2, 3))
    stiffness = 1e4 * jnp.block([[(1 + x) * one, zero], [zero.T, (1 - 0.5 * x) * other]])
    stiffness = TURN @ stiffness @ TURN.T
    stiffness = 0.5 * (stiffness + stiffness.T)
    return SecondOrder(np.eye(N), 2.0 * np.eye(N), 0.03 * stiffness, stiffness, np.eye(N), np.eye(N), NAMES, NAMES)


@pytest.mark.slow
@pytest.mark.parametrize("ground", [1.0, 0.0])
@pytest.mark.parametrize("find", [modes, damped_modes])
def test_distinct_and_rigid_body_modes(find, ground):
    """Frequencies, damping ratios, shapes, MACXP with either damping; the free chain has a rigid-body mode."""
    first = 0 if ground else 1
    dampers = 1.0 if find is damped_modes else 0.0
    reference = find(chain(0.0, ground=ground, dampers=dampers))

    def compared(x):
        found = find(chain(x, ground=ground, dampers=dampers))
        return {
            "frequency": found.frequency,
            "damping": found.damping_ratio[first:],
            "real": jnp.real(found.shapes[:, first:]),
            "imaginary": jnp.imag(found.shapes[:, first:]),
            "nfd": nfd(found.frequency, reference.frequency)[first:],
            "ndd": ndd_squared(found.damping_ratio, reference.damping_ratio)[first:],
            "macxp": macxp_of_modes(found, reference, outputs=("a", "c", "d"))[first:, first:],
            "own": macxp_of_modes(found, reference, damping="own")[first:, first:],
        }

    def everything(x):
        return jnp.concatenate([v.ravel() for v in compared(x).values()])

    at, both = 0.011, jax.jit(lambda x: (jax.jacfwd(everything)(x), jax.jacrev(everything)(x)))
    expected = difference(jax.jit(everything), at, 2e-4)
    forward, backward = both(at)
    stop = np.cumsum([v.size for v in jax.eval_shape(compared, at).values()])
    for start, end in zip([0, *stop[:-1]], stop, strict=True):
        scale = np.max(np.abs(expected[start:end]))
        assert np.max(np.abs(forward[start:end] - expected[start:end])) <= 1e-7 * scale
        assert np.max(np.abs(backward[start:end] - expected[start:end])) <= 1e-7 * scale
    # The marked rigid-body mode does not spoil the others' derivatives.
    if not ground:
        whole = jax.jacrev(
            lambda x: jnp.nansum(macxp_of_modes(modes(chain(x, ground=0.0)), modes(chain(0.0, ground=0.0))))
        )
        assert np.isfinite(jax.jit(whole)(at))


@pytest.mark.slow
@pytest.mark.parametrize("at", [-2e-2, -1e-5, 1e-5, 2e-2])
def test_paired_modes_beside_and_across_a_crossing(at):
    """A hundred-thousandth from the crossing the differences reach across it, and only pairing keeps them smooth."""
    reference = modes(crossing(0.05))

    def compared(x):
        found = modes(crossing(x))
        pairs = pair_modes(found, reference)
        return jnp.concatenate([pairs.value, pairs.take(found.frequency) / 100])

    assert np.all(pair_modes(modes(crossing(at)), reference).paired)
    compared = jax.jit(compared)
    assert_same(jax.jit(jax.jacfwd(compared))(at), difference(compared, at, 3e-4))


@pytest.mark.slow
def test_at_the_crossing_itself():
    """What does not depend on the choice of shapes in the pair's subspace is exact, all the rest finite."""
    reference = modes(crossing(0.05))

    def pair(x):
        """Sum of the MAC of both modes with each reference shape, and of both eigenvalues; the other modes' MACXP."""
        found = modes(crossing(x))
        beside = macxp_of_modes(found, reference)[2:]
        alike = mac(found.shapes[:, :2], reference.shapes).sum(axis=0)
        return jnp.concatenate([alike, found.eigenvalues[:2].sum()[None] / 1e4, beside.ravel()])

    values = modes(crossing(0.0)).eigenvalues
    assert np.isclose(values[0], values[1], rtol=1e-13)
    pair = jax.jit(pair)
    assert_same(jax.jit(jax.jacfwd(pair))(0.0), difference(pair, 0.0, 3e-4))
    assert_same(jax.jit(jax.jacrev(pair))(0.0), difference(pair, 0.0, 3e-4))
    slopes = jax.jit(jax.jacfwd(lambda x: macxp_of_modes(modes(crossing(x)), reference)))(0.0)
    assert np.all(np.isfinite(slopes))


@pytest.mark.slow
def test_where_mac_is_one_or_zero():
    """cos² of the angle: slope 0, curvature -2 and 2, times what the eigenvalues make of it."""
    axis, s = jnp.array([1.0, 0.0]), jnp.asarray(-1.0 + 30j)
    measures = (
        lambda a: mac(jnp.stack([jnp.cos(a), jnp.sin(a)]), axis),
        lambda a: macxp(jnp.stack([jnp.cos(a), jnp.sin(a)]), s, axis, s),
        lambda a: mac(jnp.stack([jnp.cos(a) + 0j, 1j * jnp.sin(a)]), axis),
    )
    angles = jnp.array([0.0, jnp.pi / 2])

    @jax.jit
    def derivatives(angles):
        slopes = [jax.vmap(jax.grad(m))(angles) for m in measures]
        return jnp.stack(slopes), jnp.stack([jax.vmap(jax.jacfwd(jax.grad(m)))(angles) for m in measures])

    slope, curvature = derivatives(angles)
    assert np.allclose(slope, 0.0, atol=1e-14)
    assert np.allclose(curvature, [-2.0, 2.0], rtol=1e-12)
    wave = jnp.array([1.0, 1j])

    def travelling(a):
        """φᵀφ = 0 where a = 0: a kink, but no NaN."""
        return macxp(jnp.stack([jnp.cos(a) + 0j, (1 + a) * 1j * jnp.cos(a)]), s, wave, s)

    assert np.isclose(travelling(0.0), 1.0, atol=1e-14)
    assert np.isfinite(jax.grad(travelling)(0.0))
    assert np.isfinite(jax.grad(lambda a: macxp(a * axis, s, wave, s))(0.3))


def test_by_eigenvalue():
    shapes = jnp.asarray(np.random.default_rng(0).standard_normal((2, 4))) + 0.3j

    def value(x):
        return macxp(shapes[0], eigenvalue(20 + x, 0.03 + x), shapes[1], eigenvalue(20.0, 0.03))

    value = jax.jit(value)
    for at in (-0.02, 0.0, 0.1):
        assert_same(jax.grad(value)(at), difference(value, at, 1e-4), 1e-8)


@pytest.mark.slow
def test_frequency_response_with_hysteretic_damping():
    """Receptance, FRAC and CSF at and between resonances, with one line on each resonance."""
    lines = jnp.sort(jnp.concatenate([modes(chain(0.0)).frequency, jnp.linspace(1.0, 40.0, 20)]))
    reference = frequency_response(chain(0.0, dampers=1.0), lines).values

    def response(x):
        return frequency_response(chain(x, dampers=1.0), lines).values

    def compared(x):
        values = response(x)
        return jnp.stack([frac(values, reference), csf(values, reference)])

    at, h = 0.01, 2e-4
    for function in (lambda x: response(x).real, lambda x: response(x).imag, compared):
        fast = jax.jit(function)
        assert_same(jax.jit(jax.jacfwd(function))(at), difference(fast, at, h))
    assert np.allclose(jax.jit(jax.jacfwd(compared))(0.0), 0.0, atol=1e-9)

    def by_material(x):
        system = chain(0.0)
        system = eqx.tree_at(lambda s: s.hysteretic, system, system.hysteretic * x)
        return jnp.abs(frequency_response(system, lines).values)

    assert_same(jax.jit(jax.jacfwd(by_material))(1.0), difference(jax.jit(by_material), 1.0, 1e-2))
