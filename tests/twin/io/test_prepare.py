"""From channels of a file to a record: known signals through every change."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.io.measurement import MeasuredChannel, Measurement
from twin.io.prepare import ChannelChoice, prepare

RNG = np.random.default_rng(5)


def wave(times):
    return np.sin(2 * np.pi * 3 * times) + 0.3 * np.cos(2 * np.pi * 7 * times)


def measured(**channels):
    made = []
    for name, (times, values, unit) in channels.items():
        made.append(MeasuredChannel(name, values, unit, times, "index" if times is None else "time"))
    return Measurement("run", "run.csv", tuple(made), ("read.",))


def even(rate, seconds=2.0, start=0.0):
    return start + np.arange(int(rate * seconds)) / rate


def told(result, *words):
    assert any(all(word in remark for word in words) for remark in result.remarks), result.remarks


def test_units_signs_offsets_and_scales():
    t = even(100.0)
    run = measured(x=(t, wave(t), "mm"), u=(t, wave(t), ""), f=(t, wave(t), "kN"))
    result = prepare(
        run,
        {
            "position": ChannelChoice("x", expected="m", sign=-1.0, offset=0.5),
            "speed": ChannelChoice("u", "mm/s", "m/s", scale=20.0),
            "force": ChannelChoice("f", "N"),
        },
    )
    np.testing.assert_allclose(result.record.channel("position"), 0.5 - 1e-3 * wave(t), atol=1e-15)
    np.testing.assert_allclose(result.record.channel("speed"), 0.02 * wave(t), atol=1e-15)
    np.testing.assert_allclose(result.record.channel("force"), wave(t), atol=1e-15)
    assert result.record.units == {"position": "m", "speed": "m/s", "force": "N"} and result.record.name == "run"
    told(result, "read.")
    told(result, "Warning", "'kN'", "'N'")
    told(result, "position", "turned round", "mm to m")


def test_one_even_clock_is_left_alone():
    t = even(100.0)
    result = prepare(measured(x=(t, wave(t), "m")), {"position": ChannelChoice("x")}, start=0.5, stop=1.0)
    kept = (t >= 0.5) & (t < 1.0)
    np.testing.assert_array_equal(result.record.times, t[kept])
    np.testing.assert_array_equal(result.record.channel("position"), wave(t)[kept])


def test_different_rates_and_delays_meet_on_one_axis():
    fast, slow = even(1000.0), even(160.0, start=0.003)
    run = measured(x=(fast, wave(fast - 0.0123), "m"), y=(slow, wave(slow), "m"))
    choices = {"x": ChannelChoice("x", delay=0.0123), "y": ChannelChoice("y")}
    result = prepare(run, choices)
    t = np.asarray(result.record.times)
    assert float(result.record.sample_rate) == pytest.approx(1000.0)
    inside = (t > 0.1) & (t < 1.8)
    for name in ("x", "y"):
        assert np.max(np.abs(np.asarray(result.record.channel(name)) - wave(t))[inside]) < 2e-4
    result = prepare(run, choices, rate=100.0)
    t = np.asarray(result.record.times)
    inside = (t > 0.4) & (t < 1.5)
    for name in ("x", "y"):
        assert np.max(np.abs(np.asarray(result.record.channel(name)) - wave(t))[inside]) < 1e-3
    told(result, "low-pass")


def test_what_would_fold_down_is_taken_out():
    t = even(1000.0, 4.0)
    tone = np.sin(2 * np.pi * 130.0 * t)  # at 100 Hz it would look like 30 Hz
    result = prepare(measured(x=(t, tone, "m")), {"x": ChannelChoice("x")}, rate=100.0)
    assert np.max(np.abs(np.asarray(result.record.channel("x"))[30:-30])) < 2e-4


def test_gaps_and_missing_samples():
    t = even(100.0)
    values = wave(t)
    values[60:63] = np.nan
    kept = np.ones(t.size, bool)
    kept[120:124] = False
    run = measured(x=(t[kept], values[kept], "m"))
    choice = {"x": ChannelChoice("x")}
    with pytest.raises(InputError, match=r"run\.csv.*2 gaps, the longest of 4 samples in 'x' from 1\.19.*gaps='fill'"):
        prepare(run, choice)
    filled = prepare(run, choice, gaps="fill")
    np.testing.assert_allclose(filled.record.times, t, atol=1e-9)
    missing = np.abs(np.asarray(filled.record.channel("x")) - wave(t))
    assert 0.01 < np.max(missing) < 0.3 and np.count_nonzero(missing > 1e-9) == 7
    told(filled, "2 gaps", "straight lines")
    longest = prepare(run, choice, gaps="longest")
    assert float(longest.record.times[-1]) == pytest.approx(1.99) and float(longest.record.times[0]) == pytest.approx(
        1.24
    )
    prepare(run, choice, start=0.0, stop=0.6)
    kept[120:160] = False
    with pytest.raises(InputError, match="only up to 10 samples are filled"):
        prepare(measured(x=(t[kept], values[kept], "m")), choice, gaps="fill")


def test_jittering_clock():
    t = even(1000.0)
    jittered = t + 3e-4 * RNG.uniform(-1, 1, t.size)
    result = prepare(measured(x=(jittered, wave(jittered), "m")), {"x": ChannelChoice("x")})
    times = np.asarray(result.record.times)
    assert np.ptp(np.diff(times)) < 1e-9
    assert np.max(np.abs(np.asarray(result.record.channel("x")) - wave(times))) < 1e-4
    told(result, "cubic splines")


def test_coarse_stamps_and_repeated_times():
    t = even(4000.0, 0.5)
    result = prepare(measured(x=(np.floor(t * 1000) / 1000, wave(t), "m")), {"x": ChannelChoice("x")})
    assert float(result.record.sample_rate) == pytest.approx(4000.0, rel=1e-4)
    told(result, "coarser")
    t = even(100.0)
    result = prepare(measured(x=(np.insert(t, 50, t[50]), np.insert(wave(t), 50, 0.0), "m")), {"x": ChannelChoice("x")})
    told(result, "1 samples with the time of the one before")


def test_time_by_name_and_rate():
    t = even(100.0)
    run = measured(clock=(None, 1e3 * t, ""), x=(None, wave(t), "m"))
    record = prepare(run, {"x": ChannelChoice("x")}, time=("clock", "ms")).record
    np.testing.assert_allclose(record.times, t, atol=1e-12)
    assert float(prepare(run, {"x": ChannelChoice("x")}, rate=50.0).record.sample_rate) == pytest.approx(50.0)
    with pytest.raises(InputError, match=r"no time axis.*rate"):
        prepare(run, {"x": ChannelChoice("x")})


def test_detrend():
    t = even(100.0)
    run = measured(x=(t, wave(t) + 3 + 2 * t, "m"))
    record = prepare(run, {"a": ChannelChoice("x", detrend="mean"), "b": ChannelChoice("x", detrend="linear")}).record
    assert abs(float(np.mean(record.channel("a")))) < 1e-12
    slope = np.polyfit(t, np.asarray(record.channel("b")), 1)
    assert np.max(np.abs(slope)) < 1e-12


@settings(max_examples=20, deadline=None)
@given(delay=st.floats(-0.05, 0.05), rate=st.floats(200.0, 2000.0))
def test_any_delay_is_taken_back(delay, rate):
    t = even(500.0)
    run = measured(x=(t, wave(t - delay), "m"), y=(t, wave(t), "m"))
    record = prepare(run, {"x": ChannelChoice("x", delay=delay), "y": ChannelChoice("y")}, rate=rate).record
    difference = np.asarray(record.channel("x")) - np.asarray(record.channel("y"))
    middle = slice(int(0.3 * rate), -int(0.3 * rate))
    assert np.max(np.abs(difference[middle])) < 2e-3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (dict(channels={"x": ChannelChoice("X_ist")}), "no channel 'X_ist'"),
        (dict(channels={"x": ChannelChoice("x", "N", "m")}), "'N'"),
        (dict(channels={"x": ChannelChoice("bare")}), "no unit"),
        (dict(channels={}), "No channel"),
        (dict(start=5.0), "share no time"),
        (dict(rate=-1.0), "rate must be"),
        (dict(channels={"x": ChannelChoice("back")}), "run backwards"),
        (dict(channels={"x": ChannelChoice("short")}), "at least 8"),
    ],
)
def test_what_cannot_be_prepared(arguments, words):
    t = even(100.0)
    run = measured(x=(t, wave(t), "m"), bare=(t, wave(t), ""), back=(np.roll(t, 5), t, "m"), short=(t[:3], t[:3], "m"))
    with pytest.raises(InputError) as caught:
        prepare(run, **({"channels": {"x": ChannelChoice("x")}} | arguments))
    assert words in str(caught.value)
