"""Spectra and frequency responses from records of a periodic excitation, with the variance that the periods show."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Complex, Float

from twin._checks import InputError, increasing, require_x64
from twin._sample_rate import uniform_rate
from twin.frf import FRF
from twin.record import Record

# How far a line may miss a whole number of cycles per period by rounding.
_LINE_ROUNDING = 1e-3
# Periods that agree to rounding have no scatter to compare with.
_AGREEMENT = 1e-9


class PeriodicSpectra(eqx.Module):
    """Complex amplitudes of several channels at chosen lines, period by period."""

    frequency: Float[Array, "lines"]
    """Frequencies of the lines [Hz]."""
    values: Complex[Array, "channels periods lines"]
    """Complex amplitudes, e^{+jωt}, in the unit of each channel."""
    channels: tuple[str, ...] = eqx.field(static=True)
    """Names of the channels."""
    used: tuple[int, ...] = eqx.field(static=True)
    """Numbers of the periods that are used, counted from the first complete one as 0."""
    rejected: tuple[int, ...] = eqx.field(static=True)
    """Numbers of the periods left out because they were disturbed."""

    def __getitem__(self, channel: str) -> Complex[Array, "periods lines"]:
        """Amplitudes of one channel.

        Raises:
            InputError: if there is no such channel.
        """
        if channel not in self.channels:
            raise InputError(f"No spectrum of {channel!r}; there are {', '.join(self.channels)}. Add it to channels.")
        return self.values[self.channels.index(channel)]


def periodic_spectra(
    record: Record,
    channels: Sequence[str],
    period_samples: int,
    frequency: Float[ArrayLike, "lines"],
    *,
    skip: int = 0,
    detrend: str = "ramp",
    disturbed_above: float | None = 3.0,
) -> PeriodicSpectra:
    """Complex amplitudes of a periodic record, period by period, without drift and without disturbed periods.

    Periods are laid back from the end of the record, so that what is left over lies in the transient at its beginning.

    "ramp" takes from each period the straight line through its first sample and the first sample of the next period. A
    drive that drifts ends its period elsewhere than it began; the step this makes in the periodic continuation leaks
    into every line, by about drift/(π·line). The ramp closes the period exactly. A regression line does not: it leaves
    a step, and can be worse than nothing.

    Disturbed periods are left out by this rule: of each channel take the increments from sample to sample, and of these
    the median over all periods at each place of the period. A period is disturbed if in any channel the rms deviation
    from that median is more than `disturbed_above` times the median of this rms over the periods.

    Args:
        record: uniformly sampled.
        channels: names of the channels wanted.
        period_samples: samples in one period of the excitation.
        frequency: lines wanted [Hz], each a whole number of cycles per period, below half the sample rate.
        skip: complete periods to leave out at the beginning, while the transient dies away.
        detrend: "ramp", or "none" for the samples as they are.
        disturbed_above: limit of the rule above; None keeps every period.

    Returns:
        Amplitudes of at least two periods.

    Raises:
        InputError: unknown channel, samples not uniform, fewer than two periods left, a line that is not a whole number
            of cycles per period, or not between zero and half the sample rate.
    """
    require_x64()
    if detrend not in ("ramp", "none"):
        raise InputError(f'detrend must be "ramp" or "none", but is {detrend!r}. Choose one of the two.')
    rate = uniform_rate(record)
    lines = _lines(frequency, period_samples, rate)
    closing = 1 if detrend == "ramp" else 0
    samples = np.stack([np.asarray(record.channel(name)) for name in channels])
    periods = (samples.shape[1] - closing) // period_samples
    if not 0 <= skip <= periods - 2:
        raise InputError(
            f"{record.name} has {samples.shape[1]} samples, that is {max(periods, 0)} complete periods of "
            f"{period_samples}{' and a closing sample' if closing else ''}; skip = {skip} of them leaves fewer than "
            "two, and two are needed for a variance. Record longer, skip fewer, or check period_samples."
        )
    start = samples.shape[1] - closing - periods * period_samples
    index = start + np.arange(periods)[:, None] * period_samples + np.arange(period_samples + closing)
    windows = samples[:, index][:, skip:]
    kept = _undisturbed(windows, disturbed_above)
    if np.count_nonzero(kept) < 2:
        raise InputError(
            f"{record.name}: of {kept.size} periods all but {np.count_nonzero(kept)} are disturbed by the rule "
            f"disturbed_above = {disturbed_above}. Look at the periods, and raise the limit or use None."
        )
    if closing:
        place = np.arange(period_samples) / period_samples - 0.5
        windows = windows[..., :-1] - (windows[..., -1:] - windows[..., :1]) * place
    amplitudes = np.fft.rfft(windows[:, kept], axis=-1)[..., lines] * (2 / period_samples)
    numbers = skip + np.arange(kept.size)
    return PeriodicSpectra(
        jnp.asarray(lines * rate / period_samples),
        jnp.asarray(amplitudes),
        tuple(channels),
        tuple(int(i) for i in numbers[kept]),
        tuple(int(i) for i in numbers[~kept]),
    )


def periodic_frf(spectra: PeriodicSpectra, excitation: str, responses: Sequence[str]) -> FRF:
    """Frequency response as the ratio of mean spectra, with the variance of that mean.

    The ratio of means is free of bias where both channels are noisy, as noise averages out before the division. Its
    variance counts the noise of both channels and their covariance (Pintelon and Schoukens, System Identification,
    2nd ed. 2012, ch. 2): with P periods

        var G = |G|²/P · [σ²_Y/|Y|² + σ²_U/|U|² - 2·Re(σ_YU/(Y·Ū))].

    It is the variance by which a repetition of the same experiment would differ. Distortion that repeats with the
    excitation is not in it; see `twin.frf.local_polynomial_variance`.

    Args:
        spectra: amplitudes at the excited lines.
        excitation: channel of the excitation.
        responses: channels of the responses.

    Returns:
        The response, (response, 1, line), with its variance.

    Raises:
        InputError: unknown channel, or a line at which the excitation is zero.
    """
    u = spectra[excitation]
    y = jnp.stack([spectra[name] for name in responses])
    mean_u, mean_y = jnp.mean(u, axis=0), jnp.mean(y, axis=1)
    silent = np.flatnonzero(np.asarray(mean_u) == 0)
    if silent.size:
        raise InputError(
            f"The excitation {excitation!r} is zero at {silent.size} of {mean_u.size} lines (first at "
            f"{float(spectra.frequency[silent[0]]):g} Hz). Ask for excited lines only."
        )
    values = mean_y / mean_u
    periods = u.shape[0]
    # Deviation of Y - G·U: its variance is the bracket of the formula above, times |Y|².
    error = (y - mean_y[:, None]) - values[:, None] * (u - mean_u)
    variance = jnp.sum(jnp.abs(error) ** 2, axis=1) / (periods * (periods - 1)) / jnp.abs(mean_u) ** 2
    return FRF(spectra.frequency, values[:, None], tuple(responses), (excitation,), "ratio", variance[:, None])


def distortion_level(
    silent: PeriodicSpectra,
    excited: PeriodicSpectra,
    response: Complex[ArrayLike, "..."],
    excitation: str,
    responses: Sequence[str],
) -> Float[Array, "responses lines"]:
    """Nonlinear distortion at lines that were not excited, relative to what the excited lines beside them make.

    What the response shows at a silent line, beyond what the little excitation that leaks there explains, was put
    there by a nonlinearity: |Y - G·U| / (|G|·|U excited|). At odd lines it is of the size of the distortion at the
    excited odd lines; even lines show even nonlinearities.

    Args:
        silent: amplitudes at the lines that were not excited.
        excited: amplitudes at the lines that were.
        response: linear response G at the silent lines, (response, line).
        excitation: channel of the excitation.
        responses: channels of the responses, in the order of `response`.

    Returns:
        Relative level, a plain number, of each response at each silent line.

    Raises:
        InputError: unknown channel, or a response of another shape.
    """
    g = jnp.asarray(response)
    if g.shape != (len(responses), silent.frequency.size):
        raise InputError(
            f"response has shape {g.shape}, but {len(responses)} responses at {silent.frequency.size} silent lines "
            "are asked for. Evaluate the linear response at the silent lines."
        )
    u = jnp.mean(silent[excitation], axis=0)
    y = jnp.stack([jnp.mean(silent[name], axis=0) for name in responses])
    beside = jnp.interp(silent.frequency, excited.frequency, jnp.abs(jnp.mean(excited[excitation], axis=0)))
    return jnp.abs(y - g * u) / (jnp.abs(g) * beside)


def _lines(frequency: Float[ArrayLike, "lines"], period_samples: int, rate: float) -> np.ndarray:
    wanted = np.asarray(frequency, dtype=np.float64)
    if wanted.ndim != 1 or wanted.size == 0:
        raise InputError(f"frequency must be a vector of lines [Hz], but has shape {wanted.shape}.")
    increasing("frequency", wanted, "Hz")
    if period_samples < 3:
        raise InputError(f"period_samples must be at least 3, but is {period_samples}.")
    cycles = wanted * period_samples / rate
    whole = np.round(cycles)
    wrong = np.flatnonzero(np.abs(cycles - whole) > _LINE_ROUNDING)
    if wrong.size:
        raise InputError(
            f"frequency[{wrong[0]}] = {wanted[wrong[0]]:g} Hz makes {cycles[wrong[0]]:g} cycles in a period of "
            f"{period_samples} samples at {rate:g} Hz, which is not a whole number. Check period_samples, the sample "
            "rate and the lines against each other."
        )
    outside = np.flatnonzero((whole < 1) | (2 * whole >= period_samples))
    if outside.size:
        raise InputError(
            f"frequency[{outside[0]}] = {wanted[outside[0]]:g} Hz must lie above 0 and below half the sample rate, "
            f"{rate / 2:g} Hz. Ask for lines in between."
        )
    return whole.astype(int)


def _undisturbed(windows: Float[np.ndarray, "channels periods samples"], limit: float | None) -> np.ndarray:
    if limit is None:
        return np.ones(windows.shape[1], dtype=bool)
    increments = np.diff(windows, axis=-1)
    usual = np.median(increments, axis=1, keepdims=True)
    deviation = np.sqrt(np.mean((increments - usual) ** 2, axis=-1))
    rounding = _AGREEMENT * np.sqrt(np.mean(usual**2, axis=-1))
    allowed = np.maximum(limit * np.median(deviation, axis=1, keepdims=True), rounding)
    return np.all(deviation <= allowed, axis=0)
