"""Functions with known sensitivity: Ishigami, Sobol's G-function, a linear model."""

import jax.numpy as jnp
import numpy as np

from twin.parameters import Parameter, ParameterSpace

# Ishigami with a = 7, b = 0.1 (Ishigami and Homma 1990).
ISHIGAMI_S1 = np.asarray([0.3139, 0.4424, 0.0])
ISHIGAMI_ST = np.asarray([0.5576, 0.4424, 0.2437])
ISHIGAMI = ParameterSpace([Parameter(f"x{i + 1}", "rad", -np.pi, np.pi) for i in range(3)])

G_COEFFICIENTS = np.asarray([0.0, 1.0, 4.5, 9.0, 99.0])
G_FUNCTION = ParameterSpace([Parameter(f"x{i + 1}", "", 0.0, 1.0) for i in range(5)])

SLOPES = np.asarray([3.0, -2.0, 1.0, 0.0])
LINEAR = ParameterSpace([Parameter(f"x{i + 1}", "m", 2.0, 4.0) for i in range(4)])


def ishigami(x):
    return jnp.sin(x[0]) + 7.0 * jnp.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * jnp.sin(x[0])


def g_function(x):
    return jnp.prod((jnp.abs(4 * x - 2) + G_COEFFICIENTS) / (1 + G_COEFFICIENTS))


def linear(x):
    return 1e3 + x @ jnp.asarray(SLOPES)


def g_indices():
    """First-order and total indices of the G-function (Saltelli and Sobol' 1995): its parts are products."""
    part = 1 / (3 * (1 + G_COEFFICIENTS) ** 2)
    whole = np.prod(1 + part)
    return part / (whole - 1), part * whole / (1 + part) / (whole - 1)


def linear_indices():
    """First-order indices, which are the total ones, of the linear model."""
    return SLOPES**2 / np.sum(SLOPES**2)
