"""Repeats of a record: their mean and its deviation, periods as repeats, and repeats that do not belong together."""

import numpy as np
import pytest

from twin._checks import InputError
from twin.record import Record
from twin.repeats import repeated, split_periods

TIMES = np.arange(400) * 1e-3
UNITS = {"velocity": "m/s", "force": "N", "command": "V"}


def repeats(count, seed=0, growth=0.0):
    rng = np.random.default_rng(seed)
    scale = 1 + growth * TIMES / TIMES[-1]
    return [
        Record.create(
            TIMES,
            {
                "velocity": np.sin(30 * TIMES) + 0.01 * scale * rng.standard_normal(TIMES.size),
                "force": 5 * np.cos(30 * TIMES) + 2.0 * rng.standard_normal(TIMES.size),
                "command": np.sign(np.sin(30 * TIMES)),
            },
            UNITS,
        )
        for _ in range(count)
    ]


def test_mean_and_its_deviation():
    found = repeated(repeats(9), channels=["velocity", "force"])
    assert found.repeats == 9
    assert set(found.deviation) == {"velocity", "force"}
    assert set(found.mean.channels) == set(UNITS)
    assert float(found.deviation["velocity"]) == pytest.approx(0.01 / 3, rel=0.05)
    assert float(found.deviation["force"]) == pytest.approx(2.0 / 3, rel=0.05)
    error = np.asarray(found.mean.channel("force")) - 5 * np.cos(30 * TIMES)
    assert np.mean((error / float(found.deviation["force"])) ** 2) == pytest.approx(1.0, abs=0.2)


def test_a_deviation_for_each_sample_follows_the_noise():
    sd = np.asarray(repeated(repeats(200, growth=3.0), channels=["velocity"], each_sample=True).deviation["velocity"])
    np.testing.assert_allclose(sd * np.sqrt(200), 0.01 * (1 + 3 * TIMES / TIMES[-1]), rtol=0.3)


def test_periods_are_repeats():
    first = repeats(1)[0]
    whole = np.tile(np.asarray(first.channel("velocity")), 4)[30:]
    record = Record.create(np.arange(whole.size) * 1e-3, {"velocity": whole}, {"velocity": "m/s"})
    periods = split_periods(record, 400)
    assert len(periods) == 3
    for period in periods:
        np.testing.assert_array_equal(period.channel("velocity"), first.channel("velocity"))
        np.testing.assert_array_equal(period.times, record.times[-400:])
    assert len(split_periods(record, 400, skip=1)) == 2


def changed(record, **changes):
    fields = {"times": record.times, "channels": record.channels, "units": record.units, **changes}
    return Record.create(**fields)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda r: repeated(r[:1]), "a deviation from repeats takes at least 2 records, but there are 1"),
        (lambda r: repeated(r, each_sample=True), "weights for each sample from repeats takes at least 6"),
        (lambda r: repeated([r[0], r[1].slice(0.0, 0.3)]), "repeat 1 has 300 samples, the first 400"),
        (lambda r: repeated([r[0], changed(r[1], times=TIMES + 0.01)]), "sampled at other times: sample"),
        (lambda r: repeated([r[0], changed(r[1], units={**UNITS, "force": "N m"})]), "units"),
        (lambda r: repeated(r), "channel 'command' has samples that are the same in all 3 repeats"),
        (lambda r: repeated(r, channels=["current"]), "no channel 'current'"),
        (lambda r: split_periods(r[0], 300), "no two periods"),
        (lambda r: split_periods(r[0], 100, skip=3), "no two periods"),
        (lambda r: split_periods(r[0], 4), "period_samples = 4"),
    ],
)
def test_repeats_that_do_not_belong_together_are_refused(make, said):
    with pytest.raises(InputError, match=said):
        make(repeats(3))
