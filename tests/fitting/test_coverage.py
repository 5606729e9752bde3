"""How often 95 % intervals hold the truth in many repeats of a small fit, plain and robust, with outliers or not."""

from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float
from scipy import stats

from fitting.residuals.losses import HuberLoss, TukeyLoss
from fitting.residuals.residual import AbstractResidual
from fitting.residuals.robust import RobustResidual
from fitting.solve import solve_raw
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.uncertainty import covariance_of
from twin.parameters import Parameter, ParameterSpace

REPEATS = 200
TIMES = np.linspace(0.0, 3.0, 60)
LOSSES = {"plain": None, "HuberLoss": HuberLoss(), "TukeyLoss": TukeyLoss()}


class Decay(eqx.Module):
    """level + size·exp(-rate·t)."""

    size: Float[Array, ""]
    rate: Float[Array, ""]
    level: Float[Array, ""]


class DecayResidual(AbstractResidual):
    """A decay against samples of unit variance."""

    samples: Float[Array, " n"]

    def __call__(self, model):
        return model.level + model.size * jnp.exp(-model.rate * jnp.asarray(TIMES)) - self.samples


TRUTH = Decay(jnp.asarray(20.0), jnp.asarray(1.5), jnp.asarray(4.0))
START = Decay(jnp.asarray(15.0), jnp.asarray(1.0), jnp.asarray(5.0))
SPACE = ParameterSpace([Parameter("size"), Parameter("rate", scale="log"), Parameter("level")])


def noisy(outliers):
    """Samples of many repeats; of each a tenth far off to one side ("above") or to either ("around")."""
    rng = np.random.default_rng(7)
    clean = np.asarray(DecayResidual(jnp.zeros(TIMES.size))(TRUTH))
    samples = clean + rng.standard_normal((REPEATS, TIMES.size))
    if outliers:
        places = rng.permuted(np.tile(np.arange(TIMES.size), (REPEATS, 1)), axis=1)[:, : TIMES.size // 10]
        far = 15.0 + 10.0 * rng.random(places.shape)
        side = 1.0 if outliers == "above" else rng.choice([-1.0, 1.0], places.shape)
        np.put_along_axis(samples, places, np.take_along_axis(clean[None], places, 1) + side * far, 1)
    return jnp.asarray(samples)


@eqx.filter_jit
def fits(samples, loss):
    def one(row):
        plain = DecayResidual(row)
        residual = plain if loss is None else RobustResidual(plain, loss)
        return solve_raw(residual, START, SPACE, BoundedLevenbergMarquardt(), 200)

    return eqx.filter_vmap(one)(samples)


@cache
def coverage(outliers, name):
    """Share of intervals that hold the truth and mean error in standard errors of each parameter; steps taken."""
    solved = jax.tree.map(np.asarray, fits(noisy(outliers), LOSSES[name]))
    truth = np.asarray(SPACE.pack(TRUTH))
    errors, freedom = [], 0
    for i in range(REPEATS):
        found = covariance_of(
            solved.residual[i],
            solved.jacobian[i],
            solved.active[i],
            curvature=None if solved.curvature is None else solved.curvature[i],
        )
        freedom = found.degrees_of_freedom
        errors.append((solved.vector[i] - truth) / np.sqrt(np.diag(found.matrix)))
    inside = np.abs(errors) <= stats.t.ppf(0.975, freedom)
    return inside.mean(axis=0), np.mean(errors, axis=0), np.asarray(solved.steps)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plain", "HuberLoss", "TukeyLoss"])
def test_intervals_hold_without_outliers(name):
    inside, bias, _ = coverage(None, name)
    assert 0.93 <= inside.mean() <= 0.97, inside
    assert np.all(np.abs(bias) < 0.25)


@pytest.mark.slow
@pytest.mark.parametrize("outliers", ["around", "above"])
@pytest.mark.parametrize("name", ["HuberLoss", "TukeyLoss"])
def test_robust_intervals_hold_with_a_tenth_of_outliers(name, outliers):
    inside, _, steps = coverage(outliers, name)
    assert 0.90 <= inside.mean() <= 0.98, inside
    assert np.all(inside >= 0.88)
    assert steps.max() < 100


@pytest.mark.slow
def test_least_squares_is_off_where_outliers_lie_to_one_side():
    inside, bias, _ = coverage("above", "plain")
    assert inside[2] < 0.8
    assert bias[2] > 1.0
    # The loss that lets go of outliers altogether is not biased by them, the convex one is a little.
    assert abs(coverage("above", "TukeyLoss")[1][2]) < 0.2
    assert 0.2 < coverage("above", "HuberLoss")[1][2] < 0.8
