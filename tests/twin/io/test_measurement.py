"""Every format, written by its own library and read back."""

import h5py
import numpy as np
import pytest
import pyuff
import scipy.io
import scipy.io.wavfile
from nptdms import ChannelObject, TdmsWriter

from tests.twin.io import measured_files as made
from twin._checks import InputError
from twin.io.measurement import MeasuredChannel, Measurement, formats, read_measurement
from twin.io.sep005 import from_sep005, to_sep005
from twin.record import Record


@pytest.mark.parametrize("name", made.WRITERS)
def test_round_trip(tmp_path, name):
    path = made.WRITERS[name](tmp_path / name)
    found = read_measurement(path)
    assert len(found) == 2 and found.source == str(path)
    scale = 4.0 if name.endswith("wav") else 1.0
    both = tuple(reversed(found.channels)) if found.names == ("i", "x") else found.channels  # HDF5 sorts by name
    for channel, values in zip(both, (made.POSITION, made.CURRENT / scale), strict=True):
        np.testing.assert_allclose(channel.values, values, atol=1e-11)
        if name.endswith("npy"):
            assert channel.abscissa == "index" and any("no time column" in remark for remark in found.remarks)
        else:
            assert channel.abscissa == "time" and channel.times is not None
            np.testing.assert_allclose(channel.times, made.TIMES, atol=1e-12)
    if name.split(".")[-1] in ("csv", "h5", "tdms", "uff"):
        assert [channel.unit for channel in both] == ["mm", "A"]


@pytest.mark.parametrize("name", made.WRITERS)
def test_format_is_known_by_content(tmp_path, name):
    path = made.WRITERS[name](tmp_path / name)
    expected = read_measurement(path).format
    other = tmp_path / "nothing_known"
    other.write_bytes(path.read_bytes())
    assert read_measurement(other).format == expected
    assert expected in formats()


def test_channels_by_name_and_table(tmp_path):
    found = read_measurement(made.csv(tmp_path / "run.csv"))
    assert found["x"].unit == "mm" and found["x"].rate == pytest.approx(100.0)
    assert found.names == ("x", "i")
    with pytest.raises(InputError, match=r"no channel 'X_ist'; it has 'x', 'i'"):
        found["X_ist"]
    assert "100 Hz" in repr(found) and "<td>mm</td>" in found._repr_html_()
    hostile = Measurement("<script>", "file", (MeasuredChannel("<b>", np.zeros(3)),))
    assert "<script>" not in hostile._repr_html_() and "<b>" not in hostile._repr_html_().removeprefix("<b>")


def test_unknown_options_and_formats(tmp_path):
    path = made.csv(tmp_path / "run.csv")
    with pytest.raises(InputError, match=r"run\.csv.*no option 'delimeter'; it has 'delimiter'"):
        read_measurement(path, delimeter=";")
    with pytest.raises(InputError, match="'delimited'"):
        read_measurement(path, format="csv")


def test_time_by_option_and_missing_time(tmp_path):
    path = tmp_path / "run.mat"
    scipy.io.savemat(path, {"clock": 1e3 * made.TIMES, "x": made.POSITION})
    assert read_measurement(path)["x"].abscissa == "index"
    channel = read_measurement(path, time="clock", time_unit="ms")["x"]
    np.testing.assert_allclose(channel.times, made.TIMES, atol=1e-12)
    with pytest.raises(InputError, match="no time column 'zeit'"):
        read_measurement(path, time="zeit")
    assert read_measurement(path, rate=50.0)["x"].rate == pytest.approx(50.0)


def test_time_in_microseconds_is_seen_by_the_rate(tmp_path):
    path = tmp_path / "run.mat"
    scipy.io.savemat(path, {"time": 1e6 * made.TIMES, "x": made.POSITION, "fs": 100.0})
    found = read_measurement(path)
    np.testing.assert_allclose(found["x"].times, made.TIMES, atol=1e-12)
    assert any("µs" in remark for remark in found.remarks)


def test_mat_structs_of_simulink_and_recorders(tmp_path):
    path = tmp_path / "run.mat"
    signals = np.array(
        [(made.POSITION[:, None], "x"), (made.CURRENT[:, None], "i")], dtype=[("values", "O"), ("label", "O")]
    )
    y = np.empty((1, 2), dtype=[("Name", "O"), ("Data", "O"), ("Unit", "O")])
    y[0, 0], y[0, 1] = ("x", made.POSITION, "mm"), ("i", made.CURRENT, "A")
    scipy.io.savemat(
        path,
        {
            "out": {"time": made.TIMES, "signals": signals},
            "rec": {"X": {"Name": "time", "Data": made.TIMES}, "Y": y},
            "nested": {"inner": {"u": made.CURRENT}},
        },
    )
    found = read_measurement(path)
    assert {"x", "i", "x #2", "i #2", "nested.inner.u"} == set(found.names)
    assert found["x #2"].unit == "mm"
    for name in ("x", "x #2"):
        np.testing.assert_array_equal(found[name].values, made.POSITION)
        np.testing.assert_array_equal(found[name].times, made.TIMES)


def test_mat_73_with_references(tmp_path):
    path = made.mat73(tmp_path / "run.mat")
    with h5py.File(path, "r+") as file:
        group = file.create_group("rec")
        hidden = file.create_group("#refs#")
        for field, parts in (("Name", ["x", "i"]), ("Data", [made.POSITION[None], made.CURRENT[None]])):
            references = []
            for number, part in enumerate(parts):
                name = f"{field}{number}"
                text = isinstance(part, str)
                hidden[name] = np.array([[ord(part)]], np.uint16) if text else part
                if text:
                    hidden[name].attrs["matlab_class"] = np.bytes_("char")
                references.append(hidden[name].ref)
            y = group.require_group("Y")
            y.create_dataset(field, data=np.array(references, dtype=h5py.ref_dtype)[:, None], dtype=h5py.ref_dtype)
        group.create_group("X")["Data"] = made.TIMES[None]
    found = read_measurement(path)
    np.testing.assert_array_equal(found["i"].values, made.CURRENT)
    np.testing.assert_array_equal(found["i"].times, made.TIMES)


