"""A sum of friction laws."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError
from twin.laws.friction import AbstractFriction


class SumFriction(AbstractFriction):
    """Several friction laws acting at the same speed: guideways, screw nut and motor bearing, say.

    The internal state is the tuple of the terms' states.

    Raises:
        InputError: if there is no term.
    """

    terms: tuple[AbstractFriction, ...] = eqx.field(converter=tuple)
    """The laws that are added."""

    def __check_init__(self):
        if not self.terms:
            raise InputError(
                "terms must hold at least one friction law, but is empty. Use ViscousFriction(0) for none."
            )

    def initial_state(self) -> tuple:
        return tuple(term.initial_state() for term in self.terms)

    def rate(self, state: tuple, velocity: Float[ArrayLike, "*batch"]) -> tuple:
        return tuple(term.rate(part, velocity) for term, part in zip(self.terms, state, strict=True))

    def force(
        self, state: tuple, velocity: Float[ArrayLike, "*batch"], position: Float[ArrayLike, "*batch"]
    ) -> Float[Array, "*batch"]:
        velocity = jnp.asarray(velocity)
        return sum(
            (term.force(part, velocity, position) for term, part in zip(self.terms, state, strict=True)),
            start=jnp.zeros_like(velocity),
        )
