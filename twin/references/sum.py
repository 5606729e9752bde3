"""Motions that follow or overlay each other."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, PyTree

from twin._checks import InputError
from twin.references.reference import AbstractReference


class SumReference(AbstractReference):
    """The sum of references: moves one after the other, each from where the last one ended, or a sweep on a move."""

    parts: tuple[AbstractReference, ...]
    """References that return the same structure."""

    def __check_init__(self):
        if not self.parts:
            raise InputError("A sum of references needs at least one part.")

    def __call__(self, t: Float[ArrayLike, ""]) -> PyTree[Array]:
        values = [part(t) for part in self.parts]
        return jax.tree.map(lambda *x: sum(x[1:], x[0]), *values)

    def switching_times(self) -> Float[Array, " switches"]:
        return jnp.sort(jnp.concatenate([part.switching_times() for part in self.parts]))