def test_hdf5_rates_groups_and_links(tmp_path):
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("fast/x", data=made.POSITION).attrs["fs"] = 1000.0
        file["slow/time"], file["slow/i"] = 1e3 * made.TIMES, made.CURRENT
        file["slow/time"].attrs["units"] = b"ms"
        file["soft"], file["out"] = h5py.SoftLink("/fast/x"), h5py.ExternalLink("other.h5", "x")
        file["loop"] = h5py.SoftLink("/")
    found = read_measurement(path)
    assert set(found.names) == {"fast/x", "slow/i"}
    assert found["fast/x"].rate == pytest.approx(1000.0) and found["slow/i"].rate == pytest.approx(100.0)
    assert sum("link" in remark for remark in found.remarks) == 3


def test_tdms_groups_and_time_channels(tmp_path):
    path = tmp_path / "run.tdms"
    with TdmsWriter(path) as writer:
        for group in ("a", "b"):
            columns = (("Time", made.TIMES), ("x", made.POSITION))
            writer.write_segment([ChannelObject(group, name, values) for name, values in columns])
        writer.write_segment([ChannelObject("a", "note", ["text", "more"])])
    found = read_measurement(path)
    assert found.names == ("a/x", "b/x") and found["b/x"].rate == pytest.approx(100.0)


def test_whole_numbers_of_wav_are_scaled(tmp_path):
    for kind, low in ((np.int16, -(2**15)), (np.int32, -(2**31)), (np.uint8, 0)):
        path = tmp_path / f"{kind.__name__}.wav"
        middle = 128 if kind is np.uint8 else 0
        scipy.io.wavfile.write(path, 1000, np.array([low, middle] * 20, dtype=kind))
        channel = read_measurement(path, scale=10.0, unit="m/s^2", names=["a"])["a"]
        np.testing.assert_allclose(channel.values[:2], [-10.0, 0.0])
        assert channel.unit == "m/s^2" and channel.rate == pytest.approx(1000.0)
    with pytest.raises(InputError, match="scale has 2 entries, but the file has 1"):
        read_measurement(path, scale=[1.0, 2.0])


@pytest.mark.parametrize("binary", [0, 1])
def test_responses_of_universal_files(tmp_path, binary):
    path = tmp_path / "run.uff"
    values = (made.POSITION + 1j * made.CURRENT)[:20]
    function = pyuff.prepare_58(
        binary=binary, func_type=4, rsp_node=12, rsp_dir=-2, ref_node=3, ref_dir=1, data=values, x=np.arange(20.0),
        id1="", rsp_ent_name="NONE", ref_ent_name="NONE", abscissa_spacing=1, abscissa_spec_data_type=18,
        ordinate_spec_data_type=12, orddenom_spec_data_type=13,
    )  # fmt: skip
    pyuff.UFF(str(path)).write_sets([function], "add")
    channel = read_measurement(path)["12 -y/3 x"]
    assert channel.abscissa == "frequency" and channel.unit == "m/s^2/N"
    np.testing.assert_allclose(channel.values, values, rtol=1e-9)


def test_sep005_both_ways():
    record = Record.create(made.TIMES, {"position": made.POSITION}, {"position": "m"}, name="run")
    series = to_sep005(record)
    assert series[0]["unit_str"] == "m" and series[0]["fs"] == pytest.approx(100.0)
    channel = from_sep005(series)["position"]
    np.testing.assert_array_equal(channel.values, made.POSITION)
    np.testing.assert_allclose(channel.times, made.TIMES, atol=1e-9)
    jittered = made.TIMES + 0.003 * np.sin(np.arange(50))
    uneven = to_sep005(Record.create(jittered, {"x": made.POSITION}, {"x": "m"}))[0]
    np.testing.assert_array_equal(uneven["time"], jittered)
    for bad, told in (
        ({"name": "x", "unit_str": "m"}, "'data'"),
        ({"name": "x", "unit_str": "m", "data": [1.0, 2.0]}, "neither"),
        ({"name": "x", "unit_str": "m", "data": [1.0, "a"], "fs": 1.0}, "no number"),
        ({"name": "x", "unit_str": "m", "data": [1.0, 2.0], "time": [0.0]}, "shapes"),
    ):
        with pytest.raises(InputError, match=told):
            from_sep005(bad)


@pytest.mark.parametrize(
    ("written", "name", "unit"),
    [
        ("phi_Motor [deg]", "phi_Motor", "deg"),
        ("n [1/min]", "n", "1/min"),
        ("i_q (A)", "i_q", "A"),
        ("x(t)", "x(t)", ""),
        ("a[0]", "a[0]", ""),
        ("n [left]", "n [left]", ""),
    ],
)
def test_unit_in_the_name_of_a_channel(tmp_path, written, name, unit):
    signals = np.zeros((1, 2), dtype=[("values", "O"), ("label", "O")])
    signals[0, 0], signals[0, 1] = (np.arange(5.0), written), (np.ones(5), "other")
    file = tmp_path / "scope.mat"
    scipy.io.savemat(file, {"scope": {"time": np.arange(5.0), "signals": signals}})
    found = read_measurement(file)
    assert (found[name].unit, found.names) == (unit, (name, "other"))
    assert found[written] is found[name]
