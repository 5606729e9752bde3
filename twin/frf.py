"""Frequency response functions: what they are, and how far they scatter about a smooth curve."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Complex, Float

from twin._checks import InputError, as_array, increasing


class FRF(eqx.Module):
    """A frequency response, (response, excitation, frequency), in the convention e^{+jωt}."""

    frequency: Float[Array, "frequencies"]
    """Frequencies [Hz]."""
    values: Complex[Array, "outputs inputs frequencies"]
    """Complex response, in output unit per input unit."""
    outputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the responses."""
    inputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the excitations."""
    form: str = eqx.field(static=True, default="ratio")
    """"receptance", "mobility", "accelerance", or "ratio" for anything else."""
    variance: Float[Array, "outputs inputs frequencies"] | None = None
    """Variance E|G - E(G)|² of the values, real and imaginary part together; None where it is not known."""

    def __check_init__(self):
        if self.form not in ("receptance", "mobility", "accelerance", "ratio"):
            raise InputError(f"form must be receptance, mobility, accelerance or ratio, but is {self.form!r}.")
        increasing("frequency", self.frequency, "Hz")

    def __getitem__(self, names: tuple[str, str]) -> Complex[Array, "frequencies"]:
        """One response by (output, input)."""
        row, column = self._position(*names)
        return self.values[row, column]

    def standard_deviation(self, output: str, excitation: str) -> Float[Array, "frequencies"]:
        """Standard deviation of one complex response.

        Raises:
            InputError: unknown name, or a response without variance.
        """
        if self.variance is None:
            raise InputError("This FRF has no variance. Estimate it from several periods, or weight the fit otherwise.")
        row, column = self._position(output, excitation)
        return jnp.sqrt(self.variance[row, column])

    def with_variance(self, variance: Float[ArrayLike, "..."]) -> "FRF":
        """The same response with another variance of its values (response, excitation, frequency).

        Raises:
            InputError: if the variance has another shape than the values.
        """
        new = as_array(variance)
        if new.shape != self.values.shape:
            raise InputError(
                f"variance has shape {new.shape}, but the values have {self.values.shape} (response, excitation, "
                "frequency). Give one variance for each value."
            )
        return FRF(self.frequency, self.values, self.outputs, self.inputs, self.form, new)

    def between(self, low: float, high: float) -> "FRF":
        """The lines with low <= frequency <= high [Hz].

        Raises:
            InputError: if no line lies there.
        """
        frequency = np.asarray(self.frequency)
        kept = np.flatnonzero((frequency >= low) & (frequency <= high))
        if kept.size == 0:
            raise InputError(
                f"No line lies between {low:g} and {high:g} Hz; the response runs from {frequency[0]:g} to "
                f"{frequency[-1]:g} Hz. Widen the range."
            )
        variance = None if self.variance is None else self.variance[..., kept]
        return FRF(self.frequency[kept], self.values[..., kept], self.outputs, self.inputs, self.form, variance)

    def _position(self, output: str, excitation: str) -> tuple[int, int]:
        if output not in self.outputs or excitation not in self.inputs:
            raise InputError(
                f"No response of {output!r} to {excitation!r}: outputs are {', '.join(self.outputs)}, "
                f"inputs {', '.join(self.inputs)}."
            )
        return self.outputs.index(output), self.inputs.index(excitation)


def local_polynomial_variance(
    frf: FRF, *, lines: int = 7, order: int = 2
) -> Float[Array, "outputs inputs frequencies"]:
    """Total variance of each value: noise plus nonlinear distortion, read from the scatter of neighbouring lines.

    Under a multisine the response of a weakly nonlinear drive is its best linear approximation plus a part that jumps
    from line to line and yet repeats in every period, so that the variance over periods does not see it (Pintelon and
    Schoukens, System Identification, 2nd ed. 2012, ch. 4). Here a complex polynomial in the frequency is fitted by
    least squares to each line and its neighbours; the sum of squared residuals is divided by its degrees of freedom.

    Where the true response bends sharply within these lines (a resonance narrower than their spacing) the polynomial
    cannot follow: there the variance is too large, which gives such lines less weight rather than more.

    Args:
        frf: measured response.
        lines: neighbouring lines used for each line, itself included; at the ends they lie to one side. Odd.
        order: degree of the polynomial.

    Returns:
        Variance E|G - G₀|² of each single value, real and imaginary part together, squared unit of the response.

    Raises:
        InputError: if the number of lines is even, too small for the polynomial, or larger than the response has.
    """
    count = frf.frequency.size
    if lines % 2 == 0 or lines < order + 2 or order < 0:
        raise InputError(
            f"lines must be odd and at least order + 2 = {order + 2}, so that residuals remain, but is {lines}. "
            "Take more lines or a lower order."
        )
    if lines > count:
        raise InputError(f"lines is {lines}, but the response has {count}. Take fewer, or measure more lines.")
    first = np.clip(np.arange(count) - lines // 2, 0, count - lines)
    neighbours = first[:, None] + np.arange(lines)
    offsets = frf.frequency[neighbours] - frf.frequency[:, None]
    offsets = offsets / jnp.max(jnp.abs(offsets), axis=1, keepdims=True)
    basis, _ = jnp.linalg.qr(offsets[..., None] ** jnp.arange(order + 1))
    values = frf.values[..., neighbours]
    coefficients = jnp.einsum("fnp,...fn->...fp", basis, values)
    scatter = values - jnp.einsum("fnp,...fp->...fn", basis, coefficients)
    return jnp.sum(jnp.abs(scatter) ** 2, axis=-1) / (lines - order - 1)
