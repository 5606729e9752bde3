"""Moré, Garbow and Hillstrom's problems of any dimension (ACM TOMS 7(1), 1981, problems 20 to 35), as residuals."""

import jax.numpy as jnp
import numpy as np


def watson(x):
    n = x.size
    t = np.arange(1.0, 30)[:, None] / 29
    powers = t ** np.arange(n)
    slopes = np.arange(1, n) * t ** np.arange(n - 1)
    return jnp.concatenate([slopes @ x[1:] - (powers @ x) ** 2 - 1, jnp.stack([x[0], x[1] - x[0] ** 2 - 1])])


def extended_rosenbrock(x):
    return jnp.concatenate([10 * (x[1::2] - x[::2] ** 2), 1 - x[::2]])


def extended_powell_singular(x):
    a, b, c, d = x.reshape(-1, 4).T
    root5, root10 = np.sqrt(5.0), np.sqrt(10.0)
    return jnp.concatenate([a + 10 * b, root5 * (c - d), (b - 2 * c) ** 2, root10 * (a - d) ** 2])


def penalty_1(x):
    return jnp.concatenate([np.sqrt(1e-5) * (x - 1), jnp.sum(x**2)[None] - 0.25])


def penalty_2(x):
    n = x.size
    i = np.arange(2.0, n + 1)
    y = np.exp(i / 10) + np.exp((i - 1) / 10)
    pairs = jnp.exp(x[1:] / 10) + jnp.exp(x[:-1] / 10) - y
    singles = jnp.exp(x[1:] / 10) - np.exp(-0.1)
    total = jnp.sum(np.arange(n, 0, -1) * x**2) - 1
    return jnp.concatenate([x[:1] - 0.2, np.sqrt(1e-5) * pairs, np.sqrt(1e-5) * singles, total[None]])


def variably_dimensioned(x):
    total = jnp.sum(np.arange(1, x.size + 1) * (x - 1))
    return jnp.concatenate([x - 1, jnp.stack([total, total**2])])


def trigonometric(x):
    i = np.arange(1, x.size + 1)
    return x.size - jnp.sum(jnp.cos(x)) + i * (1 - jnp.cos(x)) - jnp.sin(x)


def brown_almost_linear(x):
    return jnp.concatenate([x[:-1] + jnp.sum(x) - (x.size + 1), jnp.prod(x)[None] - 1])


def discrete_boundary_value(x):
    h = 1 / (x.size + 1)
    t = h * np.arange(1, x.size + 1)
    around = jnp.concatenate([jnp.zeros(1), x, jnp.zeros(1)])
    return 2 * x - around[:-2] - around[2:] + h**2 * (x + t + 1) ** 3 / 2


def discrete_integral_equation(x):
    h = 1 / (x.size + 1)
    t = h * np.arange(1, x.size + 1)
    cubes = (x + t + 1) ** 3
    kernel = np.where(t[None, :] <= t[:, None], (1 - t)[:, None] * t[None, :], t[:, None] * (1 - t)[None, :])
    return x + h * (kernel @ cubes) / 2


def broyden_tridiagonal(x):
    around = jnp.concatenate([jnp.zeros(1), x, jnp.zeros(1)])
    return (3 - 2 * x) * x - around[:-2] - 2 * around[2:] + 1


def broyden_banded(x):
    i = np.arange(x.size)
    distance = i[None, :] - i[:, None]
    band = np.where((distance >= -5) & (distance <= 1) & (distance != 0), 1.0, 0.0)
    return x * (2 + 5 * x**2) + 1 - band @ (x * (1 + x))


def linear_full_rank(x, rows=20):
    spread = -2 / rows * jnp.sum(x) - 1
    return jnp.concatenate([x, jnp.zeros(rows - x.size)]) + spread


def linear_rank_1(x, rows=20):
    return np.arange(1, rows + 1) * jnp.sum(np.arange(1, x.size + 1) * x) - 1


def linear_rank_1_zeros(x, rows=20):
    inner = np.arange(1, rows - 1) * jnp.sum(np.arange(2, x.size) * x[1:-1]) - 1
    return jnp.concatenate([-jnp.ones(1), inner, -jnp.ones(1)])


def chebyquad(x):
    n = x.size
    before, now = jnp.ones(n), 2 * x - 1
    means = []
    for i in range(1, n + 1):
        means.append(jnp.mean(now) + (1 / (i**2 - 1) if i % 2 == 0 else 0.0))
        before, now = now, 2 * (2 * x - 1) * now - before
    return jnp.stack(means)
