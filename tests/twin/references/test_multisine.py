"""Multisines: exact position, the spectrum asked for, low peaks."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.references import Multisine

LINES = np.arange(1, 60, 2)
RATE = 256.0


def sampled(multisine, periods=1):
    return jax.jit(jax.vmap(multisine))(np.arange(int(RATE * 2 * periods)) / RATE)


def example(**changes):
    return Multisine.schroeder(0.5, LINES, 0.01, **({"start_time": 0.3, "start_position": 2.0} | changes))


def test_position_velocity_and_acceleration_are_one_motion():
    multisine = example()
    t = np.linspace(-1, 3, 101)
    path = jax.vmap(multisine)(t)
    velocity, acceleration = jax.vmap(lambda at: jax.jvp(lambda s: multisine(s)[:2], (at,), (jnp.ones(()),))[1])(t)
    np.testing.assert_allclose(velocity, path.velocity, atol=1e-14)
    np.testing.assert_allclose(acceleration, path.acceleration, atol=1e-12)
    nodes, weights = np.polynomial.legendre.leggauss(200)
    travelled = 0.5 * weights @ np.asarray(jax.vmap(multisine)(0.5 * (nodes + 1)).velocity)
    assert float(multisine(1.0).position - multisine(0.0).position) == pytest.approx(travelled, abs=1e-14)


def test_starts_at_its_start_position_and_repeats():
    multisine = example()
    assert float(multisine(0.3).position) == 2.0
    assert float(multisine.period()) == 2.0
    for first, later in zip(multisine(0.8), multisine(0.8 + 10.0), strict=True):
        assert float(later) == pytest.approx(float(first), rel=1e-10)
    assert multisine.switching_times().shape == (0,)


@pytest.mark.parametrize("made", ["schroeder", "random"])
def test_the_spectrum_is_flat_at_the_lines_and_nothing_elsewhere(made):
    multisine = (
        Multisine.random_phase(0.5, LINES, 0.01, 4) if made == "random" else Multisine.schroeder(0.5, LINES, 0.01)
    )
    velocity = np.asarray(sampled(multisine).velocity)
    assert np.sqrt(np.mean(velocity**2)) == pytest.approx(0.01, rel=1e-12)
    amplitude = np.abs(np.fft.rfft(velocity)) * 2 / velocity.size
    np.testing.assert_allclose(amplitude[LINES], 0.01 * np.sqrt(2 / LINES.size), rtol=1e-10)
    assert np.delete(amplitude, LINES).max() < 1e-15
    np.testing.assert_allclose(multisine.frequencies(), 0.5 * LINES)


def crest_factor(multisine):
    velocity = np.asarray(sampled(multisine).velocity)
    return np.abs(velocity).max() / np.sqrt(np.mean(velocity**2))


def test_schroeders_phases_keep_the_peaks_low():
    lines = np.arange(1, 60)
    random = [crest_factor(Multisine.random_phase(0.5, lines, 0.01, seed)) for seed in range(4)]
    assert crest_factor(Multisine.schroeder(0.5, lines, 0.01)) < 1.8 < min(random)


def test_a_seed_gives_the_same_phases_again():
    one, again, other = (Multisine.random_phase(0.5, LINES, 0.01, seed).phase for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).max() > 0.1


def test_mirrored_amplitudes_mirror_the_motion():
    there, back = (sampled(Multisine(0.5, LINES, a, 0.7)) for a in (0.2, -0.2))
    for one, other in zip(there, back, strict=True):
        np.testing.assert_array_equal(one, -other)


def test_derivatives_with_respect_to_every_parameter():
    at = jnp.array([0.2, 0.7])

    @jax.jit
    def read(p):
        multisine = Multisine(p[0], (1, 2, 7), p[1:4], p[4:7], start_time=p[7], start_position=p[8])
        return jnp.stack(jax.vmap(multisine)(at))

    p = jnp.array([0.5, 0.1, 0.2, -0.1, 0.3, 2.0, 1.0, 0.4, 1.0])
    exact = jax.jit(jax.jacfwd(read))(p)
    for i in range(p.size):
        by_difference = (read(p.at[i].add(1e-6)) - read(p.at[i].add(-1e-6))) / 2e-6
        np.testing.assert_allclose(exact[..., i], by_difference, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"base_frequency": 0.0}, "base_frequency must be positive"),
        ({"base_frequency": -1.0}, "base_frequency must be positive"),
        ({"lines": np.array([1, 2.5])}, r"lines\[1\] is 2.5"),
        ({"lines": [0, 1]}, r"lines\[0\] is 0"),
        ({"lines": np.array([1, np.nan])}, r"lines\[1\] is nan"),
        ({"lines": [2, 1]}, "lines must increase"),
        ({"lines": []}, "Give some lines"),
        ({"amplitude": np.ones(3)}, "amplitude has shape"),
        ({"amplitude": np.nan}, "amplitude must be finite"),
        ({"phase": np.ones(3)}, "phase has shape"),
        ({"phase": np.inf}, "phase must be finite"),
        ({"start_time": np.nan}, "start_time must be finite"),
        ({"start_position": np.nan}, "start_position must be finite"),
    ],
)
def test_bad_input_is_named(arguments, named):
    with pytest.raises(InputError, match=named):
        Multisine(**({"base_frequency": 0.5, "lines": [1, 2], "amplitude": 0.1, "phase": 0.0} | arguments))


def test_bad_input_of_the_constructors_is_named():
    with pytest.raises(InputError, match="rms must be positive"):
        Multisine.schroeder(0.5, LINES, 0.0)
    with pytest.raises(InputError, match="Give some lines"):
        Multisine.random_phase(0.5, [], 0.1, 1)
    multisine = Multisine.schroeder(0.5, [1, 20], 0.1)
    multisine.check_sampled(20.1)
    with pytest.raises(InputError, match="the multisine reaches 10 Hz, beyond Nyquist"):
        multisine.check_sampled(20.0)
