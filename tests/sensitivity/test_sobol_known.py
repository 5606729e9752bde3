"""Sobol indices of functions with known ones: no bias over 100 seeds, intervals that cover, and convergence with n."""

import numpy as np
import pytest

from sensitivity import evaluate, sobol_indices, sobol_samples
from tests import sensitivity_functions as known

SEEDS = range(1, 101)
N = 128
CASES = {
    "ishigami": (known.ishigami, known.ISHIGAMI, known.ISHIGAMI_S1, known.ISHIGAMI_ST),
    "g-function": (known.g_function, known.G_FUNCTION, *known.g_indices()),
    "linear": (known.linear, known.LINEAR, known.linear_indices(), known.linear_indices()),
}


@pytest.fixture(scope="module", params=CASES)
def study(request):
    """Indices of 100 seeds, each seed as an output of one study, and the true ones."""
    fn, space, first, total = CASES[request.param]
    designs = [sobol_samples(space, N, seed=seed) for seed in SEEDS]
    values = evaluate(fn, space, np.concatenate([d.values for d in designs]), chunk=8192)
    columns = np.stack(np.split(values, len(designs)), axis=1)
    return sobol_indices(designs[0], columns), first, total


def test_mean_over_100_seeds_is_within_three_standard_errors(study):
    found, first, total = study
    for each, true in ((found.S1, first), (found.ST, total)):
        error = each.std(axis=0, ddof=1) / np.sqrt(len(each))
        # The published values of Ishigami have four digits; a parameter without effect has no spread either.
        assert np.all(np.abs(each.mean(axis=0) - true) <= 3 * error + 6e-5)


def test_intervals_cover_the_true_indices(study):
    """The bootstrap takes the points for independent; a Sobol sequence is better, so it covers as often."""
    found, first, total = study
    assert np.mean(np.abs(found.S1 - first) <= found.S1_conf + 6e-5) > 0.9
    assert np.mean(np.abs(found.ST - total) <= found.ST_conf + 6e-5) > 0.9


def test_spread_over_seeds_falls_with_n(study):
    """At least as the square root of n, as for a random sample."""
    found, _, total = study
    rms = np.sqrt(np.mean((found.ST_by_size - total) ** 2, axis=(1, 2)))
    assert found.sizes.tolist() == [16, 32, 64, 128]
    assert np.all(np.diff(rms) < 0)
    assert rms[-1] < 1.1 * rms[0] / np.sqrt(8)
