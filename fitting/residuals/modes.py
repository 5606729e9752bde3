"""Evidence from modal analysis: natural frequencies, mass-normalised shapes and damping ratios at axis positions."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.residuals.residual import AbstractResidual
from twin._checks import InputError, above_zero, as_array, as_scalar
from twin.correlation import PairedModes, assign, eigenvalue
from twin.correlation.shapes import marked_macxp
from twin.modal import Modes, modes
from twin.modal.reference import ReferenceModes
from twin.structure import Machine

KINDS = ("frequency", "shape", "damping")
"""What modal analysis gives."""
# Damping ratio that both modes of a pair are given when pairs are sought: frequencies may be apart by half of it.
_WIDE = 0.2


class ModesResidual(AbstractResidual):
    """Modes of a machine at several axis positions against measured ones.

    Log frequencies, mass-normalised shapes relative to the rms of the reference's, and log damping ratios, each over
    its standard deviation. Each reference mode is compared with the simulated mode that is most like it: by MACXP with
    so much damping that frequencies far apart do not hide a likeness of shapes. The pairing is not differentiated.

    Raises:
        InputError: no position, positions with different outputs or numbers of modes, shapes that are not real, a
            reference mode without frequency or damping, a kind of evidence that is not known, a standard deviation that
            is not positive; when called, a machine without one of the outputs.
    """

    position: Float[Array, "positions"] = eqx.field(converter=as_array)
    """Axis positions [m]."""
    frequency: Float[Array, "positions modes"] = eqx.field(converter=as_array)
    """Natural frequencies of the reference [Hz]."""
    damping_ratio: Float[Array, "positions modes"] = eqx.field(converter=as_array)
    """Damping ratios of the reference [-]."""
    shapes: Float[Array, "positions outputs modes"] = eqx.field(converter=as_array)
    """Mass-normalised shapes of the reference at the outputs [1/√kg]."""
    frequency_deviation: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Relative standard deviation of the frequencies [-]."""
    shape_deviation: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Standard deviation of the shapes' entries, as a share of the rms of the shape [-]."""
    damping_deviation: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Relative standard deviation of the damping ratios [-]."""
    outputs: tuple[str, ...] = eqx.field(static=True)
    """Names "node direction" of the outputs."""
    kinds: tuple[str, ...] = eqx.field(static=True, default=KINDS)
    """Which kinds of evidence count."""

    @classmethod
    def of(
        cls,
        references: Sequence[ReferenceModes],
        positions: Sequence[float],
        *,
        frequency_deviation: float = 1e-3,
        shape_deviation: float = 1e-2,
        damping_deviation: float = 5e-2,
        kinds: tuple[str, ...] = KINDS,
    ) -> "ModesResidual":
        """Evidence from the modes measured at each position.

        Args:
            references: measured modes, one for each position, with the same outputs and as many modes.
            positions: axis positions [m].
            frequency_deviation: relative standard deviation of the frequencies [-].
            shape_deviation: that of the shapes' entries, as a share of the rms of the shape [-].
            damping_deviation: relative standard deviation of the damping ratios [-].
            kinds: which of frequency, shape and damping count.
        """
        if len(references) != len(positions) or not references:
            raise InputError(
                f"There are {len(references)} sets of reference modes for {len(positions)} positions. Give one each."
            )
        outputs = references[0].outputs
        for position, reference in zip(positions, references, strict=True):
            if reference.outputs != outputs or reference.frequency.shape != references[0].frequency.shape:
                raise InputError(
                    f"The modes at position {position:g} m have other outputs, or another number of modes, than those "
                    "at the first position. Reduce all to the same by reference_modes; evidence with other modes is "
                    "a ModesResidual of its own, joined by JointResidual."
                )
            if jnp.iscomplexobj(reference.output_shapes):
                raise InputError(
                    "The reference's shapes are complex. Turn each by its phase and take the real part: shapes of "
                    "lightly damped modes are real to first order."
                )
        return cls(
            jnp.asarray(positions, dtype=jnp.float64),
            jnp.stack([r.frequency for r in references]),
            jnp.stack([r.damping_ratio for r in references]),
            jnp.stack([r.output_shapes for r in references]),
            frequency_deviation,
            shape_deviation,
            damping_deviation,
            outputs,
            kinds,
        )

    def __check_init__(self):
        for name in self.kinds:
            if name not in KINDS:
                raise InputError(f"kinds names {name!r}; known are {', '.join(KINDS)}.")
        if not self.kinds:
            raise InputError(f"kinds is empty. Name at least one of {', '.join(KINDS)}.")
        above_zero("frequency", self.frequency, "Hz")
        above_zero("damping_ratio", self.damping_ratio, "-")
        above_zero("frequency_deviation", self.frequency_deviation, "-")
        above_zero("shape_deviation", self.shape_deviation, "-")
        above_zero("damping_deviation", self.damping_deviation, "-")

    def __call__(self, model: Machine) -> Float[Array, "residuals"]:
        found = self.modes(model)
        return jax.vmap(self._compared)(found, *self._reference()).ravel()

    def modes(self, model: Machine) -> Modes:
        """The machine's modes at all positions and at the outputs measured, one batch.

        Args:
            model: the machine.
        """
        return jax.vmap(lambda z: modes(model.second_order(z, inputs=(), outputs=self.outputs)))(self.position)

    def pairs(self, model: Machine) -> PairedModes:
        """Which mode of the machine is compared with each reference mode, one batch over the positions.

        Args:
            model: the machine.
        """
        return jax.vmap(self._paired)(self.modes(model), *self._reference())

    def _reference(self) -> tuple[Array, Array, Array]:
        return self.frequency, self.damping_ratio, self.shapes

    def _paired(self, found: Modes, frequency: Array, _: Array, shapes: Array) -> PairedModes:
        wide, wide_ref = (eigenvalue_of(f, _WIDE) for f in (found.frequency, frequency))
        alike = marked_macxp(found.output_shapes, wide[:, None], shapes, wide_ref[None, :])
        # Without a threshold: far from the reference a bad pair is what there is to improve.
        return assign(jax.lax.stop_gradient(alike), threshold=0.0)

    def _compared(self, found: Modes, frequency: Array, ratio: Array, shapes: Array) -> Array:
        order = self._paired(found, frequency, ratio, shapes).order
        own = found.output_shapes[:, order]
        sign = jax.lax.stop_gradient(jnp.where(jnp.sum(own * shapes, axis=0) < 0, -1.0, 1.0))
        parts = {
            "frequency": jnp.log(found.frequency[order] / frequency) / self.frequency_deviation,
            "shape": (own * sign - shapes) / (self.shape_deviation * jnp.sqrt(jnp.mean(shapes**2, axis=0))),
            "damping": jnp.log(found.damping_ratio[order] / ratio) / self.damping_deviation,
        }
        return jnp.concatenate([parts[kind].ravel() for kind in KINDS if kind in self.kinds])


def eigenvalue_of(frequency: Float[Array, "..."], ratio: float) -> Array:
    """λ of modes that are all given one damping ratio; traced frequencies pass.

    Args:
        frequency: f [Hz].
        ratio: ζ [-].
    """
    return eigenvalue(frequency, jnp.full_like(frequency, ratio))


def translations(nodes: Sequence[str]) -> tuple[str, ...]:
    """Names of the translations in x, y, z at some nodes, as modal analysis measures them.

    Args:
        nodes: names of nodes.
    """
    return tuple(f"{node} {direction}" for node in nodes for direction in "xyz")


def deviations(residual: ModesResidual) -> np.ndarray:
    """Standard deviations of the three kinds of evidence, for reports [-].

    Args:
        residual: the evidence.
    """
    return np.asarray([residual.frequency_deviation, residual.shape_deviation, residual.damping_deviation])
