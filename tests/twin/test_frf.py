"""Frequency responses from periodic records: exact where they must be, with a variance that is right on average."""

import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.frf import FRF, local_polynomial_variance
from twin.periodic import distortion_level, periodic_frf, periodic_spectra
from twin.record import Record

RATE, PERIOD = 1000.0, 200
LINES = np.arange(1, 40, 2)
FREQUENCY = LINES * RATE / PERIOD


def response(frequency):
    """A lightly damped second-order lag with a delay."""
    s = 2j * np.pi * frequency
    return np.exp(-1e-3 * s) / (s**2 / 600.0**2 + 0.1 * s / 600.0 + 1)


def periodic(amplitudes, periods):
    spectrum = np.zeros(PERIOD // 2 + 1, dtype=complex)
    spectrum[LINES] = amplitudes * PERIOD / 2
    return np.tile(np.fft.irfft(spectrum, PERIOD), periods)


def excitation():
    return np.exp(1j * np.pi * LINES**2 / LINES.size)


def record_of(u, y, rate=RATE, **more):
    channels = {"torque": u, "angle": y, **more}
    return Record.create(np.arange(len(u)) / rate, channels, {name: "1" for name in channels})


def simulated(periods=8, drift=0.0):
    u = periodic(excitation(), periods)
    y = periodic(response(FREQUENCY) * excitation(), periods)
    return u, y + drift * np.arange(y.size) / y.size


def spectra_of(u, y, **options):
    return periodic_spectra(record_of(u, y), ("torque", "angle"), PERIOD, FREQUENCY, **options)


@pytest.mark.parametrize("detrend", ["ramp", "none"])
def test_a_periodic_record_gives_the_exact_response(detrend):
    frf = periodic_frf(spectra_of(*simulated(), detrend=detrend), "torque", ("angle",))
    np.testing.assert_allclose(frf["angle", "torque"], response(FREQUENCY), rtol=1e-10)
    np.testing.assert_allclose(frf.frequency, FREQUENCY, rtol=1e-12)
    assert np.all(np.asarray(frf.variance) < 1e-20)


def test_spectra_are_amplitudes():
    spectra = spectra_of(*simulated(), detrend="none")
    np.testing.assert_allclose(spectra["torque"], np.tile(excitation(), (8, 1)), rtol=1e-10)


def test_the_ramp_takes_a_drift_out_exactly():
    u, y = simulated(drift=50.0)
    exact = periodic_frf(spectra_of(u, y), "torque", ("angle",))
    np.testing.assert_allclose(exact["angle", "torque"], response(FREQUENCY), rtol=1e-9)
    leaking = periodic_frf(spectra_of(u, y, detrend="none"), "torque", ("angle",))
    assert np.abs(leaking["angle", "torque"] / response(FREQUENCY) - 1).max() > 0.1


def test_windows_are_laid_back_from_the_end_and_counted_from_the_first_complete_one():
    u, y = simulated()
    assert spectra_of(u, y).used == tuple(range(7))  # one period gives its place to the closing sample
    assert spectra_of(u, y, skip=3).used == (3, 4, 5, 6)
    assert spectra_of(u, y, detrend="none").used == tuple(range(8))
    spoilt = y.copy()
    spoilt[: PERIOD - 1] += 5.0
    frf = periodic_frf(spectra_of(u, spoilt), "torque", ("angle",))
    np.testing.assert_allclose(frf["angle", "torque"], response(FREQUENCY), rtol=1e-10)


def test_disturbed_periods_are_left_out_and_named():
    u, y = simulated(12)
    noise = np.random.default_rng(1)
    y = y + 1e-4 * noise.standard_normal(y.size)
    y[int(5.5 * PERIOD) :] += 0.1  # a jump in period 5 of the record, number 4 from the first complete window
    spectra = spectra_of(u, y, skip=1)
    assert spectra.rejected == (4,)
    assert spectra.used == (1, 2, 3, 5, 6, 7, 8, 9, 10)
    clean = periodic_frf(spectra, "torque", ("angle",))
    every = periodic_frf(spectra_of(u, y, skip=1, disturbed_above=None), "torque", ("angle",))
    truth = response(FREQUENCY)
    assert np.abs(clean["angle", "torque"] - truth).max() < 0.1 * np.abs(every["angle", "torque"] - truth).max()


def test_variance_is_right_on_average_with_noise_on_both_channels():
    """Input and output share part of their noise: leaving out the covariance would be wrong by a factor of two."""
    draws, periods = 300, 8
    noise = np.random.default_rng(2)
    u, y = simulated(periods)
    values, variances = [], []
    for _ in range(draws):
        common, own = 0.3 * noise.standard_normal((2, u.size))
        frf = periodic_frf(spectra_of(u + common, y + common + own, detrend="none"), "torque", ("angle",))
        values.append(np.asarray(frf["angle", "torque"]))
        variances.append(np.asarray(frf.variance[0, 0]))
    seen = np.mean(np.abs(np.array(values) - np.mean(values, axis=0)) ** 2, axis=0)
    ratio = np.mean(variances, axis=0) / seen
    assert ratio.mean() == pytest.approx(1.0, abs=0.05)
    assert np.all(np.abs(ratio - 1) < 6 / np.sqrt(draws))
    bias = np.abs(np.mean(values, axis=0) - response(FREQUENCY))
    assert np.all(bias < 5 * np.sqrt(seen / draws))


def smooth_frf(noise=0.0, seed=0, count=101):
    frequency = np.linspace(50.0, 150.0, count)
    x = frequency / 100
    values = (1 + 0.5j) * x**2 - 3 * x + 2j
    draw = np.random.default_rng(seed).standard_normal((2, count))
    return FRF(
        jnp.asarray(frequency),
        jnp.asarray(values + noise * (draw[0] + 1j * draw[1]) / np.sqrt(2))[None, None],
        ("y",),
        ("u",),
    )


def test_local_polynomial_variance_vanishes_for_a_polynomial():
    assert np.all(np.asarray(local_polynomial_variance(smooth_frf())) < 1e-24)


def test_local_polynomial_variance_is_unbiased():
    found = [local_polynomial_variance(smooth_frf(0.2, seed))[0, 0] for seed in range(40)]
    assert np.mean(found) == pytest.approx(0.04, rel=0.05)
    ends = np.mean(found, axis=0)[[0, 1, 2, -3, -2, -1]]
    assert np.all(np.abs(ends / 0.04 - 1) < 0.5)


def test_distortion_is_read_at_the_silent_lines():
    """A cubic nonlinearity puts lines where none were excited; a linear system does not."""
    excited, silent = FREQUENCY[::2], FREQUENCY[1::2]
    amplitudes = np.where(np.isin(FREQUENCY, excited), excitation(), 0)
    u, linear = periodic(amplitudes, 4), periodic(response(FREQUENCY) * amplitudes, 4)

    def level(y):
        record = record_of(u, y)
        parts = [periodic_spectra(record, ("torque", "angle"), PERIOD, f) for f in (silent, excited)]
        return np.asarray(distortion_level(*parts, response(silent)[None], "torque", ("angle",)))

    assert np.all(level(linear) < 1e-9)
    assert np.median(level(linear + 1e-3 * linear**3)) > 1e-4


def test_lines_can_be_chosen_and_variances_replaced():
    frf = smooth_frf()
    part = frf.with_variance(np.ones((1, 1, 101))).between(60.0, 70.0)
    assert part.frequency[0] == 60
    assert part.frequency[-1] == 70
    assert part.variance.shape == (1, 1, 11)
    with pytest.raises(InputError, match="No line lies between"):
        frf.between(1.0, 2.0)
    with pytest.raises(InputError, match="variance has shape"):
        frf.with_variance(np.ones(101))
    with pytest.raises(InputError, match="has no variance"):
        frf.standard_deviation("y", "u")
    with pytest.raises(InputError, match="No response of 'x'"):
        frf["x", "u"]


def test_unusable_input_is_named():
    u, y = simulated()
    with pytest.raises(InputError, match="fewer than two"):
        spectra_of(u[: 2 * PERIOD], y[: 2 * PERIOD])
    with pytest.raises(InputError, match="fewer than two"):
        spectra_of(u, y, skip=6)
    with pytest.raises(InputError, match="fewer than two"):
        spectra_of(u, y, skip=-1)
    record = record_of(u, y)
    with pytest.raises(InputError, match="below half the sample rate, 500 Hz"):
        periodic_spectra(record, ("torque", "angle"), PERIOD, np.array([100.0, 500.0]))
    with pytest.raises(InputError, match="no channel 'current'"):
        periodic_spectra(record, ("current", "angle"), PERIOD, FREQUENCY)
    with pytest.raises(InputError, match="not a whole number"):
        periodic_spectra(record, ("torque", "angle"), PERIOD + 1, FREQUENCY)
    with pytest.raises(InputError, match="not a whole number"):
        periodic_spectra(record_of(u, y, rate=1.01 * RATE), ("torque", "angle"), PERIOD, FREQUENCY)
    with pytest.raises(InputError, match="increase strictly"):
        periodic_spectra(record, ("torque", "angle"), PERIOD, FREQUENCY[::-1])
    with pytest.raises(InputError, match="No spectrum of 'speed'"):
        periodic_frf(spectra_of(u, y), "torque", ("speed",))
    with pytest.raises(InputError, match="is zero at 20 of 20 lines"):
        periodic_frf(spectra_of(0 * u, y), "torque", ("angle",))
    with pytest.raises(InputError, match="detrend must be"):
        spectra_of(u, y, detrend="line")


def test_uneven_sampling_is_refused():
    u, y = simulated()
    times = np.arange(u.size) / RATE
    times[100:] += 0.4 / RATE
    record = Record.create(times, {"torque": u, "angle": y}, {"torque": "1", "angle": "1"})
    with pytest.raises(InputError, match="not sampled uniformly"):
        periodic_spectra(record, ("torque", "angle"), PERIOD, FREQUENCY)


def test_unusable_local_polynomials_are_named():
    with pytest.raises(InputError, match="must be odd"):
        local_polynomial_variance(smooth_frf(), lines=6)
    with pytest.raises(InputError, match="at least order"):
        local_polynomial_variance(smooth_frf(), lines=3)
    with pytest.raises(InputError, match="the response has 5"):
        local_polynomial_variance(smooth_frf(count=5))
