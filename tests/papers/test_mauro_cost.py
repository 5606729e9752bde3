"""Mauro et al., eq. 22 on Table 1, and its use for a single design."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.identification.mauro_table import OPTIMAL_GAIN, REPEATED_GAIN, mauro_table
from twin._checks import InputError
from twin.performance import positioning_cost

TABLE = mauro_table()


def test_every_printed_cost_comes_back():
    cost = positioning_cost(TABLE.error, TABLE.energy, TABLE.time)
    off = np.abs(np.asarray(cost) - TABLE.cost)
    assert np.max(off) < 0.0025
    # The units of the table do not matter.
    in_si = positioning_cost(1e-6 * TABLE.error, 1e3 * TABLE.energy, TABLE.time)
    np.testing.assert_allclose(in_si, cost, rtol=1e-14)
    assert TABLE.gain[np.argmin(cost)] == OPTIMAL_GAIN


def test_the_repeated_row():
    row, following = np.flatnonzero((TABLE.gain == REPEATED_GAIN) | (TABLE.gain == OPTIMAL_GAIN))
    assert TABLE.time[row] == TABLE.time[following] and TABLE.energy[row] == TABLE.energy[following]
    # Between its neighbours, the cost is nearer to the printed one than with the values printed.
    cost = positioning_cost(TABLE.error, TABLE.energy, TABLE.time)
    energy, time = TABLE.energy.copy(), TABLE.time.copy()
    for column in (energy, time):
        column[row] = np.interp(REPEATED_GAIN, TABLE.gain[[row - 1, following]], column[[row - 1, following]])
    mended = positioning_cost(TABLE.error, energy, time)
    assert abs(mended[row] - TABLE.cost[row]) < abs(cost[row] - TABLE.cost[row])


def test_one_design_on_the_scale_of_the_sweep():
    cost = positioning_cost(TABLE.error, TABLE.energy, TABLE.time)
    references = {"worst_error": 758.0, "least_energy": 2.948, "least_time": 1.319}
    one = positioning_cost(TABLE.error[8], TABLE.energy[8], TABLE.time[8], **references)
    assert float(one) == pytest.approx(float(cost[8]), rel=1e-14)


def test_the_sign_of_the_error_does_not_matter():
    cost = positioning_cost(TABLE.error, TABLE.energy, TABLE.time)
    np.testing.assert_array_equal(positioning_cost(-TABLE.error, TABLE.energy, TABLE.time), cost)


def test_a_failed_design_is_marked_and_counts_for_nothing():
    energy, error = TABLE.energy.copy(), TABLE.error.copy()
    error[0], energy[3] = 1e9, np.nan
    error[3] = 1e12
    cost = positioning_cost(error, energy, TABLE.time)
    assert np.isnan(cost[3]) and np.count_nonzero(np.isnan(cost)) == 1
    assert float(cost[0]) == pytest.approx(1 - 2.948 / 2.948 - 1.319 / 1.548)
    assert np.all(np.isnan(positioning_cost(error * np.nan, energy, TABLE.time)))


@pytest.mark.parametrize("width", [None, 2.0])
def test_derivatives_agree_with_central_differences(width):
    references = {"worst_error": 758.0, "least_energy": 2.948, "least_time": 1.319}

    @jax.jit
    def cost(x):
        return positioning_cost(x[0], x[1], x[2], width=width, **references)

    x = jnp.array([-5.0, 4.427, 1.334])
    exact = jax.grad(cost)(x)
    for i in range(3):
        step = jnp.zeros(3).at[i].set(1e-6)
        assert float(exact[i]) == pytest.approx(float(cost(x + step) - cost(x - step)) / 2e-6, rel=1e-6)
    at_zero = jax.grad(cost)(x.at[0].set(0.0))
    assert np.all(np.isfinite(at_zero))
    if width is not None:
        assert float(at_zero[0]) == 0.0


def test_bad_input_is_named():
    with pytest.raises(InputError, match="least_energy"):
        positioning_cost(1.0, 2.0, 3.0, worst_error=1.0, least_energy=0.0)
    with pytest.raises(InputError, match="width"):
        positioning_cost(1.0, 2.0, 3.0, width=-1.0)
