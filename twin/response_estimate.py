"""The estimators H1, H2, H3 and Hv of a frequency response, with coherence and variance, on arrays of samples.

With the spectra S_xx, S_yy and S_xy = mean of conj(X)·Y over windows of the record, S_yx = conj(S_xy):

    H1 = S_xy/S_xx            no bias from noise on the output; noise on the input makes it too small
    H2 = S_yy/S_yx            no bias from noise on the input; noise on the output makes it too large
    H3 = (H1 + H2)/2          the arithmetic mean, between the two
    Hv                        total least squares: noise on both, in a known ratio
    γ² = |S_xy|²/(S_xx·S_yy)  coherence, γ² = H1/H2

Inside a control loop the noise of the output returns to the input; then all of these are biased where the coherence is
low.

Sources: P. D. Welch, "The use of fast Fourier transform for the estimation of power spectra", IEEE Trans. Audio
Electroacoust. 15 (1967) 70-73; L. D. Mitchell, "Improved methods for the fast Fourier transform (FFT) calculation of
the frequency response function", J. Mech. Des. 104 (1982) 277-279 (H3); J. S. Bendat, A. G. Piersol, "Random Data",
4th ed., Wiley 2010, sections 6.1 and 9.2 (coherence, random error); K. Shin, J. K. Hammond, "Fundamentals of Signal
Processing for Sound and Vibration Engineers", Wiley 2008, p. 293 (total least squares).
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Complex, Float

from twin._checks import InputError, positive
from twin._cross_spectra import CrossSpectra, cross_spectra

ESTIMATORS = ("H1", "H2", "H3", "Hv")


class ResponseEstimate(eqx.Module):
    """Frequency response, coherence and variance estimated from samples."""

    frequency: Float[Array, "frequencies"]
    """Frequencies from zero to half the sample rate [Hz]."""
    response: Complex[Array, "outputs inputs frequencies"]
    """Response H in the convention e^{+jωt} [output unit per input unit]."""
    coherence: Float[Array, "outputs inputs frequencies"] | None
    """Ordinary coherence γ² between each pair, 0 to 1; None from a single window, where it would always be 1."""
    variance: Float[Array, "outputs inputs frequencies"] | None
    """Variance E|H - E(H)|², real and imaginary part together; None from a single window."""


def estimate_response(
    x: Float[ArrayLike, "inputs length"],
    y: Float[ArrayLike, "outputs length"],
    sample_rate: Float[ArrayLike, ""],
    *,
    estimator: str = "H3",
    window: str | tuple | np.ndarray = "hamming",
    samples: int = 1024,
    overlap: int = 717,
    detrend: str | None = "constant",
    noise_ratio: float = 1.0,
) -> ResponseEstimate:
    """What `estimate_frf` does, on bare arrays: differentiable, and usable under jit and vmap.

    The variance is |H|²·(1 - γ²)/(γ²·(n - 1)), real and imaginary part together (Bendat and Piersol, section 9.2).
    Windows that overlap repeat each other in part, so n is not their number K but n = K/(1 + 2·Σ(1 - j/K)·ρ_j), with
    the correlation ρ_j of the spectra of two windows j steps apart (Welch 1967). One is taken off because the residual,
    which the coherence is made of, has been fitted by H. For H1 with white noise on the output this is right on
    average, for the others as far as the noise is small. It is the scatter only, not the bias of the estimator.

    Hv assumes that the noise of the output has `noise_ratio` times the power of that of the input. It depends on the
    units: with 1, both have the same power in the units of the arrays. A large ratio gives H1, a small one H2.

    Args:
        x: samples of the inputs, shape (inputs, length).
        y: samples of the outputs, shape (outputs, length).
        sample_rate: samples per second [Hz].
        estimator: "H1", "H2", "H3" or "Hv".
        window: name that `scipy.signal.get_window` knows, or the values of the window, shape (samples,).
        samples: length of a window.
        overlap: samples that two neighbouring windows share.
        detrend: "constant", "linear" or None.
        noise_ratio: for Hv, power of the output's noise over that of the input's [output unit²/input unit²].

    Returns:
        The response at all lines from zero to half the sample rate; NaN where a channel has no power.

    Raises:
        InputError: if an option is unknown or does not fit the length of the arrays.
    """
    check_estimator(estimator, noise_ratio)
    options = {"window": window, "samples": samples, "overlap": overlap, "detrend": detrend}
    return response_from_spectra(cross_spectra(x, y, sample_rate, **options), estimator, noise_ratio)


@eqx.filter_jit
def response_from_spectra(spectra: CrossSpectra, estimator: str, noise_ratio: float) -> ResponseEstimate:
    """One of the estimators from spectra; arguments as for `estimate_response`."""
    sxx, syy, sxy = spectra.input_power, spectra.output_power[:, None], spectra.cross
    if estimator == "H1":
        response = sxy / sxx
    elif estimator == "H2":
        response = syy / jnp.conj(sxy)
    elif estimator == "H3":
        response = 0.5 * (sxy / sxx + syy / jnp.conj(sxy))
    else:
        response = _total_least_squares(noise_ratio * sxx, syy, sxy, noise_ratio)
    if spectra.windows < 2:
        return ResponseEstimate(spectra.frequency, response, None, None)
    squared = ordinary_coherence(spectra)
    power = jnp.real(response) ** 2 + jnp.imag(response) ** 2
    # Rounding may put the coherence above 1.
    unexplained = jnp.where(squared < 1, 1 - squared, 0.0)
    variance = power * unexplained / (squared * (spectra.independent_windows - 1))
    return ResponseEstimate(spectra.frequency, response, squared, variance)


def _total_least_squares(scaled_sxx: Array, syy: Array, sxy: Array, noise_ratio: float) -> Array:
    """Larger root of S_yx·H² + (k·S_xx - S_yy)·H - k·S_xy = 0, written so that nothing cancels."""
    surplus = syy - scaled_sxx
    root = jnp.sqrt(surplus**2 + 4 * noise_ratio * (jnp.real(sxy) ** 2 + jnp.imag(sxy) ** 2))
    rising = surplus > 0
    total = jnp.where(rising, root + surplus, root - surplus)
    return jnp.where(rising, total / (2 * jnp.conj(sxy)), 2 * noise_ratio * sxy / total)


def ordinary_coherence(spectra: CrossSpectra) -> Float[Array, "outputs inputs frequencies"]:
    """Ordinary coherence γ² = |S_xy|²/(S_xx·S_yy) of each pair."""
    crossed = jnp.real(spectra.cross) ** 2 + jnp.imag(spectra.cross) ** 2
    return crossed / (spectra.input_power * spectra.output_power[:, None])


def check_estimator(estimator: str, noise_ratio: float) -> None:
    """Raise unless the estimator is known and the ratio positive.

    Raises:
        InputError: if they are not.
    """
    if estimator not in ESTIMATORS:
        raise InputError(
            f"estimator must be one of {', '.join(ESTIMATORS)}, but is {estimator!r}. Choose one of these."
        )
    positive("noise_ratio", noise_ratio)
