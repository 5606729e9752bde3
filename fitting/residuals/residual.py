"""The interface of evidence: data held inside, called with a model, returns a weighted residual."""

import abc
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import InputError


class AbstractResidual(eqx.Module):
    """Evidence about a model: its residual is real, and weighted so that unit variance means "as good as the data"."""

    @abc.abstractmethod
    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        """The weighted residual (model minus measured, over the standard deviation) of a model."""


class JointResidual(AbstractResidual):
    """Several pieces of evidence about one model, fitted together."""

    parts: tuple[AbstractResidual, ...]
    """The pieces; their residuals are stacked."""

    def __check_init__(self):
        if not self.parts:
            raise InputError("A joint residual needs at least one part.")

    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        return jnp.concatenate([part(model) for part in self.parts])
