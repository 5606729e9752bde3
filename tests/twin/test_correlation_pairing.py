"""Pairing of modes by MACXP: exchanged, missing, too many, alike, rigid and unstable modes; bad input."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.correlation import assign, macxp_of_modes, pair_modes
from twin.linear import SecondOrder
from twin.modal import ReferenceModes, damped_modes, modes, reference_modes

N = 6
NAMES = tuple("abcdef")


def chain(stiffness=None, *, ground=1.0, damping=4e-3, mass=None):
    """Masses in a row, the first one held to the ground, with material damping."""
    k = 1e4 * (np.linspace(1.0, 2.0, N - 1) if stiffness is None else jnp.asarray(stiffness))
    ends = np.eye(N)[:, :-1] - np.eye(N)[:, 1:]
    matrix = jnp.asarray(ends) @ jnp.diag(jnp.asarray(k)) @ ends.T + 1e4 * ground * np.diag(np.eye(N)[0])
    masses = jnp.diag(jnp.asarray(np.linspace(1.0, 1.4, N) if mass is None else mass))
    return SecondOrder(masses, 1e-3 * masses, damping * matrix, matrix, np.eye(N), np.eye(N), NAMES, NAMES)


pair_ = jax.jit(pair_modes, static_argnames=("outputs", "damping", "threshold"))


def test_exchanged_and_missing_modes():
    found = modes(chain())
    order = (4, 0, 5, 2)
    reference = reference_modes(found, outputs=("f", "a", "c", "d"), indices=order)
    pairs = pair_(found, reference)
    assert np.array_equal(pairs.order, order)
    assert np.all(pairs.paired)
    assert np.allclose(pairs.value, 1.0, atol=1e-12)
    assert np.array_equal(pairs.take(found.frequency), reference.frequency)
    assert pairs.take(found.shapes).shape == (N, 4)


def test_a_mode_that_cannot_be_paired_is_marked():
    found = modes(chain())
    strange = reference_modes(found, indices=(1, 2, 3))
    strange = ReferenceModes(
        strange.frequency.at[1].set(150.0), strange.damping_ratio, strange.output_shapes, strange.outputs
    )
    pairs = pair_(found, strange)
    assert np.array_equal(pairs.order, [1, -1, 3])
    assert np.array_equal(pairs.paired, [True, False, True])
    assert pairs.value[1] < 0.3
    assert np.array_equal(np.isnan(pairs.take(found.frequency)), ~pairs.paired)


def test_fewer_modes_than_references():
    reference = modes(chain())
    found = reference_modes(reference, indices=(3, 1))
    pairs = pair_(found, reference)
    assert np.array_equal(pairs.order, [-1, 1, -1, 0, -1, -1])
    assert np.all(pairs.value[~np.asarray(pairs.paired)] == 0.0)


def test_each_mode_is_given_away_once_best_first():
    alike = np.array([[0.9, 0.8], [0.1, 0.5]])
    assert np.array_equal(assign(alike).order, [0, 1])
    assert np.array_equal(assign(alike, threshold=0.6).order, [0, -1])
    assert np.array_equal(assign(alike.T).order, [0, 1])
    marked = assign(np.array([[np.nan, np.nan], [np.nan, 0.7]]))
    assert np.array_equal(marked.order, [-1, 1])
    assert np.array_equal(marked.value, [0.0, 0.7])
    assert not np.any(assign(np.zeros((2, 2)), threshold=0.0).paired)


@pytest.mark.parametrize("size", [(7, 7), (4, 6), (6, 4)])
def test_pairs_are_those_of_one_after_the_other(size):
    """The plain loop: the largest entry left, its row and its column struck out."""
    rng = np.random.default_rng(4)
    batch = np.round(rng.random((60, *size)), 1)  # with ties
    found = jax.jit(jax.vmap(lambda a: assign(a, threshold=0.0)))(batch)
    for alike, pairs in zip(batch, found.order, strict=True):
        left, expected = alike.T.copy(), np.full(size[1], -1)
        for _ in range(min(size)):
            row, column = np.unravel_index(np.argmax(left), left.shape)
            expected[row] = column if left[row, column] > 0 else -1
            left[row], left[:, column] = -1.0, -1.0
        assert np.array_equal(pairs, expected)


def test_rigid_body_modes_are_marked_and_leave_derivatives_alone():
    def value(factor):
        found = modes(chain(np.linspace(1.0, 2.0, N - 1) * factor, ground=0.0))
        return pair_modes(found, reference).value

    reference = modes(chain(ground=0.0))
    pairs = pair_(reference, reference)
    assert np.array_equal(pairs.order, [-1, 1, 2, 3, 4, 5])
    # A damping of 0.002 lets no change of 10 % pass, and 0.1 % does not lose a mode.
    assert np.all(np.diff(jax.jit(value)(1.001)[1:]) < 1e-6)
    for slope in (jax.jit(jax.jacfwd(value))(1.001), jax.jit(jax.jacrev(value))(1.001)):
        assert np.all(np.isfinite(slope))
        assert slope[0] == 0.0
        assert np.all(slope[1:] < 0)


@pytest.mark.slow
def test_unstable_and_absent_modes_are_marked():
    found = modes(chain(np.array([1.0, 1.2, -0.1, 1.6, 2.0])))
    assert np.isnan(found.frequency[0])
    pairs = pair_(found, found)
    assert np.array_equal(pairs.paired, ~np.isnan(found.frequency))
    good = reference_modes(modes(chain()))

    def absent(frequency):
        return pair_modes(good, ReferenceModes(frequency, good.damping_ratio, good.output_shapes, good.outputs)).order

    batch = jnp.stack([good.frequency, good.frequency.at[2].set(jnp.nan)])
    assert np.array_equal(jax.vmap(absent)(batch), [[0, 1, 2, 3, 4, 5], [0, 1, -1, 3, 4, 5]])


@pytest.mark.slow
def test_complex_modes_with_their_own_damping():
    system = chain()
    system = SecondOrder(
        system.mass,
        jnp.diag(jnp.array([0.0, 30.0, 0.0, 0.0, 3.0, 20.0])),
        system.hysteretic,
        system.stiffness,
        system.input_map,
        system.output_map,
        NAMES,
        NAMES,
    )
    found = damped_modes(system)
    alike = macxp_of_modes(found, found, damping="own")
    assert np.allclose(np.diag(alike), 1.0, atol=1e-12)
    assert np.array_equal(pair_(found, found, damping="own").order, np.arange(N))
    # The damping ratio itself counts: 1 - ((ζ₁ - ζ₂)/(ζ₁ + ζ₂))² or so for the same shape and frequency.
    weaker = ReferenceModes(found.frequency, 0.5 * found.damping_ratio, found.output_shapes, NAMES)
    assert np.allclose(np.diag(macxp_of_modes(weaker, found, damping="own")), 8 / 9, atol=0.02)
    assert np.allclose(np.diag(macxp_of_modes(weaker, found)), 1.0, atol=1e-12)


def test_batches_are_the_single_ones():
    reference = modes(chain())
    rng = np.random.default_rng(0)
    factors = np.linspace(1.0, 2.0, N - 1) * rng.uniform(0.97, 1.03, (8, N - 1))

    def pairs(stiffness):
        return pair_modes(modes(chain(stiffness)), reference, outputs=("a", "c", "f"))

    batch = jax.jit(jax.vmap(pairs))(factors)
    single = jax.jit(pairs)
    for i, stiffness in enumerate(factors):
        assert np.array_equal(batch.order[i], single(stiffness).order)
        assert np.allclose(batch.value[i], single(stiffness).value, rtol=1e-9)


def test_bad_input():
    found = modes(chain())
    reference = reference_modes(found)
    with pytest.raises(InputError, match="The modes have no output 'g'"):
        pair_modes(found, reference, outputs=("a", "g"))
    with pytest.raises(InputError, match="outputs is empty"):
        pair_modes(found, reference, outputs=())
    with pytest.raises(InputError, match="There is no mode 6"):
        reference_modes(found, indices=(6,))
    with pytest.raises(InputError, match="reference has 6 modes that vibrate without damping"):
        pair_modes(found, ReferenceModes(found.frequency, np.zeros(N), found.shapes, NAMES))
    with pytest.raises(InputError, match="damping must be one of"):
        pair_modes(found, reference, damping="none")
    with pytest.raises(InputError, match="threshold must be between 0 and 1"):
        pair_modes(found, reference, threshold=30.0)
    with pytest.raises(InputError, match="6 frequencies go with 6 damping ratios"):
        ReferenceModes(found.frequency, found.damping_ratio, found.shapes[:4], NAMES)
    with pytest.raises(InputError, match="frequency must be finite"):
        ReferenceModes(np.full(N, np.nan), found.damping_ratio, found.shapes, NAMES)
    with pytest.raises(InputError, match="alike must be a matrix"):
        assign(np.ones(3))
    twice = ReferenceModes(found.frequency, found.damping_ratio, found.shapes, ("a",) * N)
    with pytest.raises(InputError, match="more than one output 'a'"):
        pair_modes(twice, reference, outputs=("a",))
