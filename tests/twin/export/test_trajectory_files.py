"""Trajectories and records written for other tools keep every digit, and say their units."""

import h5py
import jax.numpy as jnp
import numpy as np
import pytest
from reference_systems import ConstantInputs, two_mass

from twin._checks import InputError
from twin.drives import mauro_axis
from twin.export import write_trajectory
from twin.io.csv import read_csv
from twin.record import Record
from twin.simulation import simulate
from twin.stepping import ConstantSteps


def run(plant, samples=50, period=1e-4):
    times = jnp.arange(samples) * period
    return simulate(plant, ConstantInputs(1.0, 0.2), times, stepping=ConstantSteps(16))


def a_record():
    times = np.arange(20) * 1e-3
    return Record.create(times, {"position": np.sin(times), "force": times / 3}, {"position": "m", "force": "N"})


def test_text_comes_back_to_the_last_digit(tmp_path):
    trajectory = run(mauro_axis())
    path = write_trajectory(tmp_path / "run.csv", trajectory)
    columns = {"position": ("position [m]", "m"), "speed": ("motor_speed [rad/s]", "rad/s")}
    back = read_csv(path, columns, time=("time [s]", "s"))
    np.testing.assert_array_equal(back.channel("position"), trajectory.outputs.position)
    np.testing.assert_array_equal(back.channel("speed"), trajectory.outputs.motor_speed)
    np.testing.assert_array_equal(back.times, trajectory.times)


def test_hdf5_holds_units_and_the_rate(tmp_path):
    trajectory = run(mauro_axis())
    path = write_trajectory(tmp_path / "run.h5", trajectory, states=True)
    with h5py.File(path) as file:
        assert file["position"].attrs["unit"] == "m"
        assert file["power"].attrs["unit"] == "W"
        assert file["position"].attrs["sample_rate"] == pytest.approx(1e4)
        np.testing.assert_array_equal(file["position"], trajectory.outputs.position)
        np.testing.assert_array_equal(file["state.motor_angle"], trajectory.states.motor_angle)
        assert file["state.motor_angle"].attrs["unit"] == "rad"


def test_units_are_converted(tmp_path):
    record = a_record()
    path = write_trajectory(tmp_path / "run.csv", record, units={"position": "mm"})
    assert path.read_text().splitlines()[0] == "time [s],position [mm],force [N]"
    back = read_csv(path, {"position": ("position [mm]", "mm")}, time=("time [s]", "s"))
    np.testing.assert_allclose(back.channel("position"), record.channel("position"), rtol=1e-15)


def test_a_unit_that_is_open_is_left_out_until_it_is_said(tmp_path):
    # "Motor angle [rad or m]": both could be meant.
    head = write_trajectory(tmp_path / "a.csv", run(two_mass())).read_text().splitlines()[0]
    assert head.split(",")[:2] == ["time [s]", "position"]
    head = write_trajectory(tmp_path / "a.csv", run(two_mass()), units={"position": "deg"}).read_text().splitlines()[0]
    assert head.split(",")[1] == "position [deg]"


def test_uneven_samples_have_no_rate(tmp_path):
    times = np.cumsum(1e-3 * (1 + 0.2 * np.sin(np.arange(20))))
    record = Record.create(times, {"x": times}, {"x": "m"})
    with h5py.File(write_trajectory(tmp_path / "a.hdf5", record)) as file:
        assert "sample_rate" not in file["x"].attrs


def test_what_cannot_be_written_is_refused(tmp_path):
    record = a_record()
    with pytest.raises(InputError, match=r"no ending that is known.*\.csv"):
        write_trajectory(tmp_path / "run.xlsx", record)
    with pytest.raises(InputError, match="folder"):
        write_trajectory(tmp_path / "gone" / "run.csv", record)
    with pytest.raises(InputError, match="'speed', but there is no such channel"):
        write_trajectory(tmp_path / "run.csv", record, units={"speed": "m/s"})
    with pytest.raises(InputError, match="length"):
        write_trajectory(tmp_path / "run.csv", record, units={"position": "N"})
    with pytest.raises(InputError, match="delimiter"):
        write_trajectory(tmp_path / "run.csv", record, delimiter="[")
    with pytest.raises(InputError, match="The run failed"):
        write_trajectory(tmp_path / "run.csv", run(mauro_axis(), period=1.0))
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = write_trajectory(tmp_path / "run.csv", a_record())
    before = path.read_bytes()
    monkeypatch.setattr(np, "savetxt", lambda *args, **options: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_trajectory(path, a_record())
    assert path.read_bytes() == before
    assert [each.name for each in tmp_path.iterdir()] == ["run.csv"]
