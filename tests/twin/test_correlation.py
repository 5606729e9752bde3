"""MAC, MACXP, NFD, NDD: published cases, properties, loops in plain NumPy, bad input."""

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.correlation import eigenvalue, mac, macxp, ndd, ndd_squared, nfd

mac_, macxp_ = jax.jit(mac), jax.jit(macxp)


def mac_by_loops(one, other):
    top, left, right = 0j, 0.0, 0.0
    for x, y in zip(one, other, strict=True):
        top += np.conj(x) * y
        left += abs(x) ** 2
        right += abs(y) ** 2
    return abs(top) ** 2 / (left * right)


def macxp_by_loops(one, pole, other, pole_ref):
    """Eq. 4 as printed."""

    def product(x, y, conjugate):
        total = 0j
        for a, b in zip(x, y, strict=True):
            total += (np.conj(a) if conjugate else a) * b
        return abs(total)

    def own(x, s):
        return product(x, x, True) / (2 * abs(s.real)) + product(x, x, False) / (2 * abs(s))

    top = product(one, other, True) / abs(np.conj(pole) + pole_ref) + product(one, other, False) / abs(pole + pole_ref)
    return top**2 / (own(one, pole) * own(other, pole_ref))


def shapes(seed, kind, modes, rows=7):
    rng = np.random.default_rng(seed)
    real = rng.standard_normal((rows, modes))
    return real if kind == "real" else real + 1j * rng.standard_normal((rows, modes))


def poles(seed, modes):
    rng = np.random.default_rng(seed + 100)
    frequency, ratio = 10.0 * 1.05 ** np.arange(modes), rng.uniform(0.01, 0.3, modes)
    return 2 * np.pi * frequency * (-ratio + 1j * np.sqrt(1 - ratio**2))


@pytest.mark.parametrize("kind", ["real", "complex"])
@pytest.mark.parametrize("kind_ref", ["real", "complex"])
def test_loops_in_numpy(kind, kind_ref):
    one, other = shapes(0, kind, 4), shapes(1, kind_ref, 3)
    s, s_ref = poles(0, 4), poles(1, 3)
    found, found_x = mac_(one, other), macxp_(one, s, other, s_ref)
    by_pair = np.outer(s, [1.0, 1.1, 1.2])
    paired = macxp_(one, by_pair, other, s_ref)
    assert found.shape == found_x.shape == paired.shape == (4, 3)
    for i in range(4):
        for j in range(3):
            assert np.isclose(found[i, j], mac_by_loops(one[:, i], other[:, j]), rtol=1e-12, atol=1e-15)
            expected = macxp_by_loops(one[:, i], s[i], other[:, j], s_ref[j])
            assert np.isclose(found_x[i, j], expected, rtol=1e-12, atol=1e-15)
            expected = macxp_by_loops(one[:, i], by_pair[i, j], other[:, j], s_ref[j])
            assert np.isclose(paired[i, j], expected, rtol=1e-12, atol=1e-15)


@pytest.mark.slow
def test_single_shapes_drop_their_axis():
    one, other, s, s_ref = shapes(2, "complex", 4), shapes(3, "real", 3), poles(2, 4), poles(3, 3)
    full, full_x = mac(one, other), macxp(one, s, other, s_ref)
    assert np.isclose(mac(one[:, 1], other[:, 2]), full[1, 2], rtol=1e-13)
    assert mac(one[:, 1], other).shape == (3,)
    assert np.allclose(macxp(one[:, 1], s[1], other, s_ref), full_x[1], rtol=1e-13)
    assert np.allclose(macxp(one[:, 1], np.full(3, s[1]), other, s_ref), full_x[1], rtol=1e-13)
    assert np.allclose(macxp(one, s, other[:, 0], s_ref[0]), full_x[:, 0], rtol=1e-13)
    assert np.isclose(macxp(one[:, 3], s[3], other[:, 0], s_ref[0]), full_x[3, 0], rtol=1e-13)
    in_step = jax.vmap(mac, (1, 1))(one[:, :3], other)
    assert np.allclose(in_step, np.diag(full[:3]), rtol=1e-13)


def test_published_cases():
    """Allemang and Brown: 1 for shapes that differ by a complex factor, 0 for orthogonal ones, 1/2 for x and x + y."""
    x, y = np.array([1.0, 0.0, 1.0]), np.array([1.0, 0.0, -1.0])
    assert np.isclose(mac(x, x), 1.0, atol=1e-15)
    assert mac(x, y) < 1e-30
    assert np.isclose(mac(x, x + y), 0.5, atol=1e-15)
    assert np.isclose(mac(x + 1j * y, -3.0 * np.exp(0.7j) * (x + 1j * y)), 1.0, atol=1e-15)
    # Travelling waves in opposite directions are conjugates: not alike.
    assert np.isclose(mac(x + 1j * y, x - 1j * y), 0.0, atol=1e-15)


def test_macxp_halves_at_twice_the_damping_ratio():
    """The same real shape, little damping: 1/(1 + (Δω/2ζω)²) to first order."""
    shape, zeta = np.array([1.0, -2.0, 0.5]), 1e-3
    reference = eigenvalue(100.0, zeta)
    for share in (0.5, 1.0, 3.0):
        found = macxp(shape, eigenvalue(100.0 * (1 + 2 * zeta * share), zeta), shape, reference)
        assert np.isclose(found, 1 / (1 + share**2), rtol=0.01)


