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
def studies(request):
    """Indices of 100 seeds, and the true ones."""
    fn, space, first, total = CASES[request.param]
    designs = [sobol_samples(space, N, seed=seed) for seed in SEEDS]
    values = evaluate(fn, space, np.concatenate([d.values for d in designs]), chunk=8192)
    parts = np.split(values, len(designs))
    return [sobol_indices(d, v, resamples=50) for d, v in zip(designs, parts, strict=True)], first, total


def test_mean_over_100_seeds_is_within_three_standard_errors(studies):
    found, first, total = studies
    for name, true in (("S1", first), ("ST", total)):
        each = np.stack([getattr(study, name)[0] for study in found])
        error = each.std(axis=0, ddof=1) / np.sqrt(len(each))
        # The published values of Ishigami have four digits; a parameter without effect has no spread either.
        assert np.all(np.abs(each.mean(axis=0) - true) <= 3 * error + 6e-5), name


def test_intervals_cover_the_true_indices(studies):
    """The bootstrap takes the points for independent; a Sobol sequence is better, so it covers as often."""
    found, first, total = studies
    for index, true in (("S1", first), ("ST", total)):
        inside = [np.abs(getattr(s, index)[0] - true) <= getattr(s, f"{index}_conf")[0] + 6e-5 for s in found]
        assert np.mean(inside) > 0.9, index


def test_spread_over_seeds_falls_with_n(studies):
    """At least as the square root of n, as for a random sample."""
    found, _, total = studies
    each = np.stack([s.ST_by_size[:, 0] for s in found])
    rms = np.sqrt(np.mean((each - total) ** 2, axis=(0, 2)))
    assert found[0].sizes.tolist() == [16, 32, 64, 128]
    assert np.all(np.diff(rms) < 0)
    assert rms[-1] < 1.1 * rms[0] / np.sqrt(8)
