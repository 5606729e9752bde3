"""The mesh of pinion and rack: the force through it, from its deflection, the rate of it and the motor's force."""

import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, is_concrete
from twin.laws.backlash import Backlash
from twin.laws.load_dependent import AbstractLoadLaw, RootStiffness
from twin.laws.smooth import positive_power, smooth_abs, smooth_sign

# Newton's steps are compared with the deflection itself, which is where they start from.
_ACCURACY = 1e-12
# Below this force [N] a mesh counts as unloaded: the answer is the middle of the play.
_LEAST_FORCE = 1e-6


class AbstractMesh(eqx.Module):
    """Flanks with play, a stiffness and a damping that depend on the force between them.

    Forces are positive where they drive the table forwards; in all four quadrants of the two motors' forces the law is
    odd: the mirrored deflection gives the mirrored force.
    """

    stiffness: eqx.AbstractVar[Any]
    """Stiffness of the flanks in contact k(F), a load law [N/m]."""
    damping: eqx.AbstractVar[AbstractLoadLaw]
    """Damping of the flanks in contact d(F) [Ns/m]."""
    backlash: eqx.AbstractVar[Backlash]
    """Play between the flanks."""

    @abc.abstractmethod
    def force(
        self, deflection: Float[ArrayLike, ""], rate: Float[ArrayLike, ""], load: Float[ArrayLike, ""]
    ) -> Float[Array, ""]:
        """Force through the mesh [N].

        Args:
            deflection: travel of the pinion's pitch circle less the table's δ [m].
            rate: time derivative of it [m/s].
            load: force of the motor, 2·i_g/d_p times its torque [N].
        """

    @abc.abstractmethod
    def deflection(self, force: Float[ArrayLike, ""], load: Float[ArrayLike, ""] | None = None) -> Float[Array, ""]:
        """Deflection that rests under a force [m]: inverse of `force`.

        Args:
            force: force through the mesh [N]; at zero the middle of the play is meant.
            load: force of the motor [N]; the force through the mesh if it is not given.
        """


class TangentMesh(AbstractMesh):
    """k(F) is the slope of the force, k = dF/dδ, at the force that goes through the mesh.

    With k(F) = k1·|F|^(1/k2) this integrates to F = [k1·(1 - 1/k2)·ε]^(k2/(k2 - 1)) over the indentation ε of the
    flanks (`Backlash`): closed, without an algebraic loop, and flat at first contact. The force is the slope of a
    potential, and the damping acts on the flanks in contact alone: a mesh never gives more energy than it was given.

    Leipe et al., eq. 3 and 8, read at the force through the mesh.

    Raises:
        InputError: if k2 is not above 1: a force that is proportional to its stiffness never sets in.
    """

    stiffness: RootStiffness
    damping: AbstractLoadLaw
    backlash: Backlash

    def __check_init__(self):
        k2 = getattr(self.stiffness, "k2", None)
        if isinstance(k2, jax.Array) and is_concrete(k2) and not float(k2) > 1:
            raise InputError(
                f"k2 of the stiffness must be above 1 where k(F) is the slope of the force, but is {float(k2):g}. "
                "Check that k2 is the order of the root, not its exponent 1/k2."
            )

    def force(
        self, deflection: Float[ArrayLike, ""], rate: Float[ArrayLike, ""], load: Float[ArrayLike, ""]
    ) -> Float[Array, ""]:
        del load
        elastic, contact = self._elastic(deflection)
        return elastic + self.damping(elastic) * contact * rate

    def elastic(self, deflection: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Force at rest, of any shape [N].

        Args:
            deflection: δ [m].
        """
        return self._elastic(deflection)[0]

    def potential(self, deflection: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Energy stored in the flanks [J]; zero in the middle of the play.

        Args:
            deflection: δ of any shape [m].
        """
        scale, power, width = self._law()
        reach = smooth_abs(self.backlash(deflection), width) ** (power + 1) - width ** (power + 1)
        return scale * reach / (power + 1)

    def deflection(self, force: Float[ArrayLike, ""], load: Float[ArrayLike, ""] | None = None) -> Float[Array, ""]:
        del load
        scale, power, _ = self._law()
        # To the right of the answer, from where Newton's steps go straight to it, as the force is convex.
        indentation = (smooth_abs(force, self.stiffness.width) / scale) ** (1 / power)
        return _resting(_tangent_force, self, self.backlash, jnp.asarray(force), indentation)

    def _elastic(self, deflection: ArrayLike) -> tuple[Array, Array]:
        scale, power, width = self._law()
        indentation, contact = self.backlash(deflection), self.backlash.contact(deflection)
        return contact * scale * positive_power(smooth_abs(indentation, width), power - 1) * indentation, contact

    def _law(self) -> tuple[Array, Array, Array]:
        """F = scale·|ε|^power, with |ε| smoothed so that the slope at ε = 0 is the stiffness at F = 0."""
        k1, k2 = self.stiffness.k1, self.stiffness.k2
        slope = 1 - 1 / k2
        power = 1 / slope
        width = self.stiffness.width**slope / (k1 * slope**k2)
        return (k1 * slope) ** power, power, width


class SecantMesh(AbstractMesh):
    """F = k(F_m)·ε + d(F_m)·contact·δ̇ with F_m the motor's force: Hooke's law, with what the torque says.

    Leipe et al., eq. 3 and 8, as printed: "vary depending on the motor torque". Where the torque changes quickly so
    does this stiffness, also by what only accelerates the motor; near a resonance that shows in the frequency response.
    Read it as a description of slow loads, and take `TangentMesh` for dynamics.
    """

    stiffness: AbstractLoadLaw
    damping: AbstractLoadLaw
    backlash: Backlash

    def force(
        self, deflection: Float[ArrayLike, ""], rate: Float[ArrayLike, ""], load: Float[ArrayLike, ""]
    ) -> Float[Array, ""]:
        elastic = self.stiffness(load) * self.backlash(deflection)
        return elastic + self.damping(load) * self.backlash.contact(deflection) * rate

    def deflection(self, force: Float[ArrayLike, ""], load: Float[ArrayLike, ""] | None = None) -> Float[Array, ""]:
        stiffness = self.stiffness(force if load is None else load)
        indentation = smooth_abs(force, _LEAST_FORCE) / stiffness
        law = (stiffness, self.backlash)
        return _resting(_secant_force, law, self.backlash, jnp.asarray(force), indentation)


def _tangent_force(mesh: TangentMesh, deflection: Array) -> Array:
    return mesh.elastic(deflection)


def _secant_force(law: tuple[Array, Backlash], deflection: Array) -> Array:
    stiffness, backlash = law
    return stiffness * backlash(deflection)


@eqx.filter_jit
def _resting(
    elastic: Callable, law: Any, backlash: Backlash, target: Float[Array, ""], indentation: Float[Array, ""]
) -> Float[Array, ""]:
    """The deflection at which the elastic force is a given one; differentiable by the implicit function theorem."""
    reach = jax.lax.stop_gradient(indentation + 0.5 * backlash.play + 2 * backlash.width)
    magnitude = jax.lax.stop_gradient(smooth_abs(target, _LEAST_FORCE))

    def excess(part: Array, given: Any) -> Array:
        law, wanted = given
        return (elastic(law, part * reach) - wanted) / magnitude

    start = smooth_sign(jax.lax.stop_gradient(target), _LEAST_FORCE)
    solver = optx.Newton(rtol=_ACCURACY, atol=_ACCURACY)
    return reach * optx.root_find(excess, solver, start, (law, target), max_steps=100, throw=False).value
