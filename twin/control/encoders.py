"""Encoders of finite resolution between a plant and what reads it."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from twin._checks import InputError, as_scalar, positive
from twin.plant import AbstractPlant


class Encoders(AbstractPlant):
    """A plant, some of whose outputs are read in whole steps.

    Rounding has no useful derivative: it is for making records, and for asking what a resolution costs. In a sampled
    loop the controller sees the steps as well.

    Raises:
        InputError: a step that is not positive, or an output that the plant does not have.
    """

    plant: AbstractPlant
    """What is measured."""
    steps: dict[str, Float[Array, ""]] = eqx.field(
        converter=lambda steps: {name: as_scalar(step) for name, step in steps.items()}
    )
    """Step of each output that is rounded, by its name [the output's unit]."""

    def __init__(self, plant: AbstractPlant, steps: Mapping[str, Any]):
        """Rounded outputs.

        Args:
            plant: what is measured.
            steps: step by output name.
        """
        self.plant = plant
        self.steps = dict(steps)

    def __check_init__(self):
        names = self.plant.outputs(jnp.zeros(()), self.plant.initial_state(), self.plant.rest_inputs())._fields
        for name, step in self.steps.items():
            if name not in names:
                raise InputError(f"The plant has no output {name!r}; it has {', '.join(names)}. Name one of these.")
            positive(f"step of {name}", step)

    def initial_state(self) -> PyTree[Array]:
        return self.plant.initial_state()

    def rest_inputs(self) -> PyTree[Array]:
        return self.plant.rest_inputs()

    def vector_field(self, t: Float[Array, ""], state: PyTree[Array], inputs: PyTree[Array]) -> PyTree[Array]:
        return self.plant.vector_field(t, state, inputs)

    def outputs(self, t: Float[Array, ""], state: PyTree[Array], inputs: PyTree[Array]) -> Any:
        outputs = self.plant.outputs(t, state, inputs)
        return outputs._replace(
            **{name: step * jnp.round(getattr(outputs, name) / step) for name, step in self.steps.items()}
        )
