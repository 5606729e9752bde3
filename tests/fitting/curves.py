"""Small curve fits that the tests share: quick to compile, with answers that are known or easily found."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.residuals.residual import AbstractResidual
from twin._checks import as_array
from twin.parameters import Parameter, ParameterSpace


class Line(eqx.Module):
    """a + b·x, and a number that nothing depends on."""

    a: jax.Array = eqx.field(converter=as_array)
    b: jax.Array = eqx.field(converter=as_array)
    unused: jax.Array = eqx.field(converter=as_array)


class LineResidual(AbstractResidual):
    """(a + b·x - y) / σ."""

    x: jax.Array = eqx.field(converter=as_array)
    y: jax.Array = eqx.field(converter=as_array)
    deviation: float = 1.0

    def __call__(self, model):
        return (model.a + model.b * self.x - self.y) / self.deviation


LINE_X = np.linspace(0.0, 2.0, 40)
LINE_Y = 3.0 - 0.7 * LINE_X + 0.1 * np.random.default_rng(5).standard_normal(40)
"""A line with noise."""


class Coefficients(eqx.Module):
    """A model that is nothing but its parameters."""

    b: jax.Array = eqx.field(converter=as_array)


class CurveResidual(AbstractResidual):
    """(curve(b, x) - y) / σ."""

    curve: Any = eqx.field(static=True)
    x: jax.Array = eqx.field(converter=as_array)
    y: jax.Array = eqx.field(converter=as_array)
    deviation: jax.Array = eqx.field(converter=as_array)

    def __call__(self, model):
        return (self.curve(model.b, self.x) - self.y) / self.deviation


def two_decays(b, x):
    """Two exponentials: exchanging them gives the same curve, so there are two equal minima."""
    return b[0] * jnp.exp(-b[1] * x) + b[2] * jnp.exp(-b[3] * x)


def saturation(b, x):
    """Michaelis and Menten's curve; with few data at small x its parameters are known from below only."""
    return b[0] * x / (b[1] + x)


def line(b, x):
    """A straight line."""
    return b[0] + b[1] * x


def noisy(curve, truth, x, deviation, seed=0):
    """Evidence simulated with normal noise."""
    x = np.asarray(x, dtype=float)
    clean = np.asarray(curve(jnp.asarray(truth), jnp.asarray(x)))
    y = clean + deviation * np.random.default_rng(seed).standard_normal(x.size)
    return CurveResidual(curve, x, y, np.asarray(deviation))


def box(count, lower, upper, scale="linear", **others):
    """A space of `b.0`, `b.1`, ..., all with the same bounds."""
    return ParameterSpace([Parameter(f"b.{i}", "", lower, upper, scale=scale, **others) for i in range(count)])
