"""Planted unidentifiable parameters are all reported, and none falsely; what would help is found."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.design import rank_experiments
from fitting.fit import fit
from fitting.identifiability import identifiability
from tests.fitting.curves import Coefficients, box, line, noisy
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

X = np.linspace(0, 3, 60)


def planted(b, x):
    """b0·b1 is one amplitude, b3 + b4 one offset; b5 does nothing; b2 is alone."""
    return b[0] * b[1] * jnp.exp(-b[2] * x) + b[3] + b[4] + 0 * b[5]


def nearly(b, x):
    """Two decays so alike that the data cannot tell their amplitudes apart."""
    return b[0] * jnp.exp(-b[1] * x) + b[2] * jnp.exp(-(b[1] + 1e-5) * x)


def fitted(curve, truth, space, deviation=0.01, seed=0, x=X, start=1.1):
    evidence = noisy(curve, truth, x, deviation, seed)
    return fit(evidence, Coefficients(start * jnp.asarray(truth)), space, max_steps=200)


@pytest.mark.parametrize("seed", range(4))
def test_planted_pairs_are_all_found_and_nothing_else(seed):
    report = identifiability(fitted(planted, [2.0, 1.5, 1.0, 0.4, 0.6, 1.0], box(6, 0.01, 100.0, "log"), seed=seed))
    assert report.groups == (("b.0", "b.1"), ("b.3", "b.4"))
    assert report["b.0"].partners == ("b.1",)
    assert report["b.3"].partners == ("b.4",)
    assert report["b.2"].kind == "identified"
    assert report["b.5"].kind == "not seen"
    assert report.collinearity_index == np.inf
    assert "combination of b.0, b.1" in report.message


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_reported_of_a_sound_fit(seed):
    report = identifiability(fitted(line, [1.0, 2.0], box(2, -10.0, 10.0), seed=seed))
    assert report.groups == ()
    assert {v.kind for v in report.verdicts} == {"identified"}
    assert report.message == "All parameters are identified."
    # A line over [0, 3]: the inflation of both is 1/√(1 - r²), r² = mean(x)²/mean(x²).
    expected = 1 / np.sqrt(1 - X.mean() ** 2 / np.mean(X**2))
    assert report["b.0"].collinearity == pytest.approx(expected, rel=1e-8)


def test_a_pair_that_the_noise_hides_is_reported_as_correlated():
    report = identifiability(fitted(nearly, [1.0, 1.0, 1.0], box(3, 0.01, 100.0, "log")))
    # The difference of the amplitudes shifts the decay as the rate does, so all three take part.
    assert report.groups == (("b.0", "b.1", "b.2"),)
    assert report["b.0"].collinearity > 100


def test_a_prior_identifies_what_the_data_do_not():
    space = ParameterSpace(
        [
            Parameter(f"b.{i}", "", 0.01, 100.0, scale="log", prior=(1.5, 0.05) if i == 1 else None)
            for i in range(6)
            if i not in (4, 5)
        ]
    )
    assert identifiability(fitted(planted, [2.0, 1.5, 1.0, 0.4, 0.6, 1.0], space, start=1.0)).groups == ()


@pytest.mark.slow
def test_the_experiment_that_would_help_is_found():
    """A line known near x = 0 only: measuring far away tells the slope, measuring there again does not."""
    result = fitted(line, [1.0, 2.0], box(2, -10.0, 10.0), x=np.linspace(0, 0.1, 20), deviation=0.1)
    candidates = {name: noisy(line, [1.0, 2.0], x, 0.1) for name, x in (("near", [0.0] * 5), ("far", [3.0] * 5))}
    ranking = rank_experiments(result, candidates)
    assert ranking.best == "far"
    assert ranking.standard_errors[1, 1] < 0.1 * ranking.standard_errors[0, 1]
    assert ranking.effort.sum() == pytest.approx(1, abs=1e-9)
    # Closed form: det(M₀ + J'J) / det M₀ by the matrix determinant lemma.
    root = np.linalg.inv(result.factor.T / result.rms)  # the bounds' weak knowledge is negligible here
    for name, x in (("near", 0.0), ("far", 3.0)):
        rows = np.tile([20.0, 20.0 * x], (5, 1)) / 0.1
        gain = np.linalg.slogdet(np.eye(2) + root @ rows.T @ rows @ root.T)[1]
        assert ranking.gains[ranking.names.index(name)] == pytest.approx(gain, rel=0.05)


def test_effort_is_shared_as_the_equivalence_theorem_asks():
    """For a line on [-1, 1] and nothing known, D-optimal is half the effort at each end."""
    result = fitted(line, [1.0, 2.0], box(2, -10.0, 10.0), deviation=100.0, x=np.linspace(-1, 1, 20))
    points = np.linspace(-1, 1, 5)
    candidates = {f"{x:g}": noisy(line, [1.0, 2.0], [x] * 4, 1e-3) for x in points}
    ranking = rank_experiments(result, candidates)
    np.testing.assert_allclose(ranking.effort, [0.5, 0, 0, 0, 0.5], atol=1e-4)
    assert np.all(ranking.sensitivity <= ranking.bound * (1 + 1e-6))
    assert ranking.bound == pytest.approx(2, rel=1e-3)


def test_wrong_requests_are_refused():
    result = fitted(line, [1.0, 2.0], box(2, -10.0, 10.0))
    with pytest.raises(InputError, match="at least one candidate"):
        rank_experiments(result, {})
    with pytest.raises(InputError, match="limit must be positive"):
        identifiability(result, limit=0.0)
    with pytest.raises(InputError, match="was not fitted"):
        identifiability(result)["b.9"]
    with pytest.raises(InputError, match="'hopeless' has no finite Jacobian"):
        rank_experiments(result, {"hopeless": noisy(line, [1.0, 2.0], [np.nan], 0.1)})
