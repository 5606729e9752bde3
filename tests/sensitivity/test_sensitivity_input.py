"""Bad input to the sensitivity studies: one clear error each, that names the thing and the cure."""

import jax.numpy as jnp
import numpy as np
import pytest

from sensitivity import (
    derivative_measures,
    evaluate,
    morris,
    partition,
    screen,
    sobol,
    sobol_indices,
    sobol_samples,
)
from tests.sensitivity_functions import ISHIGAMI, ishigami
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

STUDIES = [sobol, morris, derivative_measures]


@pytest.mark.parametrize("study", STUDIES)
@pytest.mark.parametrize(
    "parameter",
    [Parameter("open", "m"), Parameter("open", "m", 0.0), Parameter("open", "m", 0.0, 2.0, scale="log")],
)
def test_missing_bounds_are_named(study, parameter):
    space = ParameterSpace([Parameter("closed", "m", 0.0, 1.0), parameter])
    with pytest.raises(InputError, match=r"bounds, but these have none.*: open\. Give Parameter"):
        study(jnp.sum, space, seed=1)


@pytest.mark.parametrize("study", STUDIES)
@pytest.mark.parametrize("seed", [0, -1, True])
def test_seed_zero_trap(study, seed):
    """SALib's analysis takes seed 0 for no seed at all (trap 31)."""
    with pytest.raises(InputError, match="seed must be a whole number of at least 1"):
        study(ishigami, ISHIGAMI, seed=seed)


@pytest.mark.parametrize("study", [sobol, derivative_measures])
@pytest.mark.parametrize("n, cure", [(1000, "Take 512 or 1024"), (0, "Take 8 or 16"), (4, "Take 8 or 16")])
def test_n_must_be_a_power_of_two(study, n, cure):
    """SALib only warns (trap 32)."""
    with pytest.raises(InputError, match=rf"power of two.*{n}.*{cure}"):
        study(ishigami, ISHIGAMI, n=n, seed=1)


def test_one_nan_is_refused_with_its_sample():
    """One NaN would give zero indices throughout without a word (trap 30)."""
    samples = sobol_samples(ISHIGAMI, 16, seed=1)
    values = np.array(evaluate(ishigami, ISHIGAMI, samples.values))
    values[37] = np.nan
    with pytest.raises(InputError) as caught:
        sobol_indices(samples, values, outputs=["torque"])
    message = str(caught.value)
    assert "Output 'torque' of sample 37 is nan" in message
    assert f"x1 = {samples.values[37, 0]:.10g} rad" in message
    assert "1 of 80 samples are not finite" in message


@pytest.mark.parametrize("study", STUDIES)
def test_a_function_with_infinite_values_is_refused(study):
    with pytest.raises(InputError, match=r"Output '1' of sample \d+ is (inf|nan), at x1 = "):
        study(lambda x: jnp.stack([x[0], jnp.where(x[1] > 3.0, jnp.inf, x[2])]), ISHIGAMI, seed=1)


def test_a_derivative_that_is_not_finite_is_refused():
    def fn(x):
        return jnp.sqrt(jnp.maximum(x[0], 0.0))

    with pytest.raises(InputError, match=r"The derivative of '0 with respect to x1' of sample \d+ is"):
        derivative_measures(fn, ISHIGAMI, seed=1)


@pytest.mark.parametrize(
    "groups, message",
    [
        ({"bed": ["x1", "x9"]}, "names 'x9', but the space has x1, x2, x3"),
        ({"bed": ["x1"], "table": ["x1"]}, "'x1' is in the groups 'bed' and 'table'"),
        ({"bed": []}, "must be a list of paths"),
        ({"x2": ["x1"]}, "has the name of a parameter"),
        ({"all": ["x1", "x2", "x3"]}, "All parameters are in the one group 'all'"),
    ],
)
def test_groups(groups, message):
    with pytest.raises(InputError, match=message):
        sobol_samples(ISHIGAMI, 16, seed=1, groups=groups)


def test_values_of_other_shapes_and_kinds():
    samples = sobol_samples(ISHIGAMI, 16, seed=1)
    rows = len(samples)
    for values, message in (
        (np.ones(rows - 1), rf"shape \({rows - 1},\), but {rows} rows were expected"),
        (np.ones((rows, 2, 2)), "one column per output"),
        (np.ones(rows) * 1j, "complex128 values, but a variance needs real numbers"),
        (np.asarray(["x"] * rows), "but a variance needs real numbers"),
        ({"a": np.ones(rows), "b": np.ones(3)}, r"b has the shape \(3,\)"),
    ):
        with pytest.raises(InputError, match=message):
            sobol_indices(samples, values)
    with pytest.raises(InputError, match="Return a number, a vector, or a dict of such"):
        morris(lambda x: (x[0], x[1]), ISHIGAMI, seed=1)
    with pytest.raises(InputError, match="holds 1 names, but there are 2 outputs"):
        sobol_indices(samples, np.ones((rows, 2)), outputs=["a"])
    with pytest.raises(InputError, match="'a' is given twice"):
        sobol_indices(samples, np.ones((rows, 2)), outputs=["a", "a"])
    with pytest.raises(InputError, match="row for each of the 80 samples"):
        samples.blocks(np.ones(3))
    with pytest.raises(InputError, match="No free parameter 'x7'"):
        samples.distinct(["x7"])
    with pytest.raises(InputError, match="shape \\(4, 2\\)"):
        evaluate(ishigami, ISHIGAMI, np.ones((4, 2)))
    with pytest.raises(InputError, match="chunk must be at least 1"):
        evaluate(ishigami, ISHIGAMI, samples.values, chunk=0)


def test_settings():
    samples = sobol_samples(ISHIGAMI, 16, seed=1)
    values = evaluate(ishigami, ISHIGAMI, samples.values)
    with pytest.raises(InputError, match="confidence must be between 0 and 1"):
        sobol_indices(samples, values, confidence=95.0)
    with pytest.raises(InputError, match="resamples must be at least 2"):
        sobol_indices(samples, values, resamples=1)
    with pytest.raises(InputError, match="levels must be an even number"):
        morris(ishigami, ISHIGAMI, seed=1, levels=3)
    with pytest.raises(InputError, match="trajectories must be at least 2"):
        morris(ishigami, ISHIGAMI, seed=1, trajectories=1)
    with pytest.raises(InputError, match='mode must be "auto"'):
        derivative_measures(ishigami, ISHIGAMI, seed=1, mode="finite")
    found = sobol_indices(samples, values)
    with pytest.raises(InputError, match="threshold must be between 0 and 1"):
        partition(found, 1.0)
    with pytest.raises(InputError, match="threshold must be between 0 and 1"):
        screen(derivative_measures(ishigami, ISHIGAMI, seed=1, n=8), 0.0)
    with pytest.raises(InputError, match="no estimate at 4 base points, only at 8, 16"):
        found.at(4)
    with pytest.raises(InputError, match="No output 'b'; there are 1: 0"):
        found.index("b")
    with pytest.raises(InputError, match="There are no second-order indices"):
        found.second_order_dataframe()
