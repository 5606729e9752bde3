"""Evidence from the frequency responses of a preloaded drive: all preloads together."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from fitting.residuals.residual import AbstractResidual
from twin._checks import InputError, as_array, as_scalar, finite, positive
from twin.drives import DrivenTable
from twin.drives.rack_pinion_operation import table_response


class PreloadedResponseResidual(AbstractResidual):
    """Modelled minus measured response V_T/V_1 at each preload, real and imaginary parts over their deviations.

    The model is a `DrivenTable`, both motors taken to move alike, as they do under a common set velocity. σ²/2 is the
    variance of each part.

    Raises:
        InputError: arrays whose shapes do not match, values that are not finite, a variance that is not positive.
    """

    frequency: Float[Array, "_"] = eqx.field(converter=as_array)
    """Frequencies [Hz]."""
    values: Complex[Array, "preloads _"]
    """Measured responses."""
    variance: Float[Array, "preloads _"] = eqx.field(converter=as_array)
    """Variance of each, both parts together."""
    forces: Float[Array, "preloads 2"] = eqx.field(converter=as_array)
    """Forces through the meshes at each preload, or the motors' forces in their place [N]."""
    velocity: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Velocity on which the excitation is put [m/s]."""

    def __check_init__(self):
        arrays = (self.frequency, self.values, self.variance, self.forces)
        if not all(isinstance(x, jax.Array | np.ndarray) for x in arrays):
            return
        lines, preloads = self.frequency.shape, self.forces.shape[:1]
        if not self.values.shape == self.variance.shape == preloads + lines or self.forces.shape[1:] != (2,):
            raise InputError(
                f"values have shape {self.values.shape}, their variance {self.variance.shape}, forces "
                f"{self.forces.shape} and frequencies {lines}. Give one row of values, and a pair of forces, for each "
                "preload, and one column for each frequency."
            )
        finite("measured response", jnp.abs(self.values))
        finite("forces", self.forces, "N")
        positive("variance of the measured response", self.variance)

    def __call__(self, model: DrivenTable) -> Float[Array, "residuals"]:
        def one(forces: Array) -> Array:
            return jnp.sum(table_response(model.drive, forces, self.frequency, velocity=self.velocity), axis=0)

        error = (jax.vmap(one)(self.forces) - self.values) / jnp.sqrt(self.variance / 2)
        return jnp.concatenate([jnp.real(error).ravel(), jnp.imag(error).ravel()])

    @property
    def rows(self) -> int:
        """Length of the residual."""
        return 2 * self.values.size

    def series(self, values: Float[Array, "residuals"]) -> Float[Array, "rows lines"]:
        """A residual by lines, one row for each preload and part, real and imaginary.

        Args:
            values: what calling this evidence returned.
        """
        return values.reshape(-1, self.frequency.size)
