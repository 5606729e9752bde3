"""Modal damping contributions: their sum is the damping ratio of `modes`, to the last digits."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.linear import SecondOrder
from twin.modal import damping_contributions, modes

N, VECTORS = 5, 7
KINDS = ("viscous", "hysteretic", "viscous", "hysteretic")
SOURCES = (0, 1, 1, 2, 3, 3, 3)
RNG = np.random.default_rng(3)
B = RNG.standard_normal((N, VECTORS)) - 0.2
P = np.array([3.0, 400.0, 0.7, 90.0])


def system(sizes, *, free=False):
    """A skew one with known damping beside the sources; free ones are moved by no spring in one direction."""
    rng = np.random.default_rng(0)
    skew = np.eye(N) + 0.2 * rng.standard_normal((N, N))
    mass = skew @ skew.T
    stiffness = 1e5 * skew @ np.diag([0.0 if free else 0.5, 1.0, 2.0, 4.0, 7.0]) @ skew.T
    viscous, hysteretic = 0.4 * mass, 2e-3 * stiffness
    for b, source in zip(B.T, SOURCES, strict=True):
        added = sizes[source] * np.outer(b, b)
        viscous, hysteretic = (
            (viscous + added, hysteretic) if KINDS[source] == "viscous" else (viscous, hysteretic + added)
        )
    return SecondOrder(mass, viscous, hysteretic, stiffness, np.eye(N), np.eye(N), ("a",) * N, ("b",) * N)


@pytest.mark.parametrize("free", [False, True])
def test_they_add_up_to_the_damping_ratio(free):
    found, bare = modes(system(P, free=free)), modes(system(0 * P, free=free))
    factors = damping_contributions(found, B, KINDS, sources=SOURCES)
    assert factors.shape == (N, 4)
    assert np.allclose(bare.damping_ratio + factors @ P, found.damping_ratio, rtol=1e-12)
    assert np.all(factors[0] == 0.0) == free
    slope = jax.jacfwd(lambda p: modes(system(p, free=free)).damping_ratio)(jnp.asarray(P))
    assert np.allclose(factors, slope, rtol=1e-11)


def test_one_kind_for_all_each_vector_a_source():
    found = modes(system(P))
    omega = 2 * np.pi * found.frequency[:, None]
    strokes = (found.shapes.T @ B) ** 2
    assert np.allclose(damping_contributions(found, B, "viscous"), strokes / (2 * omega), rtol=1e-13)
    assert np.allclose(damping_contributions(found, B, "hysteretic"), strokes / (2 * omega**2), rtol=1e-13)


def test_derivatives_with_a_rigid_body_mode():
    def factors(x):
        base = system(P, free=True)
        return damping_contributions(
            modes(eqx.tree_at(lambda s: s.stiffness, base, base.stiffness * x)), B, KINDS, sources=SOURCES
        )

    factors, h = jax.jit(factors), 1e-3
    forward, backward = jax.jacfwd(factors)(1.0), jax.jacrev(factors)(1.0)
    difference = (8 * (factors(1 + h) - factors(1 - h)) - factors(1 + 2 * h) + factors(1 - 2 * h)) / (12 * h)
    assert np.allclose(forward, difference, rtol=1e-7, atol=1e-10 * np.max(np.abs(difference)))
    assert np.allclose(forward, backward, rtol=1e-9, atol=1e-14)
    assert np.all(forward[0] == 0.0)


def test_bad_input():
    found = modes(system(P))
    with pytest.raises(InputError, match="vectors must have one row for each of 5"):
        damping_contributions(found, B[:4], "viscous")
    with pytest.raises(InputError, match="vectors must be finite"):
        damping_contributions(found, np.nan * B, "viscous")
    with pytest.raises(InputError, match="kind must be viscous or hysteretic"):
        damping_contributions(found, B, "dry")
    with pytest.raises(InputError, match="each of 4 sources"):
        damping_contributions(found, B, ("viscous",) * 3, sources=SOURCES)
    with pytest.raises(InputError, match="without a gap"):
        damping_contributions(found, B, "viscous", sources=(0, 1, 1, 2, 4, 4, 4))
