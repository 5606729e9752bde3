"""Evidence about a load law from totals: what several contacts together were measured to have at known forces."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from fitting.residuals.residual import AbstractResidual
from twin._checks import InputError, as_array, finite, positive
from twin.laws import AbstractLoadLaw


def total_over_contacts(law: AbstractLoadLaw, forces: Float[ArrayLike, "contacts *batch"]) -> Float[Array, "*batch"]:
    """Sum of a property over contacts side by side, all of one law: Leipe et al., eq. 2, 4, 7 and 9.

    Args:
        law: the law of each.
        forces: force through each contact, along the first axis [N].
    """
    return jnp.sum(jax.vmap(law)(jnp.asarray(forces)), axis=0)


class LoadSurfaceResidual(AbstractResidual):
    """Total of the contacts by the law, minus measured, over the standard deviation. The model is the law itself.

    Raises:
        InputError: forces that are not one row per contact and one column per measured point, values that are not
            finite, a deviation that is not positive.
    """

    forces: Float[Array, "contacts _"] = eqx.field(converter=as_array)
    """Force through each contact at each point [N]."""
    measured: Float[Array, "_"] = eqx.field(converter=as_array)
    """Measured total [unit of the law]."""
    deviation: Float[Array, "..."] = eqx.field(converter=as_array)
    """Standard deviation of the measured totals, one for all or one each [unit of the law]."""

    def __check_init__(self):
        if isinstance(self.measured, jax.Array) and isinstance(self.forces, jax.Array):
            points = np.shape(self.measured)
            if len(points) != 1 or np.ndim(self.forces) != 2 or np.shape(self.forces)[1:] != points:
                raise InputError(
                    f"forces have shape {np.shape(self.forces)} and the measured totals {points}; give one row of "
                    "forces per contact and one column per measured point."
                )
        finite("forces", self.forces, "N")
        finite("measured totals", self.measured)
        positive("deviation of the measured totals", self.deviation)

    def __call__(self, model: AbstractLoadLaw) -> Float[Array, "residuals"]:
        return (total_over_contacts(model, self.forces) - self.measured) / self.deviation
