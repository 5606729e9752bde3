"""The names that a notebook starts from: loaded when they are first used, and never taken for a file of that name."""

import ast
import importlib
import inspect
import pydoc
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import cloudpickle
import pytest

import fitting
import sensitivity
import twin
from twin._fingerprint import function_parts

ROOT = Path(__file__).parents[1]
PACKAGES = (twin, sensitivity, fitting)
NAMES = [(package, name) for package in PACKAGES for name in package.__all__]
# Functions that have the name of a file beside them.
SHARED = [(p, n) for p, n in NAMES if not inspect.ismodule(getattr(p, n)) and (ROOT / p.__name__ / f"{n}.py").exists()]
HEAVY = {"jax", "equinox", "diffrax", "numpy", "scipy", "pandas", "matplotlib", "SALib", "pint"}


def called(package, name):
    return f"{package.__name__}.{name}"


def run_python(*lines):
    done = subprocess.run([sys.executable, "-c", "\n".join(lines)], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_listing_loads_nothing():
    run_python(
        "import sys, twin, sensitivity, fitting",
        "names = [name for package in (twin, sensitivity, fitting) for name in dir(package)]",
        "assert {'simulate', 'fit', 'sobol', 'drives'} <= set(names)",
        f"assert not {HEAVY!r} & set(sys.modules)",
    )


@pytest.mark.parametrize("package", PACKAGES, ids=lambda p: p.__name__)
def test_completion_offers_the_public_names_alone(package):
    assert dir(package) == sorted(package.__all__)
    assert len(set(package.__all__)) == len(package.__all__)


@pytest.mark.parametrize("package", PACKAGES, ids=lambda p: p.__name__)
def test_editors_are_told_the_names_that_there_are(package):
    tree = ast.parse(Path(package.__file__).read_text(encoding="utf-8"))
    (told,) = [node for node in tree.body if isinstance(node, ast.If)]
    imports = {alias.asname: (node.module, alias.name) for node in told.body for alias in node.names}
    assert set(imports) == set(package.__all__)
    for name, (module, original) in imports.items():
        if module != package.__name__:
            assert getattr(package, name) is getattr(importlib.import_module(module), original)


@pytest.mark.parametrize("package, name", NAMES, ids=lambda value: getattr(value, "__name__", value))
def test_help_says_what_a_name_is_and_takes(package, name):
    value = getattr(package, name)
    assert isinstance(value, ModuleType) or inspect.isclass(value) or inspect.isfunction(value)
    assert len(inspect.getdoc(value) or "") > 20
    # A result is given by a function, a record is made by `create`: those say what they take.
    taken = value.create if hasattr(value, "create") else value
    given = isinstance(value, ModuleType) or (package is sensitivity and inspect.isclass(value))
    assert given or "Args:" in inspect.getdoc(taken)


@pytest.mark.parametrize("package", PACKAGES, ids=lambda p: p.__name__)
def test_help_of_a_package_has_its_names(package):
    text = pydoc.plain(pydoc.render_doc(package))
    for name in package.__all__:
        assert name in text
    for line in package.__doc__.splitlines():
        assert line in text


def test_a_name_that_there_is_not():
    misspelt = "simulat"
    with pytest.raises(AttributeError, match="module 'twin' has no attribute 'simulat'"):
        getattr(twin, misspelt)


ORDERS = {
    "file first": "from {module} import {name} as a\nimport {module}\nb = {called}\nfrom {package} import {name} as c",
    "name first": "b = {called}\nfrom {package} import {name} as c\nfrom {module} import {name} as a\nimport {module}",
    "taken from the package": "from {package} import {name} as c\nimport {module}\nfrom {module} import {name} as a\n"
    "b = {called}",
}


@pytest.mark.parametrize("order", ORDERS.values(), ids=ORDERS)
def test_a_function_is_never_taken_for_its_file(order):
    lines = ["import twin, sensitivity, fitting, sys"]
    for package, name in SHARED:
        module = getattr(package, name).__module__
        words = {"module": module, "name": name, "package": package.__name__, "called": called(package, name)}
        lines += [order.format(**words), f"assert a is b is c is {called(package, name)} and callable(a)"]
        lines += [f"assert sys.modules[{module!r}].{name} is a"]
    run_python(*lines)


def test_some_names_are_shared_with_files():
    assert {"fit", "multistart", "sweep", "sobol"} <= {name for _, name in SHARED}


def test_a_name_can_be_replaced_for_a_test(monkeypatch):
    monkeypatch.setattr(fitting, "fit", print)
    assert fitting.fit is print
    monkeypatch.undo()
    assert fitting.fit is importlib.import_module("fitting.fit").fit


def first_frequency(axis):
    return twin.modes(axis.second_order()).frequency[1]


def test_functions_that_use_a_package_can_be_sent_to_workers():
    own = {}
    exec("import twin\ndef first(axis):\n    return twin.modes(axis)", own)
    again = cloudpickle.loads(cloudpickle.dumps(own["first"]))
    assert again.__globals__["twin"] is twin


def test_a_study_is_the_same_whether_its_names_are_loaded_or_not(monkeypatch):
    loaded = function_parts(first_frequency)
    monkeypatch.delitem(vars(twin), "modes", raising=False)
    assert function_parts(first_frequency) == loaded
