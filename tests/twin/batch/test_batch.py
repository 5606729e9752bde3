"""One function at many samples: known answers, what changes nothing, marked samples, input that cannot be used."""

import functools
import types

import batch_functions as functions
import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._batch_kernel import of_one
from twin._batch_plan import automatic_width, traits
from twin._checks import InputError
from twin.batch import _check, batched
from twin.batch_result import DONE, NOT_FINITE, RAISED, SAMPLE_IS_NAN

RNG = np.random.default_rng(1)
SAMPLES = RNG.random((500, 3)) * 0.99


def quiet(fn, samples, **options):
    return batched(fn, samples, progress=False, **options)


def test_outputs_by_name_in_the_order_of_the_samples():
    found = quiet(functions.quadratic, SAMPLES)
    assert list(found.outputs) == ["sum", "double"]  # the order in which the function names them
    np.testing.assert_allclose(found["sum"], 2 * (SAMPLES**2).sum(axis=1), rtol=1e-14)
    np.testing.assert_array_equal(found["double"], 2 * SAMPLES)
    assert found.success.all()
    assert found.message == "500 of 500 samples computed."
    assert np.all(found.seconds > 0)


@settings(deadline=None, max_examples=15)
@given(count=st.integers(1, 300), size=st.integers(1, 320), hard=st.booleans())
def test_chunk_size_and_order_change_nothing(count, size, hard):
    samples = SAMPLES[:count]
    difficulty = samples[:, 0] if hard else None
    found = quiet(functions.quadratic, samples, chunk_size=size, difficulty=difficulty)
    np.testing.assert_allclose(found["sum"], 2 * (samples**2).sum(axis=1), rtol=1e-14)
    np.testing.assert_array_equal(found["double"], 2 * samples)


@pytest.mark.parametrize(("adaptive", "rtol"), [(False, 1e-12), (True, 1e-5)])
def test_simulations_in_any_chunks(adaptive, rtol):
    samples = {"mass": RNG.uniform(20.0, 200.0, 70), "viscous": RNG.uniform(20.0, 2000.0, 70)}
    move = functions.move(adaptive)
    whole = quiet(move, samples, chunk_size=70)
    for options in ({"chunk_size": 8}, {"chunk_size": 16, "difficulty": samples["viscous"] / samples["mass"]}):
        found = quiet(move, samples, **options)
        for name in ("position", "highest"):
            np.testing.assert_allclose(found[name], whole[name], rtol=rtol, atol=rtol * np.abs(whole[name]).max())


def test_the_same_call_gives_the_same_bits():
    digests = {quiet(functions.counted, SAMPLES, chunk_size=32).digest for _ in range(3)}
    assert len(digests) == 1
    changed = SAMPLES.copy()
    changed[-1, 2] += 1e-9
    assert quiet(functions.counted, changed, chunk_size=32).digest not in digests


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


def test_plain_functions_are_called_one_by_one():
    def plain(sample):
        if sample["a"] > 0.9:
            raise ValueError("too much")
        return {"twice": 2 * float(sample["a"]), "word": len(str(int(10 * sample["a"])))}

    found = quiet(plain, {"a": np.linspace(0, 1, 11)}, mode="loop")
    assert list(found.messages.values()) == ["ValueError: too much"]
    assert np.isnan(found["twice"][10])
    np.testing.assert_allclose(found["twice"][:10], 2 * np.linspace(0, 0.9, 10))


def test_a_function_of_whole_chunks():
    widths = []

    def whole(rows):
        widths.append(len(rows))
        return rows.sum(axis=1)

    np.testing.assert_allclose(quiet(whole, SAMPLES, mode="chunk", chunk_size=64).value, SAMPLES.sum(axis=1))
    assert set(widths) == {64}  # the last is filled up


def test_modules_and_partial_functions_compile_once():
    count = 0

    def scaled(x, *, factor):
        nonlocal count
        count += 1
        return factor * x[0]

    for factor in (1.0, 2.0, 3.0):
        found = quiet(functools.partial(scaled, factor=jnp.asarray(factor)), SAMPLES)
        np.testing.assert_allclose(found.value, factor * SAMPLES[:, 0])
        found = quiet(functions.Line(jnp.asarray(factor)), SAMPLES)
        np.testing.assert_allclose(found.value, factor * SAMPLES[:, 0])
    assert count <= 3  # one look at the program, one compilation


def test_tables_and_structures_are_samples():
    table = pd.DataFrame({"mass": [1.0, 2.0], "viscous": [3.0, 4.0]})
    found = quiet(lambda row: row["mass"] * row["viscous"], table)
    np.testing.assert_array_equal(found.value, [3.0, 8.0])
    assert {"mass", "viscous", "value", "status", "seconds"} == set(found.to_dataframe().columns)
    line = functions.Line(jnp.array([1.0, 2.0]))
    np.testing.assert_array_equal(quiet(lambda row: row(jnp.ones(3)), line).value, [1.0, 2.0])


