"""Frequency responses from records: the estimators against their definitions, their bias and their scatter."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.signal

from twin._checks import InputError
from twin.frf_estimators import coherence, estimate_frf
from twin.record import Record
from twin.response_estimate import ESTIMATORS, estimate_response

RATE = 2000.0
RNG = np.random.default_rng(3)
NUMERATOR, DENOMINATOR = [0.2, 0.1, 0.05], [1.0, -1.1, 0.5]
SETTINGS = [
    {"window": "hamming", "samples": 1024, "overlap": 717},
    {"window": ("kaiser", 6.0), "samples": 300, "overlap": 0, "detrend": "linear"},
    {"window": np.hamming(511), "samples": 511, "overlap": 300, "detrend": None},
    {"window": "boxcar", "samples": 256, "overlap": 128},
]


def record_of(rate=RATE, **channels):
    length = len(next(iter(channels.values())))
    return Record.create(np.arange(length) / rate, channels, {name: "1" for name in channels})


def noisy_record(length=6000, noise=0.3):
    force, torque = RNG.standard_normal((2, length)) + 4.0
    speed = scipy.signal.lfilter(NUMERATOR, DENOMINATOR, force) + noise * RNG.standard_normal(length)
    angle = np.roll(torque, 3) + noise * RNG.standard_normal(length)
    return record_of(force=force, torque=torque, speed=speed, angle=angle)


def scipy_spectra(x, y, window="hann", samples=256, overlap=128, detrend="constant"):
    options = {"fs": RATE, "window": window, "nperseg": samples, "noverlap": overlap, "detrend": detrend or False}
    f, sxx = scipy.signal.welch(x, **options)
    _, syy = scipy.signal.welch(y, **options)
    return f, sxx, syy, scipy.signal.csd(x, y, **options)[1]


def smallest_eigenvector_response(sxx, syy, sxy):
    """Total least squares by its definition: the direction (X, Y) in which the spectral matrix has least power."""
    matrix = np.moveaxis(np.array([[sxx, np.conj(sxy)], [sxy, syy]]), -1, 0)
    _, vectors = np.linalg.eigh(matrix)
    return -np.conj(vectors[:, 0, 0] / vectors[:, 1, 0])


@pytest.mark.slow
@pytest.mark.parametrize("settings", SETTINGS)
def test_estimators_are_those_of_scipys_spectra(settings):
    record = noisy_record()
    first = 0 if settings.get("detrend", "constant") is None else 1
    frfs = {
        e: estimate_frf(record, ("force", "torque"), ("speed", "angle"), estimator=e, **settings) for e in ESTIMATORS
    }
    measured = coherence(record, ("force", "torque"), ("speed", "angle"), **settings)
    for output in ("speed", "angle"):
        for excitation in ("force", "torque"):
            f, sxx, syy, sxy = scipy_spectra(record.channels[excitation], record.channels[output], **settings)
            h1, h2 = sxy / sxx, syy / np.conj(sxy)
            hv = smallest_eigenvector_response(sxx, syy, sxy)
            for name, wanted in zip(ESTIMATORS, (h1, h2, (h1 + h2) / 2, hv), strict=True):
                np.testing.assert_allclose(frfs[name][output, excitation], wanted[first:], rtol=1e-10)
            squared = np.abs(sxy) ** 2 / (sxx * syy)
            np.testing.assert_allclose(measured[output, excitation], squared[first:], rtol=1e-10)
            np.testing.assert_allclose(measured.frequency, f[first:], rtol=1e-12)


@pytest.mark.parametrize("name", ["H1", "H2", "Hv"])
def test_estimators_agree_with_pyfrf(name):
    pyfrf = pytest.importorskip("pyFRF")
    record = noisy_record()
    x, y = np.asarray(record.channels["force"]), np.asarray(record.channels["speed"])
    peer = pyfrf.FRF(
        int(RATE), x.copy(), y.copy(), "f", "d", window="hamming", fft_len=1024, nperseg=1024, noverlap=717
    )
    # Its window is symmetric, where that of SciPy's name is periodic.
    settings = {"window": np.hamming(1024), "samples": 1024, "overlap": 717}
    ours = estimate_frf(record, ("force",), ("speed",), estimator=name, **settings)
    np.testing.assert_allclose(ours["speed", "force"], peer.get_FRF(name, "receptance")[0, 0, 1:], rtol=1e-10)
    measured = coherence(record, ("force",), ("speed",), **settings)["speed", "force"]
    np.testing.assert_allclose(measured, peer.get_coherence()[0, 1:], rtol=1e-10)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_known_filter_is_found_within_its_random_error(estimator):
    force = RNG.standard_normal(40_000)
    speed = scipy.signal.lfilter(NUMERATOR, DENOMINATOR, force) + 0.02 * RNG.standard_normal(force.size)
    record = record_of(force=force, speed=speed)
    frf = estimate_frf(record, ("force",), ("speed",), estimator=estimator, band=(10.0, 300.0))
    assert frf.frequency[0] >= 10
    assert frf.frequency[-1] <= 600
    _, exact = scipy.signal.freqz(NUMERATOR, DENOMINATOR, frf.frequency, fs=RATE)
    miss = np.abs(frf["speed", "force"] - exact) / frf.standard_deviation("speed", "force")
    assert np.sqrt(np.mean(miss**2)) == pytest.approx(1.0, abs=0.2)
    assert miss.max() < 4


def many(x, y, estimator, **options):
    """The estimate from each of many records, lines inside the band only."""

    @jax.jit
    def one(x, y):
        result = estimate_response(x[None], y[None], RATE, estimator=estimator, **options)
        return result.response[0, 0, 5:-5], result.variance[0, 0, 5:-5]

    return [np.asarray(part) for part in jax.vmap(one)(jnp.asarray(x), jnp.asarray(y))]


FIR = np.array([1.0, 0.2])
SMALL = {"window": "hamming", "samples": 128, "overlap": 90}
FREQUENCY = np.fft.rfftfreq(128, 1 / RATE)[5:-5]


def white(records=200, length=3000):
    x = RNG.standard_normal((records, length))
    return x, scipy.signal.lfilter(FIR, [1.0], x, axis=1), scipy.signal.freqz(FIR, [1.0], FREQUENCY, fs=RATE)[1]


def mean_ratio(x, y, exact, estimator, **options):
    return np.mean(many(x, y, estimator, **SMALL, **options)[0], axis=0) / exact


def test_bias_under_noise_is_what_theory_says():
    x, y, exact = white(100, 6000)
    noise = 0.5 * RNG.standard_normal(x.shape)
    at_output = 1 + 0.25 / np.abs(exact) ** 2
    at_input = 1 / 1.25
    # (H1, H2) over the truth, for noise on the output and on the input.
    for (u, v), wanted in (((x, y + noise), (1.0, at_output)), ((x + noise, y), (at_input, 1.0))):
        h1, h2, h3 = (mean_ratio(u, v, exact, name) for name in ("H1", "H2", "H3"))
        np.testing.assert_allclose(h1, np.broadcast_to(wanted[0], exact.shape), atol=0.03)
        np.testing.assert_allclose(h2, np.broadcast_to(wanted[1], exact.shape), atol=0.06)
        np.testing.assert_allclose(h3, (h1 + h2) / 2, rtol=1e-10)
    both = mean_ratio(x + noise, y + 0.5 * RNG.standard_normal(x.shape), exact, "Hv")
    np.testing.assert_allclose(both, 1.0, atol=0.03)


def test_the_noise_ratio_leads_from_h2_to_h1():
    x, y, exact = white(20)
    y = y + 0.5 * RNG.standard_normal(x.shape)
    for ratio, name in ((1e-9, "H2"), (1e9, "H1")):
        np.testing.assert_allclose(
            mean_ratio(x, y, exact, "Hv", noise_ratio=ratio), mean_ratio(x, y, exact, name), rtol=1e-6
        )


@pytest.mark.parametrize(("estimator", "noise"), [("H1", 0.5), ("H2", 0.1), ("H3", 0.1), ("Hv", 0.1)])
@pytest.mark.parametrize("overlap", [0, 90])
def test_the_variance_is_right_on_average(estimator, noise, overlap):
    x, y, exact = white()
    options = {"window": "hamming", "samples": 128, "overlap": overlap}
    values, variances = many(x, y + noise * RNG.standard_normal(x.shape), estimator, **options)
    about_the_mean = np.mean(np.abs(values - values.mean(axis=0)) ** 2, axis=0)
    assert np.mean(variances.mean(axis=0) / about_the_mean) == pytest.approx(1.0, abs=0.06)
    if estimator == "H1":  # the one without bias here
        inside = np.abs(values - exact) ** 2 < variances * -np.log(0.05)  # 95 % circle of a complex normal value
        assert inside.mean() == pytest.approx(0.95, abs=0.02)


def test_derivatives_with_respect_to_a_gain_of_the_record():
    record = noisy_record(2000)

    def size(gain, estimator):
        scaled = eqx.tree_at(lambda r: r.channels["speed"], record, record.channels["speed"] * gain + 0.1 * gain**2)
        frf = estimate_frf(scaled, ("force",), ("speed",), estimator=estimator, samples=256, overlap=128)
        return jnp.sum(jnp.abs(frf["speed", "force"]) ** 2) + jnp.sum(frf.variance)

    for estimator in ESTIMATORS:
        of = partial(size, estimator=estimator)
        value_and_slope = jax.jit(lambda gain, of=of: (of(gain), jax.jacfwd(of)(gain)))
        step = 1e-5
        by_difference = (value_and_slope(1.3 + step)[0] - value_and_slope(1.3 - step)[0]) / (2 * step)
        np.testing.assert_allclose(value_and_slope(1.3)[1], by_difference, rtol=1e-7)


def test_a_single_window_has_neither_coherence_nor_variance():
    record = noisy_record(1024)
    assert estimate_frf(record, ("force",), ("speed",)).variance is None
    with pytest.raises(InputError, match="coherence of one window is always 1"):
        coherence(record, ("force",), ("speed",))


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"samples": 7000}, "has 6000 samples, but one window"),
        ({"overlap": 1024}, "overlap must be"),
        ({"overlap": -1}, "overlap must be"),
        ({"samples": 1, "overlap": 0}, "samples must be at least 2"),
        ({"estimator": "H4"}, "estimator must be one of"),
        ({"noise_ratio": 0.0}, "noise_ratio"),
        ({"window": "round"}, "window 'round' is not usable"),
        ({"window": np.ones(5)}, "window must hold"),
        ({"detrend": "cubic"}, "detrend must be"),
        ({"inputs": ("voltage",)}, "no channel 'voltage'"),
        ({"outputs": "speed"}, "outputs must be a sequence"),
        ({"inputs": ()}, "inputs must be a sequence"),
        ({"inputs": ("nothing",)}, "'nothing' has no power at 512 of 512 lines"),
        ({"outputs": ("constant",)}, "'constant' has no power"),
        ({"band": (10.0, 1001.0)}, "half the sample rate, 1000"),
        ({"band": (20.0, 10.0)}, "band = "),
        ({"band": (10.1, 10.2)}, "No line lies in band"),
        ({"form": "inertance"}, "form must be"),
    ],
)
def test_bad_input_is_named(arguments, named):
    record = (
        noisy_record().with_channel("nothing", np.zeros(6000), "1").with_channel("constant", np.full(6000, 0.1), "1")
    )
    with pytest.raises(InputError, match=named):
        estimate_frf(record, **({"inputs": ("force",), "outputs": ("speed",)} | arguments))


def test_an_unknown_pair_and_uneven_samples_are_named():
    record = noisy_record()
    with pytest.raises(InputError, match="No coherence of 'force'"):
        coherence(record, ("force",), ("speed",))["force", "speed"]
    times = np.cumsum(RNG.uniform(0.9, 1.1, 6000)) / RATE
    uneven = Record.create(times, {"force": record.channels["force"]}, {"force": "1"})
    with pytest.raises(InputError, match="not sampled uniformly"):
        estimate_frf(uneven, ("force",), ("force",))
