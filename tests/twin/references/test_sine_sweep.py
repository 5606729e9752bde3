"""Sine sweeps: one motion in position, velocity and acceleration, at the frequencies asked for."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate

from twin._checks import InputError
from twin.references import ConstantVelocity, SineSweep, SumReference

KINDS = ("linear", "logarithmic")
# Rising, falling, staying, nearly staying, and one that passes from few to many radians per decade.
BANDS = [(0.1, 40.0), (40.0, 0.1), (5.0, 5.0), (5.0, 5.0 + 1e-9), (0.5, 0.6)]
PUBLISHED = {"start_frequency": 0.1, "end_frequency": 400.0, "duration": 60.0, "amplitude": 1e-3}


@jax.jit
def motion(sweep, t):
    return jax.vmap(sweep)(t)


@jax.jit
def rates(sweep, t):
    """Time derivatives of position and velocity."""
    return jax.vmap(lambda at: jax.jvp(lambda s: sweep(s)[:2], (at,), (jnp.ones(()),))[1])(t)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("band", BANDS)
def test_position_velocity_and_acceleration_are_one_motion(kind, band):
    sweep = SineSweep(*band, 4.0, -0.3, start_time=0.5, start_position=2.0, kind=kind)
    t = np.linspace(0.5, 4.4999, 301)
    path = motion(sweep, t)
    velocity, acceleration = rates(sweep, t)
    np.testing.assert_allclose(velocity, path.velocity, atol=1e-11)
    np.testing.assert_allclose(acceleration, path.acceleration, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("band", BANDS)
def test_position_is_the_integral_of_the_velocity(kind, band):
    sweep = SineSweep(*band, 4.0, 1.0, kind=kind)
    nodes, weights = np.polynomial.legendre.leggauss(16)
    edges = np.linspace(0, 4.0, 401)
    middle, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    at = (middle[:, None] + half[:, None] * nodes).ravel()
    pieces = (np.asarray(motion(sweep, at).velocity).reshape(-1, 16) @ weights) * half
    travelled = np.asarray(motion(sweep, edges).position)
    np.testing.assert_allclose(travelled[1:], np.cumsum(pieces), atol=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_the_published_sweep_is_exact_after_a_minute(kind):
    """0.1 to 400 Hz in 60 s: Gauss's rule on 1e5 pieces agrees with the closed form."""
    sweep = SineSweep(**PUBLISHED, kind=kind)
    t = np.linspace(0, 60, 100_001)[:-1]
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = 60 / 100_000 / 2
    at = (t[:, None] + half * (1 + nodes)).ravel()
    travelled = np.cumsum(np.asarray(motion(sweep, at).velocity).reshape(-1, 8) @ weights) * half
    np.testing.assert_allclose(motion(sweep, t[1:]).position, travelled[:-1], rtol=0, atol=1e-15)


