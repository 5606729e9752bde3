"""What is in an FMU file, and what is refused."""

import shutil
import zipfile

import equinox as eqx
import jax.numpy as jnp
import pytest

pytest.importorskip("fmpy")

import fmpy
from export_cases import held, servo_loop
from fmpy.validation import validate_fmu
from reference_systems import two_mass

from twin._checks import InputError
from twin.drives import DriveInputs, mauro_axis
from twin.export import write_fmu
from twin.stepping import AdaptiveSteps

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


def test_what_acts_at_once_is_said(written):
    description = fmpy.read_model_description(str(written("servo_loop", "3.0")))
    through = {u.variable.name: {v.name for v in u.dependencies} for u in description.outputs}
    assert through["position"] == set()
    assert through["command"] == {"reference.position", "injection.command"}


def test_variables_have_units_and_the_right_kind(written):
    description = fmpy.read_model_description(str(written("servo_loop", "2.0")))
    variables = {v.name: v for v in description.modelVariables}
    assert variables["controller.position_gain"].unit == "1/s"
    assert variables["controller.position_gain"].variability == "tunable"
    assert variables["plant.initial_position"].variability == "fixed"
    assert float(variables["plant.mass"].start) == 95.0
    # The memory follows from the position, which a parameter says.
    assert not any(name.startswith("initial.position") for name in variables)
    assert "period" not in variables


def test_the_same_model_gives_the_same_file(tmp_path):
    files = [write_fmu(tmp_path / f"{i}.fmu", two_mass(), period=1e-3, name="axis") for i in (1, 2)]
    assert files[0].read_bytes() == files[1].read_bytes()
    other = write_fmu(tmp_path / "3.fmu", two_mass(), period=2e-3, name="axis")
    guids = {fmpy.read_model_description(str(path)).guid for path in (*files, other)}
    assert len(guids) == 2


def test_few_parameters_other_names_and_source_only(tmp_path):
    path = write_fmu(
        tmp_path / "axis.fmu",
        mauro_axis(),
        period=1e-4,
        parameters=("motor", "slide_mass"),
        rename={"input.command": "u", "position": "x"},
        platforms=(),
    )
    assert validate_fmu(str(path)) == []
    variables = {v.name: v.causality for v in fmpy.read_model_description(str(path)).modelVariables}
    assert variables["u"] == "input" and variables["x"] == "output"
    parameters = {name for name, causality in variables.items() if causality == "parameter" and "initial." not in name}
    assert "slide_mass" in parameters and all(name.startswith("motor.") for name in parameters - {"slide_mass"})
    names = zipfile.ZipFile(path).namelist()
    assert "sources/buildDescription.xml" in names and not any(name.startswith("binaries") for name in names)


def test_bad_input_is_refused(tmp_path, monkeypatch):
    axis, path = two_mass(), tmp_path / "axis.fmu"
    with pytest.raises(InputError, match=r"must end in \.fmu"):
        write_fmu(tmp_path / "axis.zip", axis, period=1e-3)
    with pytest.raises(InputError, match="ConstantSteps, but is AdaptiveSteps"):
        write_fmu(path, axis, period=1e-3, stepping=AdaptiveSteps())
    with pytest.raises(InputError, match="period must be"):
        write_fmu(path, axis)
    with pytest.raises(InputError, match=r"ticks every 0\.001 s"):
        write_fmu(path, servo_loop(), period=2e-3)
    with pytest.raises(InputError, match="version"):
        write_fmu(path, axis, period=1e-3, version="1.0")
    with pytest.raises(InputError, match="'mars', but knows linux64"):
        write_fmu(path, axis, period=1e-3, platforms=("mars",))
    with pytest.raises(InputError, match="'shaft', which is no finite number"):
        write_fmu(path, axis, period=1e-3, parameters=("shaft",))
    with pytest.raises(InputError, match="Two variables are called 'position'"):
        write_fmu(path, axis, period=1e-3, rename={"shaft": "position"})
    with pytest.raises(InputError, match="rename names 'gone'"):
        write_fmu(path, axis, period=1e-3, rename={"gone": "here"})
    with pytest.raises(InputError, match="folder"):
        write_fmu(tmp_path / "gone" / "axis.fmu", axis, period=1e-3)
    injected = eqx.tree_at(
        lambda loop: loop.injection,
        servo_loop(),
        held(jnp.arange(3.0), DriveInputs(jnp.ones(3), jnp.ones(3))),
        is_leaf=lambda x: x is None,
    )
    with pytest.raises(InputError, match="injection"):
        write_fmu(path, injected)
    monkeypatch.setenv("CC", "false")
    with pytest.raises(InputError, match="compiler 'false' failed"):
        write_fmu(path, axis, period=1e-3)
    assert list(tmp_path.iterdir()) == []


def test_without_a_compiler_the_cure_is_named(tmp_path, monkeypatch):
    import twin.export.fmu.compile as module

    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(module.shutil, "which", lambda name: None)
    monkeypatch.setattr(module.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"No C compiler.*platforms=\(\)"):
        write_fmu(tmp_path / "axis.fmu", two_mass(), period=1e-3)


@pytest.mark.slow
def test_libraries_for_other_machines(tmp_path):
    pytest.importorskip("ziglang", reason="zig builds for other machines")
    path = write_fmu(tmp_path / "axis.fmu", two_mass(), period=1e-3, version="2.0", platforms=("linux64", "win64"))
    with zipfile.ZipFile(path) as archive:
        assert archive.read("binaries/win64/axis.dll")[:2] == b"MZ"
        assert archive.read("binaries/linux64/axis.so")[1:4] == b"ELF"
