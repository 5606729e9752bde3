"""Samples that fail: marked, found one by one, tried again, and none of the others harmed."""

import batch_functions as functions
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.batch import batched
from twin.batch_result import DONE, NOT_FINITE, RAISED, SAMPLE_IS_NAN

RNG = np.random.default_rng(1)
SAMPLES = RNG.random((500, 3)) * 0.99


def quiet(fn, samples, **options):
    return batched(fn, samples, progress=False, **options)


def test_failed_samples_are_marked_and_the_others_unchanged():
    samples = SAMPLES.copy()
    samples[7, 1] = np.nan  # no sample
    samples[100, 0] = 0.9995  # raises
    samples[300, 2] = -1.0  # has no logarithm
    found = quiet(functions.refuses_high, samples, chunk_size=64)
    assert {int(n): int(found.status[n]) for n in np.flatnonzero(found.status != DONE)} == {
        7: SAMPLE_IS_NAN,
        100: RAISED,
        300: NOT_FINITE,
    }
    assert found.messages == {100: "EquinoxRuntimeError: too high"}
    good = found.success
    np.testing.assert_array_equal(found.value[good], quiet(functions.refuses_high, SAMPLES, chunk_size=64).value[good])
    assert np.isnan(found.value[~good]).all()
    assert found.message.startswith("497 of 500 samples computed; 1 have an output that is NaN")
    assert found.to_dataframe()["status"][100] == "raised"
    assert "samples.2" in found.to_dataframe()


@settings(deadline=None, max_examples=25)
@given(high=st.lists(st.integers(0, 99), max_size=100, unique=True), size=st.sampled_from([8, 32, 100]))
def test_any_samples_may_raise(high, size):
    samples = SAMPLES[:100].copy()
    samples[high, 0] = 0.9995
    if len(high) >= 20:
        samples = np.concatenate([SAMPLES[100:200], samples])  # at first some that do not
        high = [n + 100 for n in high]
    found = quiet(functions.refuses_high, samples, chunk_size=size)
    assert set(found.messages) == set(high) == set(np.flatnonzero(found.status == RAISED).tolist())
    good = found.success
    np.testing.assert_allclose(found.value[good], np.log(samples[good]).sum(axis=1), rtol=1e-13)


def test_one_sample_that_raises_costs_few_tries():
    tries = 0

    def whole(rows):
        nonlocal tries
        tries += 1
        if (rows[:, 0] > 0.999).any():
            raise RuntimeError("too high")
        return rows[:, 0]

    samples = SAMPLES[:256].copy()
    samples[77, 0] = 0.9995
    found = quiet(whole, samples, mode="chunk", chunk_size=256)
    assert list(found.messages) == [77]
    assert tries <= 11


def test_infinity_is_a_sample():
    found = quiet(lambda x: 1.0 / x, np.array([1.0, np.inf, np.nan]))
    np.testing.assert_array_equal(found.value, [1.0, 0.0, np.nan])


def test_all_samples_nan():
    found = quiet(functions.quadratic, np.full((4, 3), np.nan))
    assert np.all(found.status == SAMPLE_IS_NAN)
    assert not found.outputs


def test_a_second_try_for_those_that_were_not_finite():
    def first(x):
        return jnp.where(x[0] > 0.5, jnp.nan, x[0])

    found = quiet(first, SAMPLES, chunk_size=32, retry=lambda x: 10 * x[0])
    high = SAMPLES[:, 0] > 0.5
    np.testing.assert_allclose(found.value, np.where(high, 10, 1) * SAMPLES[:, 0], rtol=1e-15)
    assert found.success.all()


def test_a_function_that_always_raises_is_given_up():
    def wrong(x):
        raise KeyError("stiffnes")

    with pytest.raises(InputError, match=r"None of the first 20 samples.*stiffnes"):
        quiet(wrong, SAMPLES, mode="loop")
    with pytest.raises(KeyError):  # what cannot even be traced is no matter of samples
        quiet(wrong, SAMPLES)


def test_an_error_that_passes_marks_no_sample():
    calls = 0

    def flaky(rows):
        nonlocal calls
        calls += 1
        if calls == 1:
            raise RuntimeError("the device was busy")
        return rows[:, 0]

    found = quiet(flaky, SAMPLES[:8], mode="chunk", chunk_size=8)
    assert found.success.all()


def test_any_error_of_plain_code_marks_its_sample():
    def whole(rows):
        if (rows[:, 0] > 0.999).any():
            raise np.linalg.LinAlgError("singular")
        return rows[:, 0]

    samples = SAMPLES[:8].copy()
    samples[3, 0] = 0.9995
    assert quiet(whole, samples, mode="chunk", chunk_size=8).messages == {3: "LinAlgError: singular"}


def test_what_always_raises_is_given_up_beside_samples_that_are_nan_and_leaves_nothing(tmp_path):
    allowed = tmp_path / "allowed"

    def wants(x):
        return len(allowed.read_text()) * float(x)

    samples = np.r_[np.nan, np.arange(50.0)]
    for _ in range(2):
        with pytest.raises(InputError, match=r"None of the first 20 samples.*FileNotFoundError"):
            quiet(wants, samples, mode="loop", store=tmp_path / "study")
    allowed.write_text("ab")
    found = quiet(wants, samples, mode="loop", store=tmp_path / "study")
    np.testing.assert_array_equal(found.value[1:], 2 * np.arange(50.0))


@pytest.mark.parametrize("size", [1, 2, 6])
def test_failed_samples_are_nan_in_any_chunks(size):
    def mixed(x):
        if x == 1:
            raise ValueError("no")
        return 1 if x < 4 else 1.5

    found = quiet(mixed, np.arange(6.0), mode="loop", chunk_size=size)
    np.testing.assert_array_equal(found.value, [1, np.nan, 1, 1, 1.5, 1.5])
