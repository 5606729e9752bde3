"""A store sees every kind of code that can change a number, and nothing that differs from process to process."""

import cmath
import dataclasses
import importlib.metadata
import json
import math
import sys
from pathlib import Path

import batch_functions as functions
import changing_code
import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.special

from twin import _batch_facts
from twin._checks import InputError
from twin._fingerprint import function_facts, function_parts
from twin.batch import batched

SAMPLES = {"a": np.arange(4.0), "b": np.ones(4)}


def study(folder, fn):
    return batched(fn, SAMPLES, store=folder / "study", progress=False)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    yield tmp_path
    sys.modules.pop(changing_code.NAME, None)


@pytest.mark.parametrize("number", changing_code.IN_ALL)
def test_a_changed_number_is_seen_wherever_it_is(folder, number):
    def parts(changed):
        module = changing_code.loaded(folder, changed)
        return function_parts(module.model() if number in changing_code.IN_CLASS else module.rules)

    same = parts(None)
    assert parts(None) == same
    assert parts(number) != same


def test_a_method_that_is_compiled_is_named(folder):
    study(folder, changing_code.loaded(folder).model())
    with pytest.raises(InputError, match=r"changed: the code of changing_code_source\.Model\.filtered"):
        study(folder, changing_code.loaded(folder, 108).model())
    assert study(folder, changing_code.loaded(folder).model()).success.all()


def test_processes_agree(folder):
    changing_code.loaded(folder)
    script = folder / "digests.py"
    script.write_text(
        "import json\nimport jax\njax.config.update('jax_enable_x64', True)\n"
        f"import {changing_code.NAME} as m\nfrom twin._fingerprint import function_parts\n"
        "print(json.dumps([function_parts(m.model()), function_parts(m.rules)]))\n"
    )
    found = []
    for seed in (1, 2):
        with functions.started(script, PYTHONHASHSEED=str(seed)) as process:
            printed, errors = process.communicate(timeout=120)
        assert process.returncode == 0, errors
        found.append(json.loads(printed))
    assert found[0] == found[1]


@dataclasses.dataclass(eq=False)
class Fits:
    """Something with a field that changes how fast it is, and not what it finds."""

    slope: float
    threads: int = dataclasses.field(default=1, metadata={"changes_results": False})

    def __call__(self, x):
        return self.slope * x["a"]


class FitsModule(eqx.Module):
    slope: float
    threads: int = eqx.field(default=1, metadata={"changes_results": False})

    def __call__(self, x):
        return self.slope * x["a"]


@pytest.mark.parametrize("kind", [Fits, FitsModule])
def test_fields_that_change_no_result_do_not_count(tmp_path, kind):
    study(tmp_path, kind(2.0))
    assert study(tmp_path, kind(2.0, threads=2)).success.all()
    with pytest.raises(InputError, match="changed: field slope"):
        study(tmp_path, kind(3.0, threads=2))


def test_another_platform_is_refused(tmp_path, monkeypatch):
    study(tmp_path, Fits(1.0))
    monkeypatch.setattr(_batch_facts, "platform", lambda: "gpu")
    with pytest.raises(InputError, match=r"the platform was \w+ and is gpu now"):
        study(tmp_path, Fits(1.0))


def _compiled_elsewhere(x):
    return scipy.special.erf(x["a"])


def _through_a_function(x, distribution=scipy.special.logsumexp):
    return distribution(x["a"])


_erf = scipy.special.erf


def _by_its_own_name(x):
    return _erf(x["a"])


@pytest.mark.parametrize("fn", [_compiled_elsewhere, _through_a_function, _by_its_own_name, scipy.special.erf])
def test_versions_of_the_packages_that_are_used_count(tmp_path, monkeypatch, fn):
    def run():
        return batched(fn, SAMPLES, store=tmp_path / "study", progress=False, mode="loop")

    known = importlib.metadata.version
    assert function_facts(fn)[1]["scipy"] == known("scipy")
    if fn is not scipy.special.erf:
        run()
        monkeypatch.setattr(importlib.metadata, "version", lambda name: "0.9" if name == "scipy" else known(name))
        with pytest.raises(InputError, match=r"scipy was 1\.[\d.]+ and is 0\.9 now"):
            run()


def test_packages_that_are_not_used_do_not_count():
    assert function_facts(lambda x: jnp.sin(x["a"]))[1] == {}


def test_the_function_itself_counts_by_its_code_wherever_it_lies(tmp_path, monkeypatch):
    place = tmp_path / "site-packages"
    place.mkdir()
    monkeypatch.syspath_prepend(str(place))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    try:
        assert Path(changing_code.loaded(place).__file__).parent == place
        study(tmp_path, changing_code.loaded(place).model())
        with pytest.raises(InputError, match=r"changed: the code of changing_code_source\.Model\.__call__"):
            study(tmp_path, changing_code.loaded(place, 118).model())
    finally:
        sys.modules.pop(changing_code.NAME, None)


@pytest.mark.parametrize(("one", "other"), [(np.sin, np.cos), (math.sin, cmath.sin), ({1: 2}.get, {1: 3}.get)])
def test_functions_without_code_are_told_apart(one, other):
    def parts(function):
        return function_parts(lambda x: function(x))

    assert parts(one) == parts(one)
    assert parts(one) != parts(other)


def _imports_late(x):
    import late_constants

    return late_constants.FACTOR * x["a"]


def test_what_a_function_imports_when_called_is_seen(folder):
    (folder / "late_constants.py").write_text("FACTOR = 2.0\n")
    first = function_parts(_imports_late)
    assert function_parts(_imports_late) == first
    (folder / "late_constants.py").write_text("FACTOR = 30.0\n")
    sys.modules.pop("late_constants")
    assert function_parts(_imports_late) != first
    sys.modules.pop("late_constants")
