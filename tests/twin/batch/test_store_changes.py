"""A store goes on with the same study alone: every change is refused in words that name it, and nothing else is."""

import functools
import importlib
import sys

import equinox as eqx
import numpy as np
import pandas as pd
import pytest

from twin import _batch_facts
from twin._checks import InputError
from twin._fingerprint import function_parts
from twin.batch import batched

SOURCE = '''
"""A model of the user's own."""
import functools

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import changing_helpers

FACTOR = 2.0
TABLE = np.array([1.0, 2.0])


def helper(x):
    return x + 1


def fn(x):
    return FACTOR * helper(x["a"]) + TABLE[0] * changing_helpers.curve(x["b"])


def product(k, names=("a",)):
    return lambda x: k * x[names[0]]


closed = product(3.0)


class Law(eqx.Module):
    width: float = 1e-3
    shift = 0.25

    def force(self, x):
        return self.width * helper(x) + self.shift


class Model(eqx.Module):
    law: Law
    slope: jnp.ndarray

    def __call__(self, x):
        return self.slope[0] * self.law.force(x["a"])


def model(slope=1.0, **law):
    return Model(Law(**law), jnp.array([slope, 0.0]))


class Plain:
    def __init__(self, k):
        self.k = k

    def __call__(self, x):
        return self.k * x["a"]


def wrapped(factor):
    def around(f):
        @functools.wraps(f)
        def inner(x):
            return factor * f(x)

        return inner

    return around


@wrapped(2.0)
def doubled(x):
    return x["a"]
'''
HELPERS = "import jax.numpy as jnp\nPOWER = 2\n\n\ndef curve(x):\n    return jnp.sin(x) ** POWER\n"
SAMPLES = {"a": np.arange(4.0), "b": np.ones(4)}


@pytest.fixture
def load(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def loaded(old="", new="", helpers=HELPERS):
        (tmp_path / "changing_model.py").write_text(SOURCE.replace(old, new) if old else SOURCE)
        (tmp_path / "changing_helpers.py").write_text(helpers)
        assert not old or old in SOURCE
        for name in ("changing_helpers", "changing_model"):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        return importlib.import_module("changing_model")

    yield loaded
    for name in ("changing_helpers", "changing_model"):
        sys.modules.pop(name, None)


def study(folder, fn, samples=None, **options):
    return batched(fn, SAMPLES if samples is None else samples, store=folder / "study", progress=False, **options)


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        ("fn", "FACTOR * helper", "FACTOR + helper", "the code of changing_model.fn"),
        ("fn", "x + 1", "x + 2", "the code of changing_model.helper"),
        ("fn", "FACTOR = 2.0", "FACTOR = 2.5", "changed: FACTOR of changing_model"),
        ("fn", "[1.0, 2.0]", "[1.0, 2.1]", "changed: TABLE of changing_model"),
        ("closed", "product(3.0)", "product(4.0)", "changed: k, which changing_model.product.<locals>.<lambda>"),
        ("closed", "product(3.0)", 'product(3.0, ("b",))', "changed: names, which"),
        ("doubled", "@wrapped(2.0)", "@wrapped(3.0)", "changed: factor, which"),
        ("doubled", 'return x["a"]\n', 'return x["b"]\n', "the code of changing_model.doubled"),
    ],
)
def test_changes_of_a_function_are_named(tmp_path, load, name, old, new, told):
    study(tmp_path, getattr(load(), name))
    with pytest.raises(InputError, match=rf"holds another study: the function changing_model.* {told}"):
        study(tmp_path, getattr(load(old, new), name))
    assert study(tmp_path, getattr(load(), name)).success.all()


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("return jnp.sin", "return jnp.cos", "the code of changing_helpers.curve"),
        ("POWER = 2", "POWER = 3", "POWER of changing_helpers"),
    ],
)
def test_changes_of_a_module_that_it_uses_are_named(tmp_path, load, old, new, told):
    study(tmp_path, load().fn)
    with pytest.raises(InputError, match=f"changed: {told}"):
        study(tmp_path, load(helpers=HELPERS.replace(old, new)).fn)


@pytest.mark.parametrize(
    ("arguments", "old", "new", "told"),
    [
        ({"slope": 1.0 + 1e-15}, "", "", "changed: field slope"),
        ({"width": 2e-3}, "", "", r"changed: field law\.width"),
        ({}, "self.width * helper", "self.width + helper", r"the code of changing_model\.Law\.force"),
        ({}, "x + 1", "x + 2", "the code of changing_model.helper"),
        ({}, "shift = 0.25", "shift = 0.5", "shift of the class changing_model.Law"),
    ],
)
def test_changes_of_a_module_of_arrays_are_named(tmp_path, load, arguments, old, new, told):
    study(tmp_path, load().model())
    with pytest.raises(InputError, match=told):
        study(tmp_path, load(old, new).model(**arguments))
    assert study(tmp_path, load().model()).success.all()


