"""Frequency responses and coherence from sampled records of any broad excitation.

The estimators are told in `twin.response_estimate`. A record of whole periods of a periodic excitation is better served
by `twin.periodic`.
"""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from twin._checks import InputError, is_concrete
from twin._cross_spectra import CrossSpectra, cross_spectra
from twin._sample_rate import uniform_rate
from twin.frf import FRF
from twin.record import Record
from twin.response_estimate import check_estimator, ordinary_coherence, response_from_spectra

# Power, relative to the mean square of the samples, that rounding leaves of a channel which does not move.
_ROUNDING_POWER = 1e-27


class Coherence(eqx.Module):
    """Ordinary coherence of each pair of an output and an input over the frequency."""

    frequency: Float[Array, "frequencies"]
    """Frequencies [Hz]."""
    values: Float[Array, "outputs inputs frequencies"]
    """Coherence γ²: the part of the output's power that is linear in this one input, 0 to 1."""
    outputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the output channels."""
    inputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the input channels."""

    def __getitem__(self, names: tuple[str, str]) -> Float[Array, "frequencies"]:
        """Coherence of one (output, input).

        Raises:
            InputError: if there is no such pair.
        """
        output, excitation = names
        if output not in self.outputs or excitation not in self.inputs:
            raise InputError(
                f"No coherence of {output!r} with {excitation!r}: outputs are {', '.join(self.outputs)}, "
                f"inputs {', '.join(self.inputs)}."
            )
        return self.values[self.outputs.index(output), self.inputs.index(excitation)]


def estimate_frf(
    record: Record,
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    estimator: str = "H3",
    window: str | tuple | np.ndarray = "hamming",
    samples: int = 1024,
    overlap: int = 717,
    detrend: str | None = "constant",
    band: tuple[float, float] | None = None,
    noise_ratio: float = 1.0,
    form: str = "ratio",
) -> FRF:
    """Frequency response of every output to every input of a record, with its variance.

    Every pair is estimated on its own, as if the other inputs were silent. Inputs that act at the same time and are
    correlated are not told apart.

    The defaults are those of V. Leipe et al. for a rack-and-pinion drive: Hamming windows of 1024 samples which overlap
    by 717, and H3. A resonance narrower than about two lines (twice sample rate/samples) is flattened by leakage, which
    the variance does not show.

    The zero-frequency line is left out if the mean is taken out of the windows, since nothing is known of it then.

    Args:
        record: uniformly sampled.
        inputs: names of the excitation channels.
        outputs: names of the response channels.
        estimator: "H1", "H2", "H3" or "Hv".
        window: name that `scipy.signal.get_window` knows, or the values of the window, shape (samples,).
        samples: length of a window; the lines lie sample rate/samples apart.
        overlap: samples that two neighbouring windows share.
        detrend: what is taken out of each window before: "constant" its mean, "linear" a straight line, None nothing.
        band: lowest and highest frequency to keep [Hz]; None keeps all.
        noise_ratio: for Hv, power of the output's noise over that of the input's [output unit²/input unit²].
        form: form of the result, see `FRF`.

    Returns:
        The response with its variance (see `twin.response_estimate`); without one from a single window.

    Raises:
        InputError: unknown channel, estimator, window or trend; a record that is not uniform or shorter than a window;
            an overlap that is not smaller than a window; a channel without power at a line kept; a band without a line
            or beyond half the sample rate.
    """
    check_estimator(estimator, noise_ratio)
    options = {"window": window, "samples": samples, "overlap": overlap, "detrend": detrend}
    spectra, frequency, kept = _spectra_of(record, inputs, outputs, band, options)
    estimate = response_from_spectra(spectra, estimator, noise_ratio)
    variance = None if estimate.variance is None else estimate.variance[..., kept]
    return FRF(jnp.asarray(frequency), estimate.response[..., kept], tuple(outputs), tuple(inputs), form, variance)


def coherence(
    record: Record,
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    window: str | tuple | np.ndarray = "hamming",
    samples: int = 1024,
    overlap: int = 717,
    detrend: str | None = "constant",
    band: tuple[float, float] | None = None,
) -> Coherence:
    """Ordinary coherence of every output with every input of a record; arguments as for `estimate_frf`.

    Raises:
        InputError: as `estimate_frf` does, and if the record holds a single window only: then the coherence is 1
            whatever the noise.
    """
    options = {"window": window, "samples": samples, "overlap": overlap, "detrend": detrend}
    spectra, frequency, kept = _spectra_of(record, inputs, outputs, band, options)
    if spectra.windows < 2:
        raise InputError(
            f"{record.name} holds a single window of {samples} samples, and the coherence of one window is always 1. "
            "Record longer, or take shorter windows or more overlap."
        )
    return Coherence(jnp.asarray(frequency), ordinary_coherence(spectra)[..., kept], tuple(outputs), tuple(inputs))


def _spectra_of(
    record: Record, inputs: Sequence[str], outputs: Sequence[str], band: tuple[float, float] | None, options: dict
) -> tuple[CrossSpectra, np.ndarray, np.ndarray]:
    """Spectra of a record's channels at all lines; frequencies [Hz] and places of the lines kept."""
    for what, names in (("inputs", inputs), ("outputs", outputs)):
        if isinstance(names, str) or not names:
            raise InputError(f'{what} must be a sequence of channel names, but is {names!r}. Write ("torque",), say.')
    x = jnp.stack([record.channel(name) for name in inputs])
    y = jnp.stack([record.channel(name) for name in outputs])
    rate = uniform_rate(record)
    spectra = cross_spectra(x, y, rate, **options)
    frequency = np.fft.rfftfreq(options["samples"], 1 / rate)
    kept = _kept(frequency, band, rate, first=0 if options["detrend"] is None else 1)
    for names, samples, power in ((inputs, x, spectra.input_power), (outputs, y, spectra.output_power)):
        for name, channel, density in zip(names, samples, power, strict=True):
            _check_power(name, channel, density[kept], frequency[kept], rate)
    return spectra, frequency[kept], kept


def _kept(frequency: np.ndarray, band: tuple[float, float] | None, rate: float, first: int) -> np.ndarray:
    places = np.arange(first, frequency.size)
    if band is None:
        return places
    low, high = band
    if not 0 <= low < high or high > rate / 2:
        raise InputError(
            f"band = ({low:g}, {high:g}) Hz must rise from at least 0 to at most half the sample rate, {rate / 2:g} "
            "Hz. Choose a band within."
        )
    kept = places[(frequency[places] >= low) & (frequency[places] <= high)]
    if kept.size == 0:
        raise InputError(
            f"No line lies in band = ({low:g}, {high:g}) Hz; lines are {frequency[1]:g} Hz apart, from "
            f"{frequency[first]:g} Hz. Widen the band or take longer windows."
        )
    return kept


def _check_power(name: str, channel: Array, density: Array, frequency: np.ndarray, rate: float) -> None:
    if not is_concrete(density):
        return
    samples = np.asarray(channel)
    silent = np.flatnonzero(np.asarray(density) <= _ROUNDING_POWER * np.mean(samples**2) / rate)
    if silent.size:
        raise InputError(
            f"channel {name!r} has no power at {silent.size} of {frequency.size} lines (first at "
            f"{frequency[silent[0]]:g} Hz), so that no response can be formed there. Check that it is the right "
            "channel, or keep only the excited lines by band."
        )
