"""The search for a gain on Table 1 of Mauro et al., on kinks, bounds and failures."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from fitting.curve_search import search_curve

# k_v [1/min], error [µm], τ [s], energy [kJ]; the error with the sign that its change through zero tells.
TABLE = np.array(
    """625 758 1.548 2.948; 925 479 1.434 3.508; 1225 337 1.386 3.850; 1525 246 1.363 4.068; 1825 173 1.351 4.211;
    2125 102 1.343 4.309; 2425 41 1.338 4.378; 2725 5 1.334 4.427; 3025 -36 1.331 4.462; 3325 -55 1.329 4.488;
    3625 -64 1.327 4.507; 3925 -65 1.325 4.521; 4225 -59 1.324 4.531; 4525 -51 1.323 4.540; 4825 -44 1.322 4.545;
    5125 -38 1.321 4.550; 5425 -33 1.320 4.553; 5725 -29 1.319 4.556; 6025 -25 1.319 4.558""".replace(";", " ").split(),
    dtype=float,
).reshape(-1, 4)
CURVE = PchipInterpolator(TABLE[:, 0], TABLE[:, [1, 3, 2]])


def cost_of(measures):
    return np.abs(measures[0]) / 758 - 2.948 / measures[1] - 1.319 / measures[2]  # eq. 22


def from_table(k):
    return CURVE(k), CURVE.derivative()(k)


def test_the_optimum_of_the_published_table():
    """A third of the table's range is one wide basin with its minimum at the upper bound; the best gain is a kink."""
    found = search_curve(from_table, cost_of, 625.0, 6025.0)
    fine = np.linspace(625, 6025, 200_001)
    costs = cost_of(CURVE(fine).T)
    assert found.stop == "converged"
    assert found.tried.size <= 15
    assert found.cost <= costs.min() + 1e-5
    assert found.best == pytest.approx(fine[np.argmin(costs)], abs=0.5)
    assert 2725 < found.best < 3025


def test_kink_is_met_like_a_root():
    def measure(x):
        return np.array([np.expm1(x - 1.2345)]), np.array([np.exp(x - 1.2345)])

    found = search_curve(measure, lambda m: np.abs(m[0]), -3.0, 4.0)
    assert found.best == pytest.approx(1.2345, abs=1e-6)
    assert found.tried.size <= 10


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_optimum_at_a_bound(side):
    found = search_curve(lambda x: (np.array([side * x]), np.array([side])), lambda m: m[0], 0.0, 2.0)
    assert found.stop == "converged"
    assert found.best == (0.0 if side > 0 else 2.0)
    assert found.tried.size == 5


def test_failed_points_are_left_out_and_the_gap_is_narrowed():
    def measure(x):
        return (np.array([np.nan]), np.array([np.nan])) if x > 1.9 else (np.array([-x]), np.array([-1.0]))

    found = search_curve(measure, lambda m: m[0], 0.0, 4.0)
    assert found.stop == "converged"
    assert 1.85 <= found.best <= 1.9
    assert np.isnan(found.costs).sum() >= 2


def test_nothing_succeeds_and_too_few_evaluations():
    nothing = search_curve(lambda x: (np.array([np.nan]), np.array([0.0])), lambda m: m[0], 0.0, 1.0)
    assert nothing.stop == "not_finite"
    assert np.isnan(nothing.best)
    short = search_curve(
        lambda x: (np.array([np.sin(9 * x)]), np.array([9 * np.cos(9 * x)])),
        lambda m: np.abs(m[0] - 0.3),
        0.0,
        3.0,
        most=6,
    )
    assert short.stop == "too_many_steps"
    assert short.tried.size == 6
