"""Sampled raw inputs: linear and held, in any structure."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.references import SampledSignal


class _Inputs(NamedTuple):
    command: jax.Array
    load: jax.Array


TIMES = 0.1 + 0.01 * np.arange(40)
UNEVEN = np.cumsum(np.random.default_rng(1).uniform(1e-3, 2e-2, 40))
VALUES = _Inputs(np.sin(9 * TIMES), np.stack([TIMES, TIMES**2], axis=1))
_AT = jax.jit(lambda signal, t: jax.vmap(signal)(t))


@pytest.mark.parametrize("interpolation", ["linear", "hold"])
@pytest.mark.parametrize("times", [TIMES, UNEVEN])
def test_is_exactly_the_sample_at_sample_times(times, interpolation):
    read = _AT(SampledSignal(times, VALUES, interpolation=interpolation), times)
    assert isinstance(read, _Inputs)
    np.testing.assert_array_equal(read.command, VALUES.command)
    np.testing.assert_array_equal(read.load, VALUES.load)


@pytest.mark.parametrize("times", [TIMES, UNEVEN])
def test_linear_is_numpys_interpolation(times):
    t = np.linspace(times[0] - 0.1, times[-1] + 0.1, 401)
    read = _AT(SampledSignal(times, VALUES), t)
    np.testing.assert_allclose(read.command, np.interp(t, times, VALUES.command), atol=1e-13)
    np.testing.assert_allclose(read.load[:, 1], np.interp(t, times, VALUES.load[:, 1]), atol=1e-13)


@pytest.mark.parametrize("times", [TIMES, UNEVEN])
def test_hold_keeps_each_sample_until_the_next(times):
    signal = SampledSignal(times, {"force": VALUES.command}, interpolation="hold")
    just_before = _AT(signal, np.nextafter(times, 0))["force"]
    np.testing.assert_array_equal(just_before, VALUES.command[[0, *range(39)]])
    middle = _AT(signal, times[:-1] + 0.5 * np.diff(times))["force"]
    np.testing.assert_array_equal(middle, VALUES.command[:-1])
    np.testing.assert_array_equal(_AT(signal, np.array([-5.0, 5.0]))["force"], VALUES.command[[0, -1]])


def test_switching_times():
    np.testing.assert_array_equal(SampledSignal(TIMES, VALUES).switching_times(), TIMES[[0, -1]])
    np.testing.assert_array_equal(SampledSignal(TIMES, VALUES, switch_at_samples=True).switching_times(), TIMES)
    np.testing.assert_array_equal(SampledSignal(TIMES, VALUES, interpolation="hold").switching_times(), TIMES)


def test_is_differentiable_with_respect_to_its_values():
    def read(values):
        return SampledSignal(jnp.array([0.0, 1.0, 2.0]), values)(1.25)

    np.testing.assert_allclose(jax.jacrev(read)(jnp.array([3.0, 4.0, 5.0])), [0, 0.75, 0.25])


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"times": TIMES[::-1]}, "times"),
        ({"values": {"force": np.zeros(3)}}, "force"),
        ({"values": {"force": np.full(40, np.nan)}}, "force"),
        ({"values": {"force": 1.0}}, "force"),
        ({"interpolation": "cubic"}, "interpolation"),
    ],
)
def test_bad_input_is_named(arguments, named):
    with pytest.raises(InputError, match=named):
        SampledSignal(**({"times": TIMES, "values": VALUES} | arguments))
