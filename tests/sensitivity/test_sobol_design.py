"""The design's structure: blocks, rows that need not be evaluated, functions of models and of vectors, dicts."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from sensitivity import SobolSamples, derivative_measures, evaluate, sobol, sobol_indices, sobol_samples
from twin._checks import as_scalar
from twin.parameters import Parameter, ParameterSpace


class Spring(eqx.Module):
    """A spring and a damper."""

    stiffness: Float[Array, ""] = eqx.field(converter=as_scalar)
    damping: Float[Array, ""] = eqx.field(converter=as_scalar)
    mass: Float[Array, ""] = eqx.field(converter=as_scalar)


MODEL = Spring(1e6, 10.0, 4.0)
SPACE = ParameterSpace(
    [
        Parameter("stiffness", "N/m", 5e5, 2e6, scale="log"),
        Parameter("damping", "N·s/m", 5.0, 20.0),
        Parameter("mass", "kg", 3.0, 5.0),
    ]
)


def modes(model):
    root = jnp.sqrt(model.stiffness * model.mass)
    return {"frequency": jnp.sqrt(model.stiffness / model.mass), "damping": jnp.stack([model.damping / root, root])}


def of_vector(x):
    return jnp.stack([jnp.sqrt(x[0] / x[2]), x[1] / jnp.sqrt(x[0] * x[2])])


@pytest.mark.parametrize("second_order", [False, True])
def test_blocks_are_a_with_one_parameter_of_b(second_order):
    samples = sobol_samples(SPACE, 16, seed=2, second_order=second_order)
    blocks = samples.blocks()
    assert len(samples) == 16 * samples.step == 16 * (8 if second_order else 5)
    for name, base, other in (("AB", "A", "B"), ("BA", "B", "A"))[: 2 if second_order else 1]:
        for j in range(3):
            expected = blocks[base].copy()
            expected[:, j] = blocks[other][:, j]
            np.testing.assert_array_equal(blocks[name][:, j], expected)
    assert repr(samples).startswith("SobolSamples: 16 base points")


@pytest.mark.parametrize("groups", [None, {"body": ["mass", "damping"]}])
@pytest.mark.parametrize("second_order", [False, True])
def test_only_distinct_rows_need_be_evaluated(second_order, groups):
    samples = sobol_samples(SPACE, 16, seed=2, second_order=second_order, groups=groups)
    distinct = samples.distinct(["stiffness", "mass"])
    full = evaluate(of_vector, SPACE, samples.values)[:, 0]
    spread = evaluate(of_vector, SPACE, distinct.values)[:, 0][distinct.back]
    np.testing.assert_array_equal(spread, full)
    # A, B, and two of the three parameters, or both groups.
    assert len(distinct.values) == 16 * (4 + 2 * second_order)
    assert len(samples.distinct("damping").values) == 16 * (3 + second_order)


def test_function_of_the_model_of_the_vector_and_a_dict_say_the_same():
    by_model = sobol(modes, SPACE, model=MODEL, n=16, seed=4)
    by_vector = sobol(of_vector, SPACE, n=16, seed=4, outputs=["frequency", "damping"])
    assert by_model.outputs == ("frequency", "damping 0", "damping 1")
    assert by_vector.outputs == ("frequency", "damping")
    assert by_model.units == ("N/m", "N·s/m", "kg")
    np.testing.assert_allclose(by_model.ST[:2], by_vector.ST, atol=1e-12)


def test_chunks_change_nothing():
    samples = sobol_samples(SPACE, 16, seed=2)
    whole = evaluate(of_vector, SPACE, samples.values, chunk=10_000)
    np.testing.assert_allclose(evaluate(of_vector, SPACE, samples.values, chunk=7), whole, rtol=1e-14)


def test_an_output_that_does_not_vary_has_no_indices_and_says_so():
    samples = sobol_samples(SPACE, 16, seed=2)
    constant = np.full(len(samples), 0.1)
    varying = samples.values[:, 1]
    found = sobol_indices(samples, {"still": constant, "moved": varying})
    assert found.variance[0] == 0 and found.variance[1] > 0
    assert np.all(found.ST[0] == 0) and np.all(found.S1[0] == 0) and np.all(found.ST_conf[0] == 0)
    assert "1 of the outputs do not vary" in repr(found)
    assert found.ST[1, 1] > 0.5


def test_second_order_of_a_product():
    """x·y on [-1, 1]²: nothing of first order, all of second."""
    space = ParameterSpace([Parameter(name, "", -1.0, 1.0) for name in ("x", "y", "z")])
    found = sobol(lambda v: v[0] * v[1] + 0 * v[2], space, n=512, seed=1, second_order=True)
    table = found.second_order_dataframe()["S2"]
    assert table.loc[("0", "x", "y")] == pytest.approx(1.0, abs=0.1)
    assert table.loc[("0", "x", "z")] == pytest.approx(0.0, abs=0.05)


def test_a_function_is_traced_once():
    """Studies that are repeated with another seed, or a last chunk that is not full, compile nothing (trap 35)."""
    traces = []

    def counted(x):
        traces.append(1)
        return x[0] * x[1]

    for seed in (1, 2, 3):
        sobol(counted, SPACE, n=16, seed=seed, chunk=32)
    assert len(traces) == 1
    derivative_measures(counted, SPACE, n=16, seed=1)
    first = len(traces)
    derivative_measures(counted, SPACE, n=16, seed=2)
    assert len(traces) == first


@pytest.mark.parametrize("second_order", [False, True])
def test_the_design_is_kept_with_the_study(tmp_path, second_order):
    samples = sobol_samples(SPACE, 16, seed=2, second_order=second_order, groups={"body": ["mass", "damping"]})
    samples.save(tmp_path / "design")
    loaded = SobolSamples.load(tmp_path / "design.npz")
    np.testing.assert_array_equal(loaded.values, samples.values)
    assert (loaded.n, loaded.seed, loaded.groups, loaded.space) == (16, 2, samples.groups, SPACE)
    np.testing.assert_array_equal(loaded.distinct("mass").back, samples.distinct("mass").back)
