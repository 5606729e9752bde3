"""The house rules: who imports whom, how classes are built, how long files are, and what an import does not do."""

import ast
import builtins
import importlib
import inspect
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("twin", "sensitivity", "fitting")
FORBIDDEN = {"twin": {"sensitivity", "fitting"}, "sensitivity": {"fitting"}, "fitting": set()}
CORE = ("laws", "drives", "control", "references", "modal", "structure", "correlation")
CORE_FILES = ("simulation.py", "linear.py", "frf.py", "frf_estimators.py", "response_estimate.py", "periodic.py")
CORE_FILES += ("plant.py", "stepping.py", "trajectory.py")
NOT_IN_CORE = {"matplotlib", "pandas", "SALib", "pooch", "tomlkit", "pint", "json", "pathlib", "os"}

# What a notebook imports first, and the libraries that are loaded by what uses them, not by these.
LIGHT = ("twin", "twin.simulation", "twin.drives", "twin.control", "twin.linear", "twin.parameters", "twin.references")
LIGHT += ("twin.laws", "twin.modal", "twin.sweep", "twin.frf", "twin.frf_estimators", "twin.correlation")
LIGHT += ("twin.structure", "twin.performance", "twin.record", "twin.plots", "twin.compile_cache", "twin.io.csv")
LIGHT += ("twin.io.measurement", "twin.io.prepare", "twin.io.look", "twin.io.look_plots", "twin.io.sep005")
LIGHT += ("sensitivity", "sensitivity.plots", "fitting.fit", "fitting.multistart", "fitting.profile", "fitting.plots")
LIGHT += ("twin.export",)
LIGHT += ("fitting.identifiability", "fitting.design", "fitting.posterior", "fitting.identification.output_error")
LATE = {"matplotlib", "pandas", "SALib", "scipy", "interpax", "pint", "pooch", "platformdirs", "tomlkit", "pyuff"}
LATE |= {"h5py", "nptdms", "blackjax", "requests", "control", "fmpy"}


def modules(path):
    """Top-level packages, and whole names, that a file imports."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
    return found


def sources(room):
    return sorted((ROOT / room).rglob("*.py"))


@pytest.mark.parametrize("room", ROOMS)
def test_imports_go_one_way(room):
    for path in sources(room):
        wrong = {m for m in modules(path) if m.split(".")[0] in FORBIDDEN[room]}
        assert not wrong, f"{path.relative_to(ROOT)} imports {wrong}"


def test_core_knows_no_files_and_no_plots():
    files = [p for room in CORE for p in sources(f"twin/{room}")] + [ROOT / "twin" / name for name in CORE_FILES]
    for path in files:
        names = modules(path)
        wrong = {m for m in names if m.split(".")[0] in NOT_IN_CORE or m.startswith("twin.io")}
        assert not wrong, f"{path.relative_to(ROOT)} imports {wrong}"


def test_laws_know_no_drive_and_drives_no_controller():
    for room, strangers in (("laws", ("twin.drives", "twin.control")), ("drives", ("twin.control",))):
        for path in sources(f"twin/{room}"):
            assert not {m for m in modules(path) if m.startswith(strangers)}, path


@pytest.mark.parametrize("room", ROOMS)
def test_files_can_be_held_in_ones_head(room):
    for path in [*sources(room), *sources("tests")]:
        lines = len(path.read_text(encoding="utf-8").splitlines())
        assert lines <= 300, f"{path.relative_to(ROOT)} has {lines} lines"


def bound_names(tree):
    """Names that a file binds anywhere, whatever the scope."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield from ((one.asname or one.name).split(".")[0] for one in node.names)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            yield node.id
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.ExceptHandler | ast.MatchAs | ast.MatchStar) and node.name:
            yield node.name
        elif isinstance(node, ast.MatchMapping) and node.rest:
            yield node.rest


@pytest.mark.parametrize("room", ["twin", "sensitivity", "fitting", "tests"])
def test_no_name_is_unknown(room):
    """Linters cannot tell: names of dimensions in annotations are none to them."""
    for path in sorted((ROOT / room).rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        known = {*bound_names(tree), *dir(builtins), "__file__", "__name__", "__path__"}
        used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        assert used <= known, f"{path.relative_to(ROOT)}: {used - known}"


def own_classes():
    for room in ROOMS:
        package = importlib.import_module(room)
        for info in pkgutil.walk_packages(package.__path__, f"{room}."):
            module = importlib.import_module(info.name)
            for cls in vars(module).values():
                if inspect.isclass(cls) and cls.__module__ == module.__name__:
                    yield cls


def test_every_class_is_abstract_or_final():
    """equinox ignores `strict=True` (trap 39), so this looks for itself: nobody inherits from a concrete class."""
    classes = list(own_classes())
    assert len(classes) > 30
    for cls in classes:
        for base in cls.__mro__[1:]:
            if base.__module__.split(".")[0] in ROOMS and base is not cls:
                assert base.__name__.startswith("Abstract") or issubclass(cls, Exception), (
                    f"{cls.__name__} inherits from the concrete class {base.__name__}"
                )


def test_every_public_thing_is_documented():
    for cls in own_classes():
        if not cls.__name__.startswith("_"):
            assert cls.__doc__, cls


def run_python(code):
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)


def test_importing_changes_and_loads_nothing():
    """No import changes JAX's configuration or the environment, or loads what is not needed yet."""
    code = (
        "import os, sys, jax\n"
        "before = dict(jax.config.values), dict(os.environ)\n"
        f"import {', '.join(LIGHT)}\n"
        "assert (dict(jax.config.values), dict(os.environ)) == before\n"
        f"assert not {LATE!r} & set(sys.modules), {LATE!r} & set(sys.modules)\n"
    )
    done = run_python(code)
    assert done.returncode == 0, done.stderr


def test_help_of_the_command_does_not_wait_for_jax():
    code = (
        "import sys\n"
        "from fitting.cli import main\n"
        "try:\n    main(['--help'])\n"
        "except SystemExit:\n    assert not {'jax', 'numpy'} & set(sys.modules)\n"
    )
    done = run_python(code)
    assert done.returncode == 0, done.stderr
    assert "drivetwin" in done.stdout


def test_nothing_works_in_single_precision():
    done = run_python("import twin.drives\nfrom twin.laws import ViscousFriction\nViscousFriction(1.0)\n")
    assert "InputError" in done.stderr
    assert "jax_enable_x64" in done.stderr
