"""Trap 17: derivatives of modes where eigenvalues are repeated, and where modes cross along the stroke."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin.drives import mauro_axis, screw_elasticities
from twin.modal import modes, track
from twin.modal._eigen import generalised_eigh, repeated

N = 5


def ring(seed=0):
    """Equal masses in a ring, seen in skew coordinates: eigenvalues 0, a, a, b, b. And a direction to change it in."""
    rng = np.random.default_rng(seed)
    turn = np.roll(np.eye(N), 1, axis=0)
    skew = np.eye(N) + 0.3 * rng.standard_normal((N, N))
    stiffness = skew @ (1e6 * (2 * np.eye(N) - turn - turn.T)) @ skew.T
    directions = [0.5 * (a + a.T) for a in rng.standard_normal((2, N, N))]
    return jnp.asarray(stiffness), jnp.asarray(skew @ skew.T), jnp.asarray(1e6 * directions[0]), directions[1]


def contour(stiffness, mass, d_stiffness, d_mass, centre, radius):
    """Projector Σφφᵀ on the modes with eigenvalues inside a circle, and its derivative, without any eigenvector."""
    angles = 2 * np.pi * (np.arange(64) + 0.5) / 64
    projector, derivative = 0, 0
    for z, weight in zip(centre + radius * np.exp(1j * angles), radius * np.exp(1j * angles) / 64, strict=True):
        resolvent = np.linalg.inv(z * mass - stiffness)
        projector = projector + weight * resolvent
        derivative = derivative + weight * resolvent @ (d_stiffness - z * d_mass) @ resolvent
    return np.real(projector), np.real(derivative)


def along(stiffness, mass, d_stiffness, d_mass, function):
    def moved(x):
        return function(*generalised_eigh(stiffness + x * d_stiffness, mass + x * d_mass))

    return moved


def test_the_ring_has_repeated_eigenvalues_and_jax_fails_on_it():
    stiffness, mass, *_ = ring()
    values, _ = generalised_eigh(stiffness, mass)
    assert np.array_equal(np.asarray(repeated(values)).sum(axis=0), [1, 2, 2, 2, 2])
    # What the own derivative is for: JAX's divides by the gap, which is zero or mere rounding.
    turn = jnp.roll(jnp.eye(3), 1, axis=0)
    raw = jax.jacfwd(lambda x: jnp.linalg.eigh(jnp.eye(3) + x * (turn + turn.T))[1])(0.0)
    assert not np.all(np.isfinite(raw))
    own = jax.jacfwd(lambda x: generalised_eigh(jnp.eye(3) + x * (turn + turn.T), jnp.eye(3))[1])(0.0)
    assert np.all(np.isfinite(own))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("pair", [(1, 2), (3, 4)])
def test_projector_on_a_repeated_pair(seed, pair):
    system = ring(seed)
    values, _ = generalised_eigh(*system[:2])

    def projector(values, vectors):
        return vectors[:, pair[0] : pair[1] + 1] @ vectors[:, pair[0] : pair[1] + 1].T

    moved = jax.jit(along(*system, projector))
    expected, derivative = contour(*map(np.asarray, system), float(values[pair[0]]), 0.5e6)
    assert np.allclose(moved(0.0), expected, rtol=1e-9, atol=1e-10)
    scale = np.max(np.abs(derivative))
    assert np.allclose(jax.jacfwd(moved)(0.0), derivative, atol=1e-9 * scale)
    assert np.allclose(jax.jacrev(moved)(0.0), derivative, atol=1e-9 * scale)
    assert np.allclose((moved(1e-5) - moved(-1e-5)) / 2e-5, derivative, atol=1e-6 * scale)


@pytest.mark.parametrize("pair", [(1, 2), (3, 4)])
def test_mean_of_a_repeated_pair(pair):
    def mean(values, vectors):
        return values[pair[0]] + values[pair[1]]

    moved = jax.jit(along(*ring(), mean))
    assert np.isclose(jax.jacfwd(moved)(0.0), (moved(1e-5) - moved(-1e-5)) / 2e-5, rtol=1e-5)
    second = (moved(1e-4) - 2 * moved(0.0) + moved(-1e-4)) / 1e-8
    assert np.isclose(jax.jacfwd(jax.jacfwd(moved))(0.0), second, rtol=1e-3)


def test_distinct_mode_beside_repeated_ones():
    """Its vector's gradient is NaN in JAX, too."""

    def rigid(values, vectors):
        return vectors[:, 0]

    moved = jax.jit(along(*ring(), rigid))
    slope = jax.jacfwd(moved)(0.0)
    assert np.allclose(slope, (moved(1e-5) - moved(-1e-5)) / 2e-5, rtol=1e-6, atol=1e-8)


