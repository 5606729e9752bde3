"""Sampled motions: exact at the samples, consistent between them, correct at the edges."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.references import MotionPoint, SampledReference

RANDOM = np.random.default_rng(3)
EVEN = 0.3 + 0.001 * np.arange(60)
GRIDS = {
    "even": EVEN,
    "jitter": EVEN + 1e-4 * RANDOM.uniform(-1, 1, EVEN.size),
    "uneven": np.cumsum(RANDOM.uniform(1e-4, 3e-3, 60)),
}
_AT = jax.jit(lambda reference, t: jax.vmap(reference)(t))


def _record(grid):
    times = GRIDS[grid]
    return times, RANDOM.normal(size=times.size), RANDOM.normal(size=times.size), RANDOM.normal(size=times.size)


@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
@pytest.mark.parametrize("grid", GRIDS)
def test_is_exactly_the_sample_at_sample_times(grid, interpolation):
    times, *channels = _record(grid)
    reference = SampledReference(times, *channels, interpolation=interpolation)
    assert reference.uniform == (grid != "uneven")
    for read, sampled in zip(_AT(reference, times), channels, strict=True):
        np.testing.assert_array_equal(read, sampled)


@pytest.mark.parametrize("grid", GRIDS)
def test_linear_is_numpys_interpolation(grid):
    times, *channels = _record(grid)
    reference = SampledReference(times, *channels, interpolation="linear")
    # Also the neighbouring numbers of each sample time, where a computed index is most easily wrong.
    t = np.concatenate([np.linspace(times[0], times[-1], 997), np.nextafter(times[1:], 0), np.nextafter(times[:-1], 9)])
    for read, sampled in zip(_AT(reference, t), channels, strict=True):
        np.testing.assert_allclose(read, np.interp(t, times, sampled), atol=1e-12)


@pytest.mark.parametrize("grid", GRIDS)
def test_cubic_velocity_is_the_derivative_of_position(grid):
    reference = SampledReference(*_record(grid))
    t = jnp.linspace(GRIDS[grid][0] + 1e-5, GRIDS[grid][-1] - 1e-5, 503)
    slope = jax.jit(jax.vmap(jax.grad(lambda t: reference(t).position)))(t)
    np.testing.assert_allclose(slope, _AT(reference, t).velocity, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("grid", GRIDS)
def test_differences_are_exact_for_a_parabola(grid):
    times = GRIDS[grid]
    reference = SampledReference(times, 3 * times**2 - times)
    np.testing.assert_allclose(reference.velocity, 6 * times - 1, atol=1e-8)
    t = np.linspace(times[0], times[-1], 301)
    point = _AT(reference, t)
    np.testing.assert_allclose(point.position, 3 * t**2 - t, atol=1e-12)
    np.testing.assert_allclose(point.acceleration, 6.0, atol=1e-4)


def test_converges_with_the_order_of_its_interpolation():
    def error(samples, interpolation):
        times = np.linspace(0.0, 1.0, samples)
        reference = SampledReference(times, np.sin(7 * times), 7 * np.cos(7 * times), interpolation=interpolation)
        t = np.linspace(0.0, 1.0, 777)
        return np.max(np.abs(_AT(reference, t).position - np.sin(7 * t)))

    assert np.log2(error(41, "cubic") / error(81, "cubic")) == pytest.approx(4, abs=0.2)
    assert np.log2(error(41, "linear") / error(81, "linear")) == pytest.approx(2, abs=0.2)


@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
@pytest.mark.parametrize("grid", GRIDS)
def test_stands_still_outside(grid, interpolation):
    times, *channels = _record(grid)
    reference = SampledReference(times, *channels, interpolation=interpolation)
    point = _AT(reference, np.array([-1e300, times[0] - 1e-6, times[-1] + 1e-6, 1e300]))
    assert isinstance(point, MotionPoint)
    np.testing.assert_array_equal(point.position, channels[0][[0, 0, -1, -1]])
    np.testing.assert_array_equal(point.velocity, 0)
    np.testing.assert_array_equal(point.acceleration, 0)


def test_follows_its_samples_differentiably():
    times, position, *_ = _record("even")

    @jax.jit
    @jax.jacfwd
    def slopes(position):
        return SampledReference(jnp.asarray(times), position)(times[20] + 4e-4)

    by_position = slopes(jnp.asarray(position))
    assert all(np.all(np.isfinite(s)) for s in by_position)
    assert float(jnp.sum(by_position.position)) == pytest.approx(1.0)
    assert float(jnp.sum(by_position.velocity)) == pytest.approx(0.0, abs=1e-9)


def test_two_samples():
    reference = SampledReference(np.array([1.0, 2.0]), np.array([0.0, 4.0]))
    assert [float(x) for x in reference(1.5)] == pytest.approx([2.0, 4.0, 0.0])


def test_switching_times():
    times, position, *_ = _record("even")
    np.testing.assert_array_equal(SampledReference(times, position).switching_times(), times[[0, -1]])
    np.testing.assert_array_equal(SampledReference(times, position, switch_at_samples=True).switching_times(), times)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"times": np.array([0.0, 1.0, 1.0])}, "times"),
        ({"times": np.array([0.0])}, "times"),
        ({"times": np.array([0.0, np.nan, 1.0])}, "times"),
        ({"position": np.zeros(4)}, "position"),
        ({"position": np.array([0.0, np.inf, 0.0])}, "position"),
        ({"velocity": np.zeros(2)}, "velocity"),
        ({"acceleration": np.array([0.0, np.nan, 0.0])}, "acceleration"),
        ({"interpolation": "quintic"}, "interpolation"),
    ],
)
def test_bad_input_is_named(change, named):
    arguments = {"times": np.array([0.0, 1.0, 2.0]), "position": np.zeros(3)} | change
    with pytest.raises(InputError, match=named):
        SampledReference(**arguments)
