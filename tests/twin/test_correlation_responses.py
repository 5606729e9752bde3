"""FRAC and CSF: closed forms, loops in plain NumPy, properties, bad input."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.correlation import csf, frac
from twin.frf import FRF

frac_, csf_ = jax.jit(frac, static_argnames="axis"), jax.jit(csf, static_argnames="axis")
F = jnp.linspace(1.0, 50.0, 11)


def responses(seed, size=(3, 2, 11)):
    rng = np.random.default_rng(seed)
    return 1e-8 * (rng.standard_normal(size) + 1j * rng.standard_normal(size))


def by_loops(one, other):
    """FRAC and CSF of two sequences."""
    cross, own, own_ref = 0j, 0.0, 0.0
    for a, b in zip(one, other, strict=True):
        cross += np.conj(a) * b
        own += abs(a) ** 2
        own_ref += abs(b) ** 2
    return abs(cross) ** 2 / (own * own_ref), 2 * abs(cross) / (own + own_ref)


def test_loops_in_numpy():
    one, other = responses(0), responses(1)
    for axis in (-1, 0, (0, 1)):
        found = frac_(one, other, axis=axis), csf_(one, other, axis=axis)
        kept = [i for i in range(3) if i not in {a % 3 for a in np.atleast_1d(axis)}]
        for index in np.ndindex(found[0].shape):
            picked = [slice(None)] * 3
            for i, j in zip(kept, index, strict=True):
                picked[i] = j
            expected = by_loops(one[tuple(picked)].ravel(), other[tuple(picked)].ravel())
            assert np.isclose(found[0][index], expected[0], rtol=1e-12)
            assert np.isclose(found[1][index], expected[1], rtol=1e-12)


def test_closed_forms():
    one = responses(2)
    assert np.allclose(frac(one, 3j * one), 1.0, atol=1e-14)
    assert np.allclose(csf(one, one), 1.0, atol=1e-14)
    for a in (0.01, 0.5, 2.0):
        assert np.allclose(csf(one, a * one), 2 * a / (1 + a**2), rtol=1e-13)
    # One line only: the course tells nothing, the size everything.
    assert np.allclose(frac(one, responses(3), axis=()), 1.0, atol=1e-14)


def test_zero_responses():
    one = responses(4)
    nothing = one.copy()
    nothing[1] = 0.0
    assert np.all(np.isnan(frac_(one, nothing)[1]))
    assert np.all(csf_(one, nothing)[1] == 0.0)
    assert np.all(np.isnan(csf_(nothing, nothing)[1]))
    slope = jax.jit(
        jax.grad(lambda a: csf((1 + a) * nothing, nothing)[0].sum() + frac(one, (1 + a) * nothing)[0].sum())
    )
    assert np.isfinite(slope(0.3))


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 10**6), st.floats(-150, 150), st.floats(-1, 1), st.floats(-4, 4))
def test_between_0_and_1_symmetric_and_csf_below_the_root_of_frac(seed, decades, ratio, phase):
    one = responses(seed) * 10.0**decades
    other = one * 10.0**ratio * np.exp(1j * phase) + 0.3 * responses(seed + 1) * 10.0**decades
    course, size = frac_(one, other), csf_(one, other)
    assert np.all((course >= 0) & (course <= 1 + 1e-13) & (size >= 0))
    assert np.all(size <= np.sqrt(course) + 1e-13)
    assert np.allclose(course, frac_(other, one), rtol=1e-12)
    assert np.allclose(size, csf_(other, one), rtol=1e-12)
    assert np.allclose(course, frac_(-5j * one, other), rtol=1e-12)


def test_responses_are_matched_by_name():
    one, other = responses(5), responses(6)
    measured = FRF(F, jnp.asarray(other[[2, 0]]), ("c", "a"), ("x", "y"))
    simulated = FRF(F, jnp.asarray(one), ("a", "b", "c"), ("x", "y"))
    assert np.allclose(frac(simulated, measured), frac(one[[2, 0]], other[[2, 0]]))
    assert np.allclose(csf(simulated, measured), csf(one[[2, 0]], other[[2, 0]]))


def test_bad_input():
    one = responses(7)
    simulated = FRF(F, jnp.asarray(one), ("a", "b", "c"), ("x", "y"))
    with pytest.raises(InputError, match="no output 'd' of the reference"):
        frac(simulated, FRF(F, jnp.asarray(one[:1]), ("d",), ("x", "y")))
    with pytest.raises(InputError, match="no input 'z' of the reference"):
        csf(simulated, FRF(F, jnp.asarray(one[:, :1]), ("a", "b", "c"), ("z",)))
    with pytest.raises(InputError, match="different frequencies"):
        csf(simulated, FRF(F + 0.5, jnp.asarray(one), ("a", "b", "c"), ("x", "y")))
    with pytest.raises(InputError, match="Compute both at the same"):
        frac(one, one[:2])
    with pytest.raises(InputError, match="response must be finite"):
        frac(np.nan * one, one)
    with pytest.raises(InputError, match="axis is 3"):
        frac(one, one, axis=3)
