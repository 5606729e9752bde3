"""Evidence from a measured frequency response: complex, weighted by its measured variance."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from fitting.residuals.residual import AbstractResidual
from twin._checks import InputError, is_concrete
from twin.control import DelayedPlant
from twin.frf import FRF
from twin.linear import frequency_response, linearise
from twin.plant import AbstractPlant


def rest_response(model: AbstractPlant | DelayedPlant, frequency: Float[ArrayLike, "frequencies"]) -> FRF:
    """Frequency response of a plant linearised at rest, behind its dead time if it has one.

    Args:
        model: plant, or plant behind a dead time.
        frequency: frequencies [Hz].

    Returns:
        The response of all outputs to all inputs.
    """
    system = model.linearise() if isinstance(model, DelayedPlant) else linearise(model)
    return frequency_response(system, jnp.asarray(frequency))


class FrequencyResponseResidual(AbstractResidual):
    """Model minus measured frequency response, real and imaginary parts, over their standard deviations.

    "complex": (G - Ĝ)/σ, the maximum-likelihood residual of small, normal errors.

    "log": ln(G/Ĝ)/(σ/|Ĝ|): error of log-magnitude and of phase. For small errors it is the same; where the errors are
    not small beside the response, as at an antiresonance, or a few lines are far off, it is the robuster one
    (P. Guillaume, R. Pintelon, J. Schoukens, "Robust parametric transfer function estimation using complex logarithmic
    frequency response data", IEEE Trans. Automatic Control 40 (1995) 1180-1190).

    σ²/2 is the variance of each part, as the measured variance is that of both parts together.

    Args:
        measured: measured response with its variance.
        outputs: the model's names of the responses, if they differ from the measured ones.
        inputs: the model's names of the excitations, if they differ from the measured ones.
        kind: "complex" or "log".
        respond: from model and frequencies [Hz] to the response; that at rest if not given.

    Raises:
        InputError: unknown kind, measured response without variance, variance not positive, values not finite (for
            "log" also zero), names that do not match the measured response in number.
    """

    measured: FRF
    """Measured response Ĝ, with its variance."""
    outputs: tuple[str, ...] = eqx.field(static=True, default=())
    """The model's name of each measured response, in order; the measured names if empty."""
    inputs: tuple[str, ...] = eqx.field(static=True, default=())
    """The model's name of each measured excitation, in order; the measured names if empty."""
    kind: str = eqx.field(static=True, default="complex")
    """"complex" or "log"."""
    respond: Callable = eqx.field(static=True, default=rest_response)
    """From model and frequencies [Hz] to its response, a function that is defined once and kept (a new lambda for every
    fit compiles anew). `rest_response` for plants, `twin.linear.frequency_response` for linear systems."""

    def __check_init__(self):
        if self.kind not in ("complex", "log"):
            raise InputError(f'kind must be "complex" or "log", but is {self.kind!r}.')
        for what, names, there in (
            ("outputs", self.outputs, self.measured.outputs),
            ("inputs", self.inputs, self.measured.inputs),
        ):
            if names and len(names) != len(there):
                raise InputError(
                    f"{what} names {len(names)} of the model ({', '.join(names)}), but the measured response has "
                    f"{len(there)} ({', '.join(there)}). Name one for each, in order."
                )
        if self.measured.variance is None:
            raise InputError(
                "The measured response has no variance to weight by. Estimate it from several periods "
                "(twin.periodic.periodic_frf) or neighbouring lines (twin.frf.local_polynomial_variance), or give one "
                "by FRF.with_variance."
            )
        self._check_numbers()

    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        measured = self.measured
        response = self.respond(model, measured.frequency)
        rows = _positions("output", response.outputs, self.outputs or measured.outputs)
        columns = _positions("input", response.inputs, self.inputs or measured.inputs)
        values = response.values[np.ix_(rows, columns)]
        deviation = jnp.sqrt(jnp.asarray(measured.variance) / 2)
        if self.kind == "complex":
            error = (values - measured.values) / deviation
        else:
            error = jnp.log(values / measured.values) * (jnp.abs(measured.values) / deviation)
        return jnp.concatenate([jnp.real(error).ravel(), jnp.imag(error).ravel()])

    def _check_numbers(self) -> None:
        values, variance = self.measured.values, self.measured.variance
        if not all(is_concrete(x) and isinstance(x, Array | np.ndarray) for x in (values, variance)):
            return
        size, spread = np.abs(np.asarray(values)), np.asarray(variance)
        self._refuse(~np.isfinite(size), "value is not finite", "Leave this line out")
        self._refuse(
            ~(np.isfinite(spread) & (spread > 0)),
            "variance is not positive and finite",
            "A variance of zero would give this line infinite weight. Use more periods, add a floor by "
            "FRF.with_variance, or leave the line out",
        )
        if self.kind == "log":
            self._refuse(size == 0, "value is zero, and has no logarithm", 'Leave this line out, or use "complex"')

    def _refuse(self, bad: np.ndarray, what: str, cure: str) -> None:
        if bad.any():
            row, column, line = np.argwhere(bad)[0]
            raise InputError(
                f"Measured response of {self.measured.outputs[row]!r} to {self.measured.inputs[column]!r} at "
                f"{float(self.measured.frequency[line]):g} Hz: the {what} ({bad.sum()} such in all). {cure}."
            )


def _positions(kind: str, names: tuple[str, ...], wanted: tuple[str, ...]) -> list[int]:
    for name in wanted:
        if name not in names:
            raise InputError(
                f"The model has no {kind} {name!r}; it has {', '.join(names)}. Name the model's {kind} for each "
                f"measured one by `{kind}s` of the residual."
            )
    return [names.index(name) for name in wanted]