def test_macxp_is_the_cosine_of_free_decays():
    """By quadrature of φ·e^(λt), real parts, over all phases of both."""
    one, other, s, s_ref = shapes(5, "complex", 1)[:, 0], shapes(6, "complex", 1)[:, 0], *poles(7, 2)
    other = one + 0.3 * other
    time, step = np.linspace(0.0, 15 / abs(s.real), 200001, retstep=True)
    decays = [p[:, None] * np.exp(q * time) for p, q in ((one, s), (other, s_ref))]
    phases = np.exp(1j * np.linspace(0, np.pi, 48, endpoint=False))

    def inner(a, b):
        hermitian, plain = step * np.sum(np.conj(a) * b), step * np.sum(a * b)
        left, right = phases[:, None], phases[None, :]
        return 0.5 * np.real(np.conj(left) * right * hermitian + left * right * plain)

    cross = np.max(inner(*decays) ** 2)
    largest = [np.max(inner(d, d).diagonal()) for d in decays]
    assert np.isclose(macxp(one, s, other, s_ref), cross / (largest[0] * largest[1]), rtol=5e-3)


scale = st.builds(lambda r, a: 10.0**r * np.exp(1j * a), st.floats(-100, 100), st.floats(-4, 4))


@settings(deadline=None, max_examples=80)
@given(st.integers(0, 10**6), st.sampled_from(["real", "complex"]), scale, scale, st.floats(1e-4, 0.99))
def test_between_0_and_1_symmetric_and_without_scale(seed, kind, left, right, ratio):
    one, other = shapes(seed, kind, 3, 5), shapes(seed + 1, kind, 3, 5)
    if kind == "real":
        left, right = abs(left), -abs(right)
    other[:, 0] = one[:, 0] + 1e-3 * other[:, 0]
    s, s_ref = poles(seed, 3), eigenvalue(np.array([10.0, 10.0, 11.0]), np.full(3, ratio))
    for found, exchanged, scaled in (
        (mac_(one, other), mac_(other, one), mac_(left * one, right * other)),
        (macxp_(one, s, other, s_ref), macxp_(other, s_ref, one, s), macxp_(left * one, s, right * other, s_ref)),
    ):
        assert np.all((found >= 0) & (found <= 1 + 1e-13))
        assert np.allclose(found, exchanged.T, rtol=1e-12, atol=1e-14)
        assert np.allclose(found, scaled, rtol=1e-11, atol=1e-13)
    assert np.allclose(np.diag(mac_(one, one)), 1.0, atol=1e-14)
    assert np.allclose(np.diag(macxp_(one, s, one, s)), 1.0, atol=1e-13)


def test_a_zero_shape_is_marked_and_leaves_the_others_alone():
    one, other = shapes(8, "complex", 3), shapes(9, "complex", 3)
    s = poles(8, 3)
    expected, slope = macxp_(one, s, other, s)[::2], jax.grad(lambda a: macxp_(a, s, other, s)[0, 0])(one)
    one[:, 1] = 0.0
    for found in (mac_(one, other), macxp_(one, s, other, s)):
        assert np.all(np.isnan(found[1]))
        assert np.all(np.isfinite(found[::2]))
    assert np.array_equal(macxp_(one, s, other, s)[::2], expected)
    found = jax.grad(lambda a: macxp_(a, s, other, s)[0, 0])(one)
    assert np.allclose(found, slope, rtol=1e-12, atol=1e-15)


def test_differences():
    assert np.allclose(nfd(np.array([110.0, 90.0]), np.array([100.0, 100.0])), [0.1, -0.1])
    assert np.allclose(ndd(np.array([0.02, 0.005]), np.array([0.01, 0.01])), [1.0, -0.5])
    assert np.allclose(ndd_squared(np.array([0.02, 0.005]), np.array([0.01, 0.01])), [1.0, 0.25])
    pairs = nfd(np.array([10.0, 20.0, 30.0])[:, None], np.array([10.0, 0.0]))
    assert pairs.shape == (3, 2)
    assert np.all(np.isnan(pairs[:, 1]))
    assert np.allclose(pairs[:, 0], [0.0, 1.0, 2.0])


def test_eigenvalue():
    s = eigenvalue(np.array([0.0, 50.0]), np.array([0.1, 0.02]))
    assert s[0] == 0.0
    assert np.isclose(abs(s[1]), 100 * np.pi, rtol=1e-15)
    assert np.isclose(-s[1].real / abs(s[1]), 0.02, rtol=1e-14)
    assert np.isnan(jax.jit(eigenvalue)(50.0, 1.2))


def test_bad_input():
    one, s = shapes(0, "real", 2), poles(0, 2)
    with pytest.raises(InputError, match="shapes have 7 rows, but the reference has 6"):
        mac(one, one[:6])
    with pytest.raises(InputError, match="shapes must be finite"):
        mac(np.full((7, 2), np.nan), one)
    with pytest.raises(InputError, match="reference must be one shape"):
        mac(one, np.ones((7, 2, 2)))
    with pytest.raises(InputError, match="eigenvalues must have negative real parts"):
        macxp(one, 1j * np.imag(s), one, s)
    with pytest.raises(InputError, match="Give one eigenvalue for each mode"):
        macxp(one, s[:1], one, s)
    with pytest.raises(InputError, match="reference_eigenvalues must be finite"):
        macxp(one, s, one, np.nan * s)
    with pytest.raises(InputError, match="Pair the modes first"):
        nfd(np.ones(3), np.ones(2))
    with pytest.raises(InputError, match="reference must be finite"):
        ndd(np.ones(2), np.array([1.0, np.nan]))
    with pytest.raises(InputError, match="damping_ratio must be below 1"):
        eigenvalue(10.0, 1.0)
    assert np.all(np.isnan(macxp_(one, 1j * np.imag(s), one, s)))
