"""Forces that depend on the position of the axis: gravity, cogging, pitch error of a screw, a hose in tow."""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_array, as_scalar, finite, positive


class AbstractPositionForce(eqx.Module):
    """A force as a function of position. Like friction it enters the equation of motion as -force."""

    @abc.abstractmethod
    def __call__(self, position: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Force, positive against positive motion [N or Nm].

        Args:
            position: position of any shape [m or rad].
        """


class NoForce(AbstractPositionForce):
    """No force."""

    def __call__(self, position: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        return jnp.zeros_like(jnp.asarray(position))


class ConstantForce(AbstractPositionForce):
    """The same force everywhere, such as the weight of a vertical axis.

    Raises:
        InputError: if the force is not finite.
    """

    constant: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Force against positive motion F_0 [N or Nm]."""

    def __check_init__(self):
        finite("constant", self.constant, "N")

    def __call__(self, position: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        return self.constant + jnp.zeros_like(jnp.asarray(position))


class HarmonicForce(AbstractPositionForce):
    """F = Σ a_n·cos(2πn·(x - x_0)/p) + b_n·sin(2πn·(x - x_0)/p), n = 1..harmonics.

    What repeats with every turn, tooth or pole pair.

    Raises:
        InputError: if the period is not positive, the amplitudes are no vectors of equal length, or any is not finite.
    """

    period: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Period p: a screw's lead, a rack's pitch, a motor's pole pitch [m or rad]."""
    cosine: Float[Array, " harmonics"] = eqx.field(converter=as_array)
    """Cosine amplitudes a_1.. of the harmonics, shape (harmonics,) [N or Nm]."""
    sine: Float[Array, " harmonics"] = eqx.field(converter=as_array)
    """Sine amplitudes b_1.. of the harmonics, shape (harmonics,) [N or Nm]."""
    origin: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Position x_0 where the phase is zero [m or rad]; an encoder without an index shifts it from record to record."""

    def __check_init__(self):
        positive("period", self.period, "m")
        finite("origin", self.origin, "m")
        _check_vector("cosine", self.cosine)
        _check_vector("sine", self.sine)
        shape, sine_shape = getattr(self.cosine, "shape", None), getattr(self.sine, "shape", None)
        if shape is not None and sine_shape is not None and shape != sine_shape:
            raise InputError(
                f"cosine and sine must have one amplitude for each harmonic, but have the shapes {shape} and "
                f"{sine_shape}. Fill the shorter with zeros."
            )

    def __call__(self, position: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        order = jnp.arange(1, self.cosine.size + 1, dtype=self.cosine.dtype)
        phase = 2 * jnp.pi * ((jnp.asarray(position) - self.origin) / self.period)[..., None] * order
        return jnp.sum(self.cosine * jnp.cos(phase) + self.sine * jnp.sin(phase), axis=-1)


class PolynomialForce(AbstractPositionForce):
    """F = Σ c_k·ξ^k with ξ = (x - x_0)/L, k = 0..degree: what changes slowly along the travel.

    With x_0 in the middle and L half of the travel, ξ goes from -1 to 1 and the coefficients can be compared.

    Raises:
        InputError: if there is no coefficient, the span is not positive, or any value is not finite.
    """

    coefficients: Float[Array, " coefficients"] = eqx.field(converter=as_array)
    """Coefficients c_0, c_1.., lowest power first, shape (degree + 1,) [N or Nm]."""
    centre: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Position x_0 where ξ = 0 [m or rad]."""
    span: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Length L over which ξ grows by one [m or rad]."""

    def __check_init__(self):
        _check_vector("coefficients", self.coefficients)
        finite("centre", self.centre, "m")
        positive("span", self.span, "m")

    def __call__(self, position: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        scaled = (jnp.asarray(position) - self.centre) / self.span
        force = jnp.zeros_like(scaled)
        # Horner's rule: no powers, whose derivatives at ξ = 0 would need care.
        for k in reversed(range(self.coefficients.size)):
            force = force * scaled + self.coefficients[k]
        return force


class SumForce(AbstractPositionForce):
    """The sum of several forces along the travel.

    Raises:
        InputError: if there is no term.
    """

    terms: tuple[AbstractPositionForce, ...] = eqx.field(converter=tuple)
    """The forces that are added."""

    def __check_init__(self):
        if not self.terms:
            raise InputError("terms must hold at least one force, but is empty. Use NoForce() for none.")

    def __call__(self, position: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        return sum((term(position) for term in self.terms[1:]), self.terms[0](position))


def _check_vector(name: str, value: Array) -> None:
    shape = getattr(value, "shape", None)
    if shape is None:
        return
    if len(shape) != 1 or shape[0] < 1:
        raise InputError(f"{name} must be a vector of at least one entry, but has the shape {shape}. Give a list.")
    finite(name, value, "N")
