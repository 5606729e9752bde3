"""Evidence from the motion of a table between its motors: zero at the truth, right derivatives, clear refusals."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from driven_table_records import DRIVE, SAMPLES, TRUTH, record

from fitting.identification.preload_direct import motion_space
from fitting.residuals.driven_table import DrivenTableResidual
from twin._checks import InputError
from twin.record import Record

RECORDS = [record(20.0), record(60.0)]
R = float(DRIVE.travel_per_radian)
SPACE = motion_space(play=True)
DEVIATIONS = {"position_deviation": 1e-8, "force_deviation": 5.0}
EVIDENCE = DrivenTableResidual.create(RECORDS, R, settling_time=0.08, **DEVIATIONS)


@eqx.filter_jit
def residual(scaled, evidence=EVIDENCE):
    return evidence(SPACE.unpack(TRUTH, scaled))


PACKED = jnp.asarray(SPACE.pack(TRUTH))


def test_nothing_is_left_at_the_truth():
    """Of an oscillation of 5 µm, sampled 25 times a period, less than half a per cent; and less than a newton."""
    values = residual(PACKED)
    assert values.shape == (EVIDENCE.rows,)
    assert 1e-8 * np.max(np.abs(values[:-2])) < 2e-8
    assert np.max(np.abs(values[-2:])) < 0.2
    moved = np.ptp(np.asarray(EVIDENCE.table_position - 0.02 * EVIDENCE.times), axis=1)
    assert np.min(moved) > 1e-6


def test_rows_and_series_agree():
    values = residual(PACKED)
    series = EVIDENCE.series(values)
    assert series.shape == (2, SAMPLES - 160)
    assert EVIDENCE.rows == series.size + 2
    np.testing.assert_array_equal(series[1], values[SAMPLES - 160 : -2])
    shifted = EVIDENCE.table_position.at[1, 200].add(3e-8)
    other = residual(PACKED, eqx.tree_at(lambda e: e.table_position, EVIDENCE, shifted))
    np.testing.assert_allclose(EVIDENCE.series(other - values)[1, 40], -3.0, rtol=1e-6)


def test_the_force_is_half_the_difference_of_the_torques():
    for found, made in zip(EVIDENCE.preload_force, RECORDS, strict=True):
        difference = np.asarray(made.channel("torque_1") - made.channel("torque_2"))
        half = np.mean(difference[EVIDENCE.settled :]) / 2
        assert float(found) == pytest.approx(half / R, rel=1e-12)


@pytest.mark.slow
def test_derivatives_agree_with_differences():
    away = PACKED + 0.01
    exact = np.asarray(jax.jit(jax.jacfwd(residual))(away))
    for i in range(len(SPACE)):
        h = 1e-4 * jnp.eye(len(SPACE))[i]
        expected = np.asarray(residual(away + h) - residual(away - h)) / 2e-4
        np.testing.assert_allclose(exact[:, i], expected, atol=1e-3 * np.max(np.abs(expected)) + 1e-6)
        assert np.max(np.abs(expected)) > 0


def test_records_may_begin_at_any_time():
    made = RECORDS[0]
    late = Record.create(made.times + 7.0, made.channels, made.units)
    found = DrivenTableResidual.create([late, RECORDS[1]], R, settling_time=0.08, **DEVIATIONS)
    np.testing.assert_allclose(found.times, EVIDENCE.times, atol=1e-12)
    np.testing.assert_allclose(residual(PACKED, found), residual(PACKED), atol=1e-5)


def _make(records=RECORDS, **change):
    return DrivenTableResidual.create(records, R, **{**DEVIATIONS, **change})


def _rate(made, factor):
    return Record.create(made.times * factor, made.channels, made.units, name="slow")


def _less(made):
    channels = {name: values for name, values in made.channels.items() if name != "torque_2"}
    return Record.create(made.times, channels, {name: made.units[name] for name in channels})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: _make([]), "There is no record"),
        (lambda: _make([RECORDS[0], RECORDS[1].slice(0.0, 0.1)]), "different lengths"),
        (lambda: _make([RECORDS[0], _rate(RECORDS[1], 2.0)]), "slow is sampled at other times"),
        (lambda: _make([_less(RECORDS[0])]), "no channel 'torque_2'"),
        (lambda: _make(settling_time=1.0), "settling_time of 1 s is as long"),
        (lambda: _make(position_deviation=0.0), "position_deviation must be positive"),
        (lambda: _make(force_deviation=-1.0), "force_deviation must be positive"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(InputError, match=message):
        make()
