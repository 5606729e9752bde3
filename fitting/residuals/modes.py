"""Evidence from modal analysis: natural frequencies, mass-normalised shapes and damping ratios at axis positions."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
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
    A mode that was not measured at some position is left out of its reference.

    Raises:
        InputError: no position, positions with different outputs, shapes that are not real, a reference mode without
            frequency or damping, a kind of evidence that is not known, a standard deviation that is not positive; when
            called, a machine without one of the outputs.
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
    weight: Float[Array, "positions modes"] = eqx.field(converter=as_array)
    """1 for a mode that counts, 0 for one that was not measured or is left out."""
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
            references: measured modes, one set for each position, with the same outputs.
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
            if reference.outputs != outputs:
                raise InputError(
                    f"The modes at position {position:g} m have other outputs than those at the first position. Reduce "
                    "all to the same ones by reference_modes(modes, outputs=...)."
                )
            if jnp.iscomplexobj(reference.output_shapes):
                raise InputError(
                    "The reference's shapes are complex. Turn each by its phase and take the real part: shapes of "
                    "lightly damped modes are real to first order."
                )
            largest = float(jnp.max(reference.damping_ratio, initial=0.0))
            if largest >= 1:
                raise InputError(
                    f"A damping ratio at position {position:g} m is {largest:g}, but must be below 1 for a mode to "
                    "oscillate. Give plain numbers, not per cent."
                )
        most = max(r.frequency.size for r in references)
        frequency, ratio, shapes, weight = zip(*(_padded(reference, most) for reference in references), strict=True)
        return cls(
            position=jnp.asarray(positions, dtype=jnp.float64),
            frequency=jnp.stack(frequency),
            damping_ratio=jnp.stack(ratio),
            shapes=jnp.stack(shapes),
            frequency_deviation=as_scalar(frequency_deviation),
            shape_deviation=as_scalar(shape_deviation),
            damping_deviation=as_scalar(damping_deviation),
            weight=jnp.stack(weight),
            outputs=outputs,
            kinds=kinds,
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
        return jax.vmap(self._compared)(found, self.frequency, self.damping_ratio, self.shapes, self.weight).ravel()

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
        return jax.vmap(self._paired)(self.modes(model), self.frequency, self.shapes, self.weight)

    def _paired(self, found: Modes, frequency: Array, shapes: Array, weight: Array) -> PairedModes:
        wide, wide_ref = (eigenvalue(f, _WIDE) for f in (found.frequency, frequency))
        alike = marked_macxp(found.output_shapes, wide[:, None], shapes, wide_ref[None, :])
        # Without a threshold: far from the reference a bad pair is what there is to improve. What does not count comes
        # last, so that it takes no mode away.
        return assign(jax.lax.stop_gradient(alike * jnp.where(weight > 0, 1.0, 1e-9)), threshold=0.0)

    def _compared(self, found: Modes, frequency: Array, ratio: Array, shapes: Array, weight: Array) -> Array:
        order = self._paired(found, frequency, shapes, weight).order
        own = found.output_shapes[:, order]
        sign = jax.lax.stop_gradient(jnp.where(jnp.sum(own * shapes, axis=0) < 0, -1.0, 1.0))
        parts = {
            "frequency": jnp.log(found.frequency[order] / frequency) / self.frequency_deviation,
            "shape": (own * sign - shapes) / (self.shape_deviation * jnp.sqrt(jnp.mean(shapes**2, axis=0))),
            "damping": jnp.log(found.damping_ratio[order] / ratio) / self.damping_deviation,
        }
        return jnp.concatenate([(weight * parts[kind]).ravel() for kind in KINDS if kind in self.kinds])


def _padded(reference: ReferenceModes, most: int) -> tuple[Array, Array, Array, Array]:
    """Frequency, damping ratio, shapes and weight of as many modes as asked for; what is missing has weight zero."""
    missing = most - reference.frequency.size
    parts = (reference.frequency, reference.damping_ratio, reference.output_shapes)
    present = jnp.isfinite(reference.frequency) & jnp.all(jnp.isfinite(reference.output_shapes), axis=0)
    present &= jnp.isfinite(reference.damping_ratio)
    full = [
        jnp.pad(jnp.where(present, part, 1.0), [(0, 0)] * (part.ndim - 1) + [(0, missing)], constant_values=1.0)
        for part in parts
    ]
    return full[0], full[1], full[2], jnp.pad(jnp.where(present, 1.0, 0.0), (0, missing))
