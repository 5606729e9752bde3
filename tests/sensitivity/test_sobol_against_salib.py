"""SALib's own analysis of the same samples agrees to 1e-10: indices, and intervals from the same draws."""

import jax.numpy as jnp
import numpy as np
import pytest
from SALib.analyze import sobol as salib

from sensitivity import evaluate, sobol_indices, sobol_samples
from twin.parameters import Parameter, ParameterSpace

SPACE = ParameterSpace([Parameter(f"k{i}", "N/m", 1e6, 1e8, scale="log" if i % 2 else "linear") for i in range(5)])
MIXING = np.random.default_rng(7).normal(size=(5, 7))


def outputs(x):
    u = jnp.log(x / 1e7)
    mixed = jnp.sin(u @ jnp.asarray(MIXING)) * u[0] + u[1] * u[2]
    # Large means and other magnitudes are what the normalisation is for.
    return mixed * 10.0 ** jnp.arange(-3, 4) + 1e3


@pytest.mark.parametrize("second_order", [False, True])
@pytest.mark.parametrize("groups", [None, {"bearing": ["k0", "k3"], "guide": ["k2"]}])
def test_agrees_with_salib(second_order, groups):
    samples = sobol_samples(SPACE, 64, seed=3, second_order=second_order, groups=groups)
    values = evaluate(outputs, SPACE, samples.values)
    found = sobol_indices(samples, values)
    problem = {"num_vars": 5, "names": list(SPACE.paths), "bounds": [[0, 1]] * 5}
    if groups:
        problem["groups"] = list(samples.groups)
    names = ("S1", "S1_conf", "ST", "ST_conf", *(("S2", "S2_conf") if second_order else ()))
    for column in range(7):
        theirs = salib.analyze(problem, values[:, column], calc_second_order=second_order, seed=3)
        for name in names:
            ours = getattr(found, name)[column]
            np.testing.assert_allclose(ours, theirs[name], rtol=0, atol=1e-10, err_msg=name)
    assert found.S2.shape == ((7, len(found.names), len(found.names)) if second_order else (7, 0, 0))


def test_samples_are_those_of_salib():
    from SALib.sample import sobol as sampler

    problem = {"num_vars": 5, "names": list(SPACE.paths), "bounds": [[0, 1]] * 5}
    unit = sampler.sample(problem, 16, calc_second_order=False, seed=5)
    values = sobol_samples(SPACE, 16, seed=5).values
    np.testing.assert_allclose(values[:, 0], 1e6 + unit[:, 0] * (1e8 - 1e6))
    np.testing.assert_allclose(values[:, 1], 1e6 * 100 ** unit[:, 1])


def test_earlier_sizes_are_what_a_smaller_study_had_said():
    large = sobol_samples(SPACE, 64, seed=3)
    small = sobol_samples(SPACE, 16, seed=3)
    np.testing.assert_array_equal(large.values[: len(small)], small.values)
    values = evaluate(outputs, SPACE, large.values)
    ours, theirs = sobol_indices(large, values).at(16), sobol_indices(small, values[: len(small)])
    assert ours.n == 16
    for name in ("S1", "S1_conf", "ST", "ST_conf"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), atol=1e-13)
