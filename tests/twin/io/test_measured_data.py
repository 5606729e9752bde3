"""The readers of the published data sets: against the data where they are, against small stand-ins everywhere."""

import numpy as np
import pytest
import scipy.io

from twin._checks import InputError
from twin.io.data import DataNotFound
from twin.io.emps import read_emps
from twin.io.two_inertia import read_two_inertia


def read_or_skip(reader, **arguments):
    try:
        return reader(**arguments)
    except DataNotFound as error:
        pytest.skip(f"measured data not found: {error}")


def controller_voltage(emps):
    reference, position = (np.asarray(emps.record.channel(name)) for name in ("reference_position", "position"))
    mean = np.concatenate([position[:1], (position[1:] + position[:-1]) / 2])
    speed = np.diff(mean, prepend=mean[:1]) / 1e-3
    return emps.kp * emps.kv * (reference - position) - emps.kv * speed


@pytest.mark.parametrize("name", ["train", "test"])
def test_emps(name):
    emps = read_or_skip(read_emps, record=name)
    record = emps.record
    assert (emps.kp, emps.kv, emps.gtau) == (160.18, 243.45, pytest.approx(35.15065188))
    np.testing.assert_array_equal(record.times, np.arange(24841) * 1e-3)
    np.testing.assert_array_equal(record.channel("force"), emps.gtau * record.channel("voltage"))
    assert record.units["position"] == "m" and record.units["force"] == "N"
    assert ("pulse_voltage" in record.channels) == (name == "test")


def test_emps_voltage_follows_the_control_law():
    emps = read_or_skip(read_emps, record="train")
    rest = np.asarray(emps.record.channel("voltage")) - controller_voltage(emps)
    assert np.std(rest[10:]) < 0.004


def test_emps_pulses_lost_their_fraction_in_the_file():
    emps = read_or_skip(read_emps, record="test")
    rest = (np.asarray(emps.record.channel("voltage")) - controller_voltage(emps))[10:]
    pulse = np.asarray(emps.record.channel("pulse_voltage"))[10:]
    assert set(pulse) == {0.0, 5.0}
    assert np.mean(rest[pulse > 0]) == pytest.approx(5.0695, abs=2e-4) and np.std(rest[pulse > 0]) < 0.005
    assert np.mean(rest[pulse == 0]) == pytest.approx(0.0, abs=5e-4) and np.std(rest[pulse == 0]) < 0.005


@pytest.mark.parametrize("name, first, step, lines", [("A", 11.0, 1.0, 240), ("B", 13.0, 4.0, 60)])
def test_two_inertia(name, first, step, lines):
    bench = read_or_skip(read_two_inertia, record=name)
    assert (bench.period_samples, bench.periods, bench.record.times.size) == (2500, 20, 50000)
    assert float(bench.record.sample_rate) == pytest.approx(2500.0)
    np.testing.assert_allclose(bench.excited_frequencies, first + step * np.arange(lines), rtol=1e-14)

    def spectrum(channel):
        samples = np.asarray(bench.record.channel(channel))[2500:].reshape(-1, 2500)
        return np.fft.rfft(samples.mean(axis=0))[bench.excited_frequencies.astype(int)]

    # Far below the antiresonance both ends of the shaft move together.
    for motor, load in (("motor_angle", "load_angle"), ("motor_speed", "load_speed")):
        ratio = spectrum(load)[0] / spectrum(motor)[0]
        assert abs(ratio - 1) < 0.07
    frequency = bench.excited_frequencies
    speed_filter = spectrum("motor_speed") / (2j * np.pi * frequency * spectrum("motor_angle"))
    # At the motor's antiresonance (54 Hz) its angle is near the resolution of the encoder.
    np.testing.assert_allclose(speed_filter, 1 / (1 + 1j * frequency / 20.4), atol=0.008)


def emps_stand_in(path, **changes):
    time = np.arange(50) * 1e-3 + 2e-8
    values = dict(
        t=time, qm=time, qg=time, vir=time, pulses_N=np.uint8(5 * (time > 0.02)), kp=160.0, kv=240.0, gtau=35.0
    )
    values |= changes
    scipy.io.savemat(path, {name: value for name, value in values.items() if value is not None}, oned_as="column")
    return path


def test_emps_reads_a_given_file_or_folder(tmp_path):
    emps_stand_in(tmp_path / "DATA_EMPS_PULSES.mat")
    emps = read_emps(tmp_path, record="test")
    np.testing.assert_array_equal(emps.record.times, np.arange(50) * 1e-3)
    assert float(emps.record.channel("pulse_voltage").max()) == 5.0
    assert read_emps(tmp_path / "DATA_EMPS_PULSES.mat", record="train").kv == 240.0


@pytest.mark.parametrize("name", ["t", "qm", "qg", "vir", "kp", "kv", "gtau", "pulses_N"])
def test_emps_names_a_missing_variable(tmp_path, name):
    path = emps_stand_in(tmp_path / "e.mat", **{name: None})
    with pytest.raises(InputError, match=rf"e\.mat.*no variable '{name}'; it has"):
        read_emps(path, record="test")


def test_emps_refuses_unsound_files(tmp_path):
    jump = np.arange(50) * 1e-3
    jump[20:] += 1e-3
    with pytest.raises(InputError, match="index 20"):
        read_emps(emps_stand_in(tmp_path / "e.mat", t=jump))
    with pytest.raises(InputError, match=r"'position'.*NaN"):
        read_emps(emps_stand_in(tmp_path / "e.mat", qm=np.full(50, np.nan)))
    with pytest.raises(InputError, match=r"'voltage'.*49 samples"):
        read_emps(emps_stand_in(tmp_path / "e.mat", vir=np.zeros(49)))
    with pytest.raises(InputError, match=r"'kp'.*one finite number"):
        read_emps(emps_stand_in(tmp_path / "e.mat", kp=np.nan))
    with pytest.raises(InputError, match="'validation'"):
        read_emps(record="validation")
    with pytest.raises(InputError, match=r"DATA_EMPS\.mat.*does not exist"):
        read_emps(tmp_path)


def bench_stand_in(path, **changes):
    samples = np.arange(100.0)
    names = ("iq_adx", "theta_mx", "theta_my", "omega_max", "omega_may", "vdc_adx")
    values = dict.fromkeys(names, samples) | dict(time=np.arange(100, dtype=np.int32) * 400, fs=np.uint16(2500))
    values["ref"] = np.cos(2 * np.pi * 3 * np.arange(25) / 25)
    values |= changes
    scipy.io.savemat(path, {name: value for name, value in values.items() if value is not None}, oned_as="column")
    return path


def test_two_inertia_layout_comes_from_the_file(tmp_path):
    bench = read_two_inertia(bench_stand_in(tmp_path / "b.mat"))
    assert (bench.period_samples, bench.periods) == (25, 4)
    np.testing.assert_allclose(bench.excited_frequencies, [300.0])
    np.testing.assert_array_equal(bench.record.channel("load_angle"), -np.arange(100.0))


def test_two_inertia_refuses_unsound_files(tmp_path):
    with pytest.raises(InputError, match="no variable 'theta_my'"):
        read_two_inertia(bench_stand_in(tmp_path / "b.mat", theta_my=None))
    with pytest.raises(InputError, match="1 µs"):
        read_two_inertia(bench_stand_in(tmp_path / "b.mat", time=np.arange(100) * 401))
    with pytest.raises(InputError, match="whole number of periods of 24"):
        read_two_inertia(bench_stand_in(tmp_path / "b.mat", ref=np.zeros(24)))
    with pytest.raises(InputError, match="'C'"):
        read_two_inertia(record="C")
