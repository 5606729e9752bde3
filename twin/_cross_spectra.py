"""Auto and cross spectra of sampled channels, averaged over overlapping windows (Welch's method)."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import jax.scipy.signal
import numpy as np
from jaxtyping import Array, ArrayLike, Complex, Float

from twin._checks import InputError, require_x64


class CrossSpectra(eqx.Module):
    """One-sided spectral densities of every pair of an input x and an output y, in the convention e^{+jωt}."""

    frequency: Float[Array, "frequencies"]
    """Frequencies from zero to half the sample rate [Hz]."""
    input_power: Float[Array, "inputs frequencies"]
    """Auto spectra S_xx of the inputs [input unit²/Hz]."""
    output_power: Float[Array, "outputs frequencies"]
    """Auto spectra S_yy of the outputs [output unit²/Hz]."""
    cross: Complex[Array, "outputs inputs frequencies"]
    """Cross spectra S_xy, the mean of conj(X)·Y [input unit · output unit/Hz]."""
    windows: int = eqx.field(static=True)
    """Number of windows K in the mean."""
    independent_windows: float = eqx.field(static=True)
    """Number of windows without overlap whose mean would scatter as much, K/(1 + 2·Σ(1 - j/K)·ρ_j)."""


def cross_spectra(
    x: Float[ArrayLike, "inputs length"],
    y: Float[ArrayLike, "outputs length"],
    sample_rate: Float[ArrayLike, ""],
    *,
    window: str | tuple | np.ndarray,
    samples: int,
    overlap: int,
    detrend: str | None,
) -> CrossSpectra:
    """Spectra of all pairs; samples left over at the end, too few for a window, are not used.

    Args:
        x: samples of the inputs, shape (inputs, length).
        y: samples of the outputs, shape (outputs, length).
        sample_rate: samples per second [Hz].
        window: name that `scipy.signal.get_window` knows, or the values of the window, shape (samples,).
        samples: length of a window.
        overlap: samples that two neighbouring windows share.
        detrend: what is taken out of each window before: "constant" its mean, "linear" a straight line, None nothing.

    Raises:
        InputError: if the samples do not fill a window, the overlap is not smaller than it, or the window or the trend
            is unknown.
    """
    require_x64()
    x, y = jnp.asarray(x, dtype=jnp.float64), jnp.asarray(y, dtype=jnp.float64)
    if detrend not in ("constant", "linear", None):
        raise InputError(f'detrend must be "constant", "linear" or None, but is {detrend!r}. Choose one of these.')
    if samples < 2:
        raise InputError(f"samples must be at least 2, but is {samples}. Give the length of a window.")
    if not 0 <= overlap < samples:
        raise InputError(
            f"overlap must be at least 0 and less than samples = {samples}, so that windows advance, but is {overlap}. "
            "Take about 70 % of samples for a Hamming window."
        )
    length = x.shape[-1]
    if length < samples:
        raise InputError(
            f"The record has {length} samples, but one window takes samples = {samples}. Record longer, or take "
            "shorter windows."
        )
    weights = _weights(window, samples)
    step = samples - overlap
    count = 1 + (length - samples) // step
    rate = jnp.asarray(sample_rate, dtype=jnp.float64)
    frequency, input_power, output_power, cross = _averaged(x, y, rate, jnp.asarray(weights), samples, overlap, detrend)
    independent = _independent_windows(weights, step, count)
    return CrossSpectra(frequency, input_power, output_power, cross, count, independent)


@partial(jax.jit, static_argnames=("samples", "overlap", "detrend"))
def _averaged(
    x: Array, y: Array, rate: Array, weights: Array, samples: int, overlap: int, detrend: str | None
) -> tuple[Array, Array, Array, Array]:
    options = {
        "fs": rate,
        "window": weights,
        "nperseg": samples,
        "noverlap": overlap,
        "detrend": detrend if detrend is not None else False,
    }
    frequency, input_power = jax.scipy.signal.welch(x, **options)
    _, output_power = jax.scipy.signal.welch(y, **options)
    _, cross = jax.scipy.signal.csd(x[None], y[:, None], **options)
    return frequency, input_power, output_power, cross


def _weights(window: str | tuple | np.ndarray, samples: int) -> np.ndarray:
    if isinstance(window, str | tuple):
        import scipy.signal  # two seconds to import

        try:
            return np.asarray(scipy.signal.get_window(window, samples), dtype=np.float64)
        except (ValueError, TypeError) as error:
            raise InputError(
                f'window {window!r} is not usable: {error}. Give a name such as "hamming" or "hann", a tuple such as '
                '("kaiser", 8.0), or the values of the window.'
            ) from error
    values = np.asarray(window, dtype=np.float64)
    if values.shape != (samples,) or not np.all(np.isfinite(values)) or not np.any(values):
        raise InputError(
            f"window must hold samples = {samples} finite values, not all zero, but has the shape {values.shape}. "
            "Give one value for each sample of a window."
        )
    return values


def _independent_windows(weights: np.ndarray, step: int, count: int) -> float:
    """Windows that share samples are correlated by ρ_j = (Σ w_i·w_{i+jD})²/(Σ w²)² (Welch 1967)."""
    shifts = np.arange(1, min(count, -(-weights.size // step)))
    shared = np.array([weights[: weights.size - j * step] @ weights[j * step :] for j in shifts])
    correlation = (shared / (weights @ weights)) ** 2
    return float(count / (1 + 2 * np.sum((1 - shifts / count) * correlation)))