@pytest.mark.parametrize("kind", KINDS)
def test_the_phase_turns_at_the_instantaneous_frequency(kind):
    sweep = SineSweep(2.0, 50.0, 3.0, 0.1, start_time=1.0, kind=kind)
    np.testing.assert_allclose([sweep.frequency(t) for t in (0.0, 1.0, 4.0, 9.0)], [2, 2, 50, 50], rtol=1e-12)
    middle = 26.0 if kind == "linear" else 10.0
    assert float(sweep.frequency(2.5)) == pytest.approx(middle, rel=1e-12)
    t = np.linspace(1.001, 3.999, 200)
    path = motion(sweep, t)
    # v² + (a/2πf)² = A² holds only if the frequency that a is made with is that of the sine.
    turned = path.velocity**2 + (path.acceleration / (2 * np.pi * jax.vmap(sweep.frequency)(t))) ** 2
    np.testing.assert_allclose(turned, 0.01, rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_the_power_lies_within_the_band(kind):
    rate = 1000.0
    sweep = SineSweep(20.0, 100.0, 20.0, 1.0, kind=kind)
    velocity = np.asarray(motion(sweep, np.arange(20_000) / rate).velocity)
    power = np.abs(np.fft.rfft(velocity)) ** 2
    f = np.fft.rfftfreq(velocity.size, 1 / rate)
    assert power[(f > 19) & (f < 101)].sum() > 0.995 * power.sum()
    density = [power[(f > low) & (f < low + 10)].mean() for low in (30, 80)]
    assert density[0] / density[1] == pytest.approx(1.0 if kind == "linear" else 80 / 30, rel=0.15)


def test_rests_before_and_after():
    sweep = SineSweep(1.0, 7.3, 2.0, 0.4, start_time=1.0, start_position=0.3)
    before, end, after = sweep(0.2), sweep(3.0), sweep(8.0)
    assert tuple(map(float, before)) == (0.3, 0.0, 0.0)
    assert tuple(map(float, after[1:])) == (0.0, 0.0)
    assert float(after.position) == float(end.position)
    assert float(end.position) == pytest.approx(float(sweep(3.0 - 1e-9).position), abs=1e-8)
    np.testing.assert_array_equal(sweep.switching_times(), [1.0, 3.0])


def test_a_mirrored_amplitude_mirrors_the_motion():
    t = np.linspace(0, 2, 50)
    there, back = (motion(SineSweep(1.0, 9.0, 2.0, a), t) for a in (0.2, -0.2))
    for one, other in zip(there, back, strict=True):
        np.testing.assert_array_equal(one, -other)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("band", [(0.2, 30.0), (30.0, 0.2), (5.0, 5.0)])
def test_derivatives_with_respect_to_every_parameter(kind, band):
    at = jnp.array([0.3, 1.1, 2.6, 4.0])

    @jax.jit
    def read(p):
        return jnp.stack(jax.vmap(SineSweep(*p, kind=kind))(at))

    p = jnp.array([*band, 3.0, 0.2, 0.1, 0.5])
    exact = jax.jit(jax.jacfwd(read))(p)
    for i in range(p.size):
        step = 1e-6 * max(1.0, float(p[i]))
        by_difference = (read(p.at[i].add(step)) - read(p.at[i].add(-step))) / (2 * step)
        scale = np.abs(by_difference).max(axis=1, keepdims=True) + 1e-3
        assert np.all(np.abs(exact[..., i] - by_difference) < 2e-6 * scale), i


def test_a_sweep_from_or_to_zero_hertz_has_finite_derivatives():
    for band in ((0.0, 30.0), (30.0, 0.0)):
        at = jnp.array([0.0, 1.0, 3.0])
        slopes = jax.jit(jax.jacfwd(lambda p, at=at: jnp.stack(motion(SineSweep(*p, 3.0, 0.2), at))))(jnp.array(band))
        assert np.all(np.isfinite(slopes))


def test_on_a_constant_velocity_the_axis_never_turns_back():
    feed = SumReference((ConstantVelocity(5e-3, 0.2), SineSweep(**PUBLISHED, start_time=0.5)))
    path = motion(feed, np.linspace(0.5, 60.4, 5000))
    assert path.velocity.min() >= 4e-3 - 1e-12
    assert path.velocity.max() <= 6e-3 + 1e-12
    np.testing.assert_allclose(feed.switching_times(), [0.0, 0.2, 0.5, 60.5])
    velocity = jax.jit(lambda t: feed(t).velocity)
    travelled, _ = scipy.integrate.quad(lambda t: float(velocity(t)), 0.5, 2.0, epsabs=1e-13, limit=200)
    assert float(feed(2.0).position - feed(0.5).position) == pytest.approx(travelled, abs=1e-12)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"duration": 0.0}, "duration must be positive"),
        ({"duration": -1.0}, "duration must be positive"),
        ({"start_frequency": -1.0}, "start_frequency must not be negative"),
        ({"end_frequency": -1.0}, "end_frequency must not be negative"),
        ({"start_frequency": 0.0, "kind": "logarithmic"}, "start_frequency must be positive"),
        ({"end_frequency": 0.0, "kind": "logarithmic"}, "end_frequency must be positive"),
        ({"start_frequency": 0.0, "end_frequency": 0.0}, "larger of start_frequency and end_frequency"),
        ({"amplitude": np.nan}, "amplitude must be finite"),
        ({"start_time": np.inf}, "start_time must be finite"),
        ({"start_position": np.nan}, "start_position must be finite"),
        ({"kind": "quadratic"}, "kind must be"),
    ],
)
def test_bad_input_is_named(arguments, named):
    with pytest.raises(InputError, match=named):
        SineSweep(**(PUBLISHED | arguments))


def test_a_sweep_beyond_nyquist_is_named():
    sweep = SineSweep(**PUBLISHED)
    sweep.check_sampled(801.0)
    with pytest.raises(InputError, match="the sweep reaches 400 Hz, beyond Nyquist"):
        sweep.check_sampled(800.0)
    with pytest.raises(InputError, match="sample_rate must be positive"):
        sweep.check_sampled(0.0)
