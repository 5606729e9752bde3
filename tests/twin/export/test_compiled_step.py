"""Compiled steps in files: they repeat the twin's simulation, and damaged files are refused."""

import json
import subprocess
import sys
import textwrap

import jax
import jax.numpy as jnp
import numpy as np
import pytest

pytest.importorskip("flatbuffers")

from export_cases import CASES, worst
from reference_systems import two_mass

from twin._checks import InputError
from twin.export import export_step, load_step
from twin.paths import set_leaves
from twin.simulation import simulate
from twin.stepping import AdaptiveSteps


def exported(case, folder, **options):
    system, reference, times, inputs, stepping = CASES[case]()
    period = None if case.endswith("loop") else float(times[1])
    path = export_step(folder / "step.bin", system, period=period, stepping=stepping, **options)
    run = simulate(system, reference, jnp.asarray(times), stepping=stepping)
    return load_step(path), run, inputs, path


def rows_of(step, inputs, **options):
    """All outputs of a run, by a scan over the steps."""
    given = {name.removeprefix("input."): values for name, values in inputs.items()}
    count = len(next(iter(given.values())))
    zeros = np.zeros(count)
    items = jnp.asarray(np.stack([given.get(name, zeros) for name in step.inputs], axis=1))
    return np.asarray(jax.lax.scan(lambda x, u: step(x, u, **options), step.initial_state, items)[1])


@pytest.mark.parametrize("case", ["two_mass", "servo_loop", "preload_loop"])
def test_repeats_the_simulation(case, tmp_path):
    step, run, inputs, _ = exported(case, tmp_path)
    assert worst(rows_of(step, inputs), run.outputs) < 1e-12
    assert step.outputs == run.outputs._fields
    assert set(step.platforms) == {"cpu", "cuda"}


def test_names_units_and_parameters(tmp_path):
    step, _, inputs, path = exported("servo_loop", tmp_path)
    assert step.inputs[0] == "reference.position"
    assert {"plant.position", "controller.previous"} <= set(step.states)
    assert step.units["parameters"]["controller.position_gain"] == "1/s"
    system, reference, times, _, stepping = CASES["servo_loop"]()
    run = simulate(set_leaves(system, {"plant.mass": 120.0}), reference, jnp.asarray(times), stepping=stepping)
    heavier = step.parameter_values.at[step.parameters.index("plant.mass")].set(120.0)
    assert worst(rows_of(step, inputs, parameters=heavier), run.outputs) < 1e-12
    assert path.read_bytes().startswith(b"drivetwin step")


def test_runs_without_the_model(tmp_path):
    """A fresh Python that has loaded no drive, no law and no controller."""
    step, _, _, path = exported("two_mass", tmp_path, platforms=("cpu",))
    code = f"""
        import jax, json
        jax.config.update("jax_enable_x64", True)
        from jax import export
        from jax.numpy import asarray
        data = open({str(path)!r}, "rb").read().split(b"\\n", 2)[2]
        parameters = asarray({step.parameter_values.tolist()})
        after, _ = export.deserialize(bytearray(data)).call(
            parameters, asarray([0.1, 0.0, 0.0, 0.0]), asarray([1.0, 0.0]), asarray(0.0)
        )
        print(json.dumps(after.tolist()))
    """
    code = textwrap.dedent(code)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    after, _ = step(jnp.array([0.1, 0.0, 0.0, 0.0]), jnp.array([1.0, 0.0]))
    np.testing.assert_allclose(json.loads(done.stdout), after, rtol=1e-14)


def test_damaged_files_are_refused(tmp_path):
    path = export_step(tmp_path / "step.bin", two_mass(), period=1e-3, platforms=("cpu",))
    whole = path.read_bytes()
    for damaged in (
        whole[:-1],
        whole[: len(whole) // 2],
        whole[:40],
        whole[:-9] + bytes([whole[-9] ^ 1]) + whole[-8:],
        b"nothing",
    ):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"cannot be read|no compiled step"):
            load_step(path)
    with pytest.raises(InputError, match="does not exist"):
        load_step(tmp_path / "gone.bin")


def test_bad_input_is_refused(tmp_path):
    with pytest.raises(InputError, match="ConstantSteps, but is AdaptiveSteps"):
        export_step(tmp_path / "a", two_mass(), period=1e-3, stepping=AdaptiveSteps())
    with pytest.raises(InputError, match="platforms"):
        export_step(tmp_path / "a", two_mass(), period=1e-3, platforms=("abacus",))
    with pytest.raises(InputError, match="folder"):
        export_step(tmp_path / "gone" / "a", two_mass(), period=1e-3)
    assert list(tmp_path.iterdir()) == []
