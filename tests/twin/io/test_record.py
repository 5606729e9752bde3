import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.record import Record

TIMES = np.arange(20) * 0.1


def make(times=TIMES, values=None, unit="m", **more):
    values = np.sin(times) if values is None else values
    return Record.create(
        times, {"position": values, **more}, {"position": unit, **dict.fromkeys(more, "V")}, name="run 7"
    )


def refuses(*words, **arguments):
    with pytest.raises(InputError) as caught:
        make(**arguments)
    for word in ("run 7", *words):
        assert word in str(caught.value)


def test_holds_channels_units_and_sampling():
    record = make(voltage=np.ones(20))
    assert record.times.dtype == jnp.float64
    assert record.units == {"position": "m", "voltage": "V"}
    assert float(record.sample_period) == pytest.approx(0.1)
    assert float(record.sample_rate) == pytest.approx(10.0)
    np.testing.assert_array_equal(record.channel("position"), np.sin(TIMES))


def test_too_short():
    refuses("7 samples", "at least 8", times=TIMES[:7])


@pytest.mark.parametrize("index, value", [(5, 0.4), (5, 0.3)])
def test_times_that_do_not_increase(index, value):
    times = TIMES.copy()
    times[index] = value
    refuses("increase strictly", f"index {index}", times=times)


def test_times_not_finite():
    refuses("finite", "index 3", times=np.where(np.arange(20) == 3, np.nan, TIMES))


def test_gap_is_located():
    times = np.delete(TIMES, [7, 8])
    refuses("1 gap", "after t = 0.6 s", "lasts 0.3 s", "Split", "resample", times=times)


def test_jitter_is_no_gap():
    make(times=TIMES + 0.009 * (-1.0) ** np.arange(20))


def test_length_of_channel():
    refuses("'position'", "19 samples", "20", values=np.zeros(19))


def test_nan_and_inf_are_counted():
    values = np.zeros(20)
    values[[4, 9]] = np.nan, np.inf
    refuses("'position'", "2 of 20", "index 4", values=values)


def test_channel_that_is_no_vector():
    refuses("'position'", "(20, 1)", values=np.zeros((20, 1)))


def test_channel_that_is_no_number():
    refuses("'position'", "numbers", values=["x"] * 20)


@pytest.mark.parametrize("unit", ["mm", "rpm", "", "g", "furlong", "m#", "%"])
def test_unit_that_is_not_si(unit):
    refuses("'position'", repr(unit), "to_si", unit=unit)


@pytest.mark.parametrize("unit", ["1", "m", "m/s^2", "N m/rad", "V/(m/s)", "kg m²", "N*s/m", "rad/s**2"])
def test_unit_that_is_si(unit):
    assert make(unit=unit).units["position"] == unit


def test_missing_and_surplus_units():
    with pytest.raises(InputError, match="no unit for channel 'a'"):
        Record.create(TIMES, {"a": TIMES}, {})
    with pytest.raises(InputError, match=r"unit for 'b'.*it has a"):
        Record.create(TIMES, {"a": TIMES}, {"a": "m", "b": "m"})


def test_unknown_channel_lists_those_there_are():
    with pytest.raises(InputError, match="no channel 'force'; it has position, voltage"):
        make(voltage=np.ones(20)).channel("force")


def test_slices_adjoin():
    # 3 * 0.1 is a little more than 0.3: rounding must not lose or double a sample.
    record = make()
    first, second = record.slice(None, 0.9), record.slice(0.9, None)
    assert first.times.size == 9 and second.times.size == 11
    np.testing.assert_array_equal(jnp.concatenate([first.times, second.times]), record.times)
    assert second.units == record.units


def test_slice_outside():
    with pytest.raises(InputError, match=r"leaves 0 samples.*from 0 s to 1\.9 s"):
        make().slice(5.0, 6.0)


def test_decimate():
    record = make().decimate(2)
    np.testing.assert_array_equal(record.times, TIMES[::2])
    assert float(record.sample_period) == pytest.approx(0.2)


@pytest.mark.parametrize("n", [0, -1, 3])
def test_decimate_refuses(n):
    with pytest.raises(InputError, match=f"between 1 and 2, .*is {n}"):
        make().decimate(n)


def test_with_channel():
    record = make().with_channel("speed", np.cos(TIMES), "m/s")
    assert record.units == {"position": "m", "speed": "m/s"}
    with pytest.raises(InputError, match=r"'speed'.*3 samples"):
        record.with_channel("speed", np.zeros(3), "m/s")


def test_passes_through_jit_and_grad():
    # The units are part of the tree's structure and must be hashable.
    record = make()
    energy = eqx.filter_jit(lambda each: jnp.sum(each.channel("position") ** 2) / each.sample_rate)
    assert float(energy(record)) == pytest.approx(0.1 * np.sum(np.sin(TIMES) ** 2))
    gradient = jax.jit(jax.grad(lambda each: jnp.sum(each.channel("position") ** 2)))(record)
    np.testing.assert_allclose(gradient.channel("position"), 2 * np.sin(TIMES))
