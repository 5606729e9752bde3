"""Intervals of the reference machine's 27 parameters in repeated measurements with noise."""

import numpy as np
import pytest

from fitting.identification.machine_study import interval_coverage

# A right interval of 95 % holds the truth in 180 to 198 of 200 repeats but for a probability of 0.16 %; of 27 such
# intervals one fails with a probability of 4 %. The noise has fixed seeds, so that it passes always or never.
REPEATS = 200
# In this truth half the nominal value: its interval often reaches below the bound of a third.
WEAK = "joints.mounting_2.viscous.x"


@pytest.mark.slow
def test_intervals_hold_the_truth_for_every_identified_parameter():
    """0.1 % noise on frequencies, 1 % on shapes, 5 % on damping ratios."""
    found = interval_coverage(1, REPEATS)
    assert found.failures == 0
    table = found.to_dataframe()
    assert len(table) == 27
    assert table["coverage"].between(0.90, 0.99).all(), table.to_string()
    # 5400 intervals: a deviation of 1 % is three standard errors.
    assert abs(found.pooled - 0.95) < 0.01
    assert np.all(table["identified"].drop(WEAK) == 1.0)
    assert 0.8 < table["identified"][WEAK] < 0.95
    assert table["relative standard error"].idxmax() == WEAK
