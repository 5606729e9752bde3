"""`drivetwin export`: the model of a study as files of other tools, which do what the twin does."""

import json

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from fitting.cli import main
from fitting.study.study_file import read_study
from tests.fitting.study.two_mass_study import MODEL, write_study
from twin.export import load_step
from twin.references import SampledSignal
from twin.simulation import simulate
from twin.stepping import ConstantSteps


@pytest.mark.parametrize("version", ["fmu2", "fmu3"])
def test_fmu_of_a_study(tmp_path, capsys, version):
    study = write_study(tmp_path, MODEL)
    file = tmp_path / "drive.fmu"
    command = ["export", study, "--to", version, "--period", "0.5 ms", "--out", str(file)]
    assert main([*command, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["bytes"] == file.stat().st_size
    assert validate_fmu(str(file)) == []
    found = fmpy.simulate_fmu(str(file), stop_time=0.05, output_interval=5e-4, start_values={"input.command": 1.0})
    plant = read_study(study).model
    times = np.arange(101) * 5e-4
    inputs = SampledSignal(times, type(plant.rest_inputs())(np.ones(101), np.zeros(101)), interpolation="hold")
    twin = simulate(plant, inputs, times, stepping=ConstantSteps())
    scale = np.max(np.abs(np.asarray(twin.outputs.position)))
    np.testing.assert_allclose(found["position"], np.asarray(twin.outputs.position), atol=1e-8 * scale, rtol=0)
    assert main(command) == 2
    assert "--force" in capsys.readouterr().err


def test_compiled_step_of_a_study(tmp_path):
    pytest.importorskip("flatbuffers")
    study = write_study(tmp_path, MODEL)
    assert main(["export", study, "--to", "step", "--period", "1 ms"]) == 0
    step = load_step(tmp_path / "study.step")
    assert step is not None


@pytest.mark.parametrize(("extra", "told"), [([], "--period is missing"), (["--period", "1 kg"], "time is expected")])
def test_bad_periods(tmp_path, capsys, extra, told):
    assert main(["export", write_study(tmp_path, MODEL), *extra]) == 2
    assert told in capsys.readouterr().err