def test_width_follows_the_program_and_not_the_clock():
    row = SAMPLES[0]
    plain, looped = traits(of_one, functions.quadratic, row), traits(of_one, functions.counted, row)
    assert not plain.loops
    assert looped.loops
    assert automatic_width(100_000, looped) == 256
    assert automatic_width(100_000, plain) == 4096
    assert automatic_width(5, plain) == 8
    large = traits(of_one, lambda x: jnp.sum(jnp.outer(jnp.ones(2000) * x[0], jnp.ones(2000))), row)
    assert automatic_width(100_000, large) == 2
    assert traits(of_one, lambda x: jnp.linalg.eigh(jnp.outer(x, x))[0], row).lapack


def test_results_show_themselves():
    found = quiet(functions.quadratic, SAMPLES)
    assert "500 of 500 samples computed." in repr(found)
    assert "<table" in found._repr_html_()
    with pytest.raises(InputError, match="has no output 'value'; it has sum, double"):
        _ = found.value


@pytest.mark.parametrize(
    ("fn", "samples", "options", "told"),
    [
        (functions.quadratic, {"a": np.ones(3), "b": np.ones(4)}, {}, r"unequal length: samples\['a'\] has 3"),
        (functions.quadratic, np.ones((0, 3)), {}, "There are no samples"),
        (functions.quadratic, {"a": np.array(["x"])}, {}, "numbers were expected"),
        (functions.quadratic, {"a": 1.0}, {}, "single number"),
        (functions.quadratic, SAMPLES, {"chunk_size": 0}, "chunk_size must be"),
        (functions.quadratic, SAMPLES, {"chunk_size": "large"}, "chunk_size must be"),
        (functions.quadratic, SAMPLES, {"mode": "pmap"}, "mode must be one of"),
        (functions.quadratic, SAMPLES, {"difficulty": np.ones(3)}, "difficulty must be one number"),
        (lambda x: None, SAMPLES, {}, "returned nothing"),
    ],
)
def test_input_that_cannot_be_used(fn, samples, options, told):
    with pytest.raises(InputError, match=told):
        quiet(fn, samples, **options)


def test_things_that_are_no_function_and_no_executor():
    with pytest.raises(InputError, match="fn must be a function"):
        _check(3.0, "auto", None, "vmap", None)
    with pytest.raises(InputError, match="retry must be a function"):
        _check(len, "auto", None, "vmap", 3)
    with pytest.raises(InputError, match=r"no submit\(\)"):
        _check(len, "auto", 2, "vmap", None)
    with pytest.raises(InputError, match=r"client.get_executor\(\)"):
        _check(len, "auto", types.SimpleNamespace(get_executor=None), "vmap", None)


def test_a_function_that_always_raises_is_given_up():
    def wrong(x):
        raise KeyError("stiffnes")

    with pytest.raises(InputError, match=r"None of the first 20 samples.*stiffnes"):
        quiet(wrong, SAMPLES, mode="loop")
    with pytest.raises(KeyError):  # what cannot even be traced is no matter of samples
        quiet(wrong, SAMPLES)


def test_single_precision_is_refused():
    with jax.enable_x64(False), pytest.raises(InputError, match="jax_enable_x64"):
        quiet(functions.quadratic, SAMPLES)


def test_single_precision_samples_are_computed_in_double():
    found = quiet(lambda x: x + 1e-9, np.ones(3, dtype=np.float32))
    np.testing.assert_array_equal(found.value, 1 + 1e-9)


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


def test_names_that_come_twice_are_refused():
    with pytest.raises(InputError, match=r"two outputs called 'a\.b'"):
        quiet(lambda x: {"a": {"b": x}, "a.b": 2 * x}, np.ones(3))
    with pytest.raises(InputError, match=r"called 'a\.b'"):
        quiet(lambda s: s["a.b"], {"a": {"b": np.ones(3)}, "a.b": np.ones(3)})


@pytest.mark.parametrize("size", [1, 2, 6])
def test_failed_samples_are_nan_in_any_chunks(size):
    def mixed(x):
        if x == 1:
            raise ValueError("no")
        return 1 if x < 4 else 1.5

    found = quiet(mixed, np.arange(6.0), mode="loop", chunk_size=size)
    np.testing.assert_array_equal(found.value, [1, np.nan, 1, 1, 1.5, 1.5])


def test_decisions_on_values_are_explained():
    with pytest.raises(jax.errors.ConcretizationTypeError) as caught:
        quiet(lambda x: x if x > 0 else -x, np.ones(3))
    assert any("jnp.where" in note for note in caught.value.__notes__)
