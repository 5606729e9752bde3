"""Elementary effects: closed forms, and SALib's own analysis of the same trajectories."""

import jax.numpy as jnp
import numpy as np
import pytest
from SALib.analyze import morris as analysis
from SALib.sample import morris as sampler

from sensitivity import ElementaryEffects, evaluate, morris
from sensitivity._unit_cube import from_unit
from tests.sensitivity_functions import ISHIGAMI, LINEAR, SLOPES, ishigami, linear
from twin.parameters import Parameter, ParameterSpace


def test_a_linear_model_has_its_slopes_over_the_ranges_and_no_spread():
    found = morris(linear, LINEAR, seed=1, trajectories=8)
    np.testing.assert_allclose(found.mu[0], 2 * SLOPES, atol=1e-11)
    np.testing.assert_allclose(found.mu_star[0], 2 * np.abs(SLOPES), atol=1e-11)
    # The root of a difference of squares: rounding at 1e3 shows here.
    np.testing.assert_allclose(found.sigma[0], 0.0, atol=1e-6)
    np.testing.assert_allclose(found.mu_star_conf[0], 0.0, atol=1e-11)


def test_a_log_parameter_moves_in_its_logarithm():
    space = ParameterSpace([Parameter("k", "N/m", 1e4, 1e8, scale="log"), Parameter("c", "", 0.0, 1.0)])
    found = morris(lambda x: jnp.log10(x[0]) + 0 * x[1], space, seed=1, trajectories=8)
    np.testing.assert_allclose(found.mu[0], [4.0, 0.0], atol=1e-11)


def test_a_product_on_two_levels():
    """x·y on {0, 1}²: each effect is the other's level, so σ² = 1/4·T/(T-1) where half of the levels are one."""
    space = ParameterSpace([Parameter(name, "", 0.0, 1.0) for name in "xy"])
    found = morris(lambda x: x[0] * x[1], space, seed=3, trajectories=400, levels=2)
    share = found.mu[0]
    np.testing.assert_allclose(share, 0.5, atol=0.1)
    np.testing.assert_allclose(found.sigma[0], np.sqrt(share * (1 - share) * 400 / 399), rtol=1e-10)
    np.testing.assert_allclose(found.mu_conf[0], 1.96 * found.sigma[0] / 20, rtol=0.25)
    np.testing.assert_allclose(found.mu_star, found.mu)


@pytest.mark.parametrize("levels", [4, 8])
def test_agrees_with_salib(levels):
    def two(x):
        return jnp.stack([ishigami(x), jnp.exp(x[0]) * x[1]])

    found = morris(two, ISHIGAMI, seed=5, trajectories=30, levels=levels, resamples=2000)
    problem = {"num_vars": 3, "names": list(ISHIGAMI.paths), "bounds": [[0, 1]] * 3}
    unit = sampler.sample(dict(problem), 30, num_levels=levels, seed=5)
    values = evaluate(two, ISHIGAMI, from_unit(ISHIGAMI, unit))
    for column in range(2):
        theirs = analysis.analyze(dict(problem), unit, values[:, column], num_levels=levels, seed=5, num_resamples=2000)
        for name in ("mu", "mu_star", "sigma"):
            ours = getattr(found, name)[column]
            np.testing.assert_allclose(ours, np.asarray(theirs[name]), rtol=1e-10, atol=1e-10, err_msg=name)
        # Theirs draws for each parameter anew.
        np.testing.assert_allclose(found.mu_star_conf[column], theirs["mu_star_conf"], rtol=0.15)


def test_does_not_touch_the_global_generator():
    """Several of SALib's methods seed it (trap 31)."""
    np.random.seed(3)  # noqa: NPY002
    before = np.random.random()  # noqa: NPY002
    np.random.seed(3)  # noqa: NPY002
    first = morris(linear, LINEAR, seed=1)
    assert np.random.random() == before  # noqa: NPY002
    np.testing.assert_array_equal(first.mu, morris(linear, LINEAR, seed=1).mu)


def test_round_trip(tmp_path):
    found = morris(ishigami, ISHIGAMI, seed=1, outputs=["torque"])
    found.save(tmp_path / "effects")
    loaded = ElementaryEffects.load(tmp_path / "effects.npz")
    assert repr(loaded) == repr(found)
    assert loaded.space == found.space and loaded.outputs == ("torque",)
    assert found.to_dataframe().loc[("torque", "x2"), "mu_star"] == found.mu_star[0, 1]
    assert "32 trajectories" in found._repr_html_()