@pytest.fixture(scope="module")
def crossing():
    """An axis with hardly any lead, so that torsion and travel do not meet, whose second and third mode cross."""
    axis = eqx.tree_at(lambda a: (a.lead, a.slide_mass), mauro_axis(), (jnp.asarray(1e-13), jnp.asarray(5.0)))

    @jax.jit
    def difference(distance):
        """Eigenvalue of the first elastic mode of torsion less that of the first of travel."""
        found = modes(axis.second_order(distance))
        twisting = jnp.sum(found.shapes[:3] ** 2 * jnp.diag(found.mass)[:3, None], axis=0)
        first = jnp.where(twisting > 0.5, found.eigenvalues, jnp.inf).at[0].set(jnp.inf)
        return jnp.min(first) - jnp.min(jnp.where(twisting < 0.5, found.eigenvalues, jnp.inf))

    low, high = 0.2, 1.4
    assert difference(low) * difference(high) < 0
    rising = difference(high) > 0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if (difference(middle) > 0) == rising else (middle, high)
    return axis, 0.5 * (low + high)


def test_crossing_along_the_stroke(crossing):
    axis, at = crossing

    @jax.jit
    def pair(distance):
        found = modes(axis.second_order(distance))
        shapes = found.shapes[:, 1:3]
        return found.frequency[1] ** 2 + found.frequency[2] ** 2, shapes @ shapes.T

    found = modes(axis.second_order(at))
    assert np.array_equal(np.asarray(repeated(found.eigenvalues)).sum(axis=0), [1, 2, 2, 1, 1, 1])
    slopes, h = jax.jit(jax.jacfwd(pair))(at), 1e-5
    differences = [(a - b) / (2 * h) for a, b in zip(pair(at + h), pair(at - h), strict=True)]
    assert np.isclose(slopes[0], differences[0], rtol=1e-6)
    # The torsion's and the travel's shapes themselves move with the nut.
    scale = np.sqrt(np.outer(np.diag(found.mass), np.diag(found.mass)))
    assert np.max(np.abs(scale * slopes[1])) > 0.01
    assert np.allclose(scale * slopes[1], scale * differences[1], atol=1e-6)
    for derivative in jax.tree.leaves(jax.jit(jax.jacfwd(lambda d: modes(axis.second_order(d))))(at)):
        assert np.all(np.isfinite(derivative))


def test_elasticities_at_a_crossing(crossing):
    """Those of the pair mix, but their mean over both modes is that of the sum of the eigenvalues."""
    axis, at = crossing
    found = screw_elasticities(axis, ("springs.support", "springs.screw.torsional_rigidity"), nut_position=at)
    assert np.all(np.isfinite(found.values))
    beside = [
        screw_elasticities(axis, found.paths, nut_position=at + step).values[1:3].sum(axis=0) for step in (-1e-4, 1e-4)
    ]
    assert np.allclose(found.values[1:3].sum(axis=0), 0.5 * (beside[0] + beside[1]), atol=1e-6)


def test_tracked_modes_pass_through_a_crossing(crossing):
    """Sorted frequencies have a kink there; tracked ones are smooth, and so are their derivatives."""
    axis, at = crossing
    distances = at + np.linspace(-0.03, 0.03, 6)
    reference = modes(axis.second_order(distances[0]))

    def tracked(distance):
        return track(modes(axis.second_order(distance)), reference).frequency[:3]

    found = jax.jit(jax.vmap(tracked))(distances)
    slopes = jax.jit(jax.vmap(jax.jacfwd(tracked)))(distances)
    ordered = np.sort(found, axis=1)
    assert not np.array_equal(ordered, found)
    for mode in (1, 2):
        bend = np.diff(found[:, mode], 2)
        assert np.max(np.abs(bend)) < 0.05 * np.max(np.abs(np.diff(found[:, mode])))
        middle = (found[2:, mode] - found[:-2, mode]) / (distances[2:] - distances[:-2])
        assert np.allclose(slopes[1:-1, mode], middle, rtol=1e-2)
