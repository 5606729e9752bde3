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


def test_single_precision_is_refused():
    with jax.enable_x64(False), pytest.raises(InputError, match="jax_enable_x64"):
        quiet(functions.quadratic, SAMPLES)


def test_single_precision_samples_are_computed_in_double():
    found = quiet(lambda x: x + 1e-9, np.ones(3, dtype=np.float32))
    np.testing.assert_array_equal(found.value, 1 + 1e-9)


def test_names_that_come_twice_are_refused():
    with pytest.raises(InputError, match=r"two outputs called 'a\.b'"):
        quiet(lambda x: {"a": {"b": x}, "a.b": 2 * x}, np.ones(3))
    with pytest.raises(InputError, match=r"called 'a\.b'"):
        quiet(lambda s: s["a.b"], {"a": {"b": np.ones(3)}, "a.b": np.ones(3)})


def test_decisions_on_values_are_explained():
    with pytest.raises(jax.errors.ConcretizationTypeError) as caught:
        quiet(lambda x: x if x > 0 else -x, np.ones(3))
    assert any("jnp.where" in note for note in caught.value.__notes__)