def test_changes_of_other_callables_are_named(tmp_path, load):
    module = load()
    study(tmp_path / "object", module.Plain(1.0))
    with pytest.raises(InputError, match="Plain was changed: the function itself"):
        study(tmp_path / "object", module.Plain(2.0))
    with pytest.raises(InputError, match=r"the function was .*Plain and is .*fn now"):
        study(tmp_path / "object", module.fn)
    sum_of = functools.partial(_weighted, weight=np.array(1.0))
    study(tmp_path / "partial", sum_of)
    with pytest.raises(InputError, match="changed: argument weight"):
        study(tmp_path / "partial", functools.partial(_weighted, weight=np.array(2.0)))


def _weighted(x, weight):
    return weight * (x["a"] + x["b"])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"samples": {"a": np.arange(5.0), "b": np.ones(5)}}, "there were 4 samples and are 5 now"),
        ({"samples": {"a": np.arange(4.0), "b": 2 * np.ones(4)}}, "names or values of the samples"),
        ({"samples": {**SAMPLES, "c": np.ones(4)}}, "names or values of the samples"),
        ({"difficulty": np.arange(4.0)}, "difficulty was changed"),
        ({"seed": 2}, "seed was 1 and is 2 now"),
        ({"mode": "loop"}, "mode was vmap and is loop now"),
        ({"retry": _weighted}, r"second try was none and is .*_weighted now"),
    ],
)
def test_changes_of_the_study_are_named(tmp_path, load, options, told):
    module = load()
    study(tmp_path, module.fn, seed=1, chunk_size=2)
    with pytest.raises(InputError, match=told):
        study(tmp_path, module.fn, **{"seed": 1, "chunk_size": 2, **options})
    assert study(tmp_path, module.fn, seed=1, chunk_size="auto").success.all()


def test_other_versions_are_named(tmp_path, load, monkeypatch):
    study(tmp_path, load().fn)
    monkeypatch.setattr(_batch_facts, "versions", lambda: {"jax": "0.0.1"})
    with pytest.raises(InputError, match=r"jax was \d.* and is 0\.0\.1 now"):
        study(tmp_path, load().fn)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"""A model of the user\'s own."""', '"""Another word."""\n\n# a comment, and another\n'),
        ("    return FACTOR", "    # why\n    return FACTOR"),
        ("class Plain:", "def unused(x):\n    return 17\n\n\nclass Plain:"),
        ("FACTOR = 2.0\nTABLE = np.array([1.0, 2.0])", "TABLE = np.array([1.0, 2.0])\nFACTOR = 2.0"),
    ],
)
def test_what_is_the_same_goes_on(tmp_path, load, old, new):
    for name in ("fn", "closed", "doubled"):
        first = study(tmp_path / name, getattr(load(), name))
        assert study(tmp_path / name, getattr(load(old, new), name)).digest == first.digest
    other_order = {"b": SAMPLES["b"], "a": SAMPLES["a"]}
    assert study(tmp_path / "fn", load().fn, other_order).success.all()
    assert study(tmp_path / "fn", load().fn, pd.DataFrame(other_order)).success.all()


def test_what_is_shared_and_what_is_equal_are_the_same():
    class Pair(eqx.Module):
        first: object
        second: object

        def __call__(self):
            raise NotImplementedError

    def parts(a, b):
        return function_parts(Pair(a, b))

    one, equal, other = [(1.0, 2.0)], [(1.0, 2.0)], [(1.0, 3.0)]
    assert parts(one, one) == parts(one, equal)
    assert parts(one, other) != parts(one, one)
    assert parts(other, one) != parts(one, other)


def test_what_holds_itself_comes_to_an_end():
    def digest():
        itself: list = []
        itself.append(itself)
        return function_parts(lambda x: itself)

    assert digest() == digest()


def test_functions_without_a_source_are_told_apart():
    def typed(text):
        found = {"np": np}
        exec(text, found)
        return function_parts(found["f"])

    assert typed("def f(x): return np.sin(x)") == typed("def f(x):\n  # why\n  return np.sin(x)")
    for text in ("np.cos(x)", "np.sin(x + 1)", "np.sin(x) in {'a', 'b'}"):
        assert typed(f"def f(x): return {text}") != typed("def f(x): return np.sin(x)")
