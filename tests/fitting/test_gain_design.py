"""The best position gain against a fine sweep, and the derivatives of what it minimises."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import TypeCheckError
from positioning_cycles import CYCLE, GAIN, GAINS, OBJECTIVE

from fitting.cycle_run import CycleRun
from fitting.gain_design import design_gain
from fitting.gain_objective import GainObjective
from twin._checks import InputError
from twin.parameters import Parameter
from twin.paths import set_leaves
from twin.performance import PositioningPerformance, cycle_performance, positioning_cost
from twin.sweep import sweep

MEASURES = PositioningPerformance(*(jnp.asarray(v) for v in ([1e-3, -2e-3, 0.0], [20.0, 15.0, 30.0], [0.2, 0.3, 0.15])))


@pytest.mark.slow
def test_reaches_the_optimum_of_a_fine_sweep_in_fewer_runs_than_a_coarse_one():
    fine = sweep(CYCLE, {GAIN: np.geomspace(8.0, 120.0, 1001)}, cycle_performance, chunk_size=143)
    costs = OBJECTIVE.sharp_cost(PositioningPerformance(*(jnp.asarray(fine[n]) for n in ("error", "energy", "time"))))
    result = design_gain(CYCLE, OBJECTIVE, (8.0, 120.0))
    assert result.success
    assert result.evaluations <= 12
    assert result.history.size == result.evaluations == result.gradients
    assert result.cost <= np.nanmin(costs) + 1e-6
    assert result[GAIN] == pytest.approx(fine.values[0][np.nanargmin(costs)], rel=5e-3)
    assert "failed or did not reach" in result.message
    # The cost is that of the designed cycle, simulated anew.
    again = cycle_performance(result.model)
    assert float(OBJECTIVE.sharp_cost(again)) == pytest.approx(result.cost, abs=1e-10)
    assert abs(float(again.error)) < 1e-6
    coarse = costs[:: 1000 // 20]
    assert result.cost < np.nanmin(coarse)


def test_cost_is_eq_22():
    references = {"worst_error": 3.3e-3, "least_energy": 14.8, "least_time": 0.125}
    np.testing.assert_allclose(OBJECTIVE.sharp_cost(MEASURES), positioning_cost(*MEASURES, **references), rtol=1e-14)
    smooth = positioning_cost(*MEASURES, **references, width=3.3e-5)
    np.testing.assert_allclose(OBJECTIVE.cost(MEASURES), smooth, rtol=1e-14)
    other = OBJECTIVE.reweighed(2.0, 0.0, 0.0)
    np.testing.assert_allclose(other.sharp_cost(MEASURES), 2 * np.abs(MEASURES.error) / 3.3e-3)
    np.testing.assert_allclose(OBJECTIVE(CycleRun.of(CYCLE)), OBJECTIVE(CYCLE), rtol=1e-14)


def test_references_of_a_sweep():
    marked = MEASURES._replace(error=MEASURES.error.at[1].set(jnp.nan))
    found = GainObjective.of_sweep(*marked, relative_width=0.02)
    assert float(found.worst_error) == 1e-3
    assert float(found.least_energy) == 20.0
    assert float(found.least_time) == 0.15
    assert float(found.width) == pytest.approx(2e-5)
    with pytest.raises(InputError, match="No design of the sweep"):
        GainObjective.of_sweep(*(jnp.nan * m for m in MEASURES))


@pytest.mark.slow
@pytest.mark.parametrize("gain", [20.0, 15.4165])
def test_derivatives_of_the_objective(gain):
    """Also where the error passes through zero and the sharp cost has its kink."""
    cycle = set_leaves(CYCLE, {GAIN: jnp.asarray(gain)})
    start = GAINS.pack(cycle)

    @jax.jit
    def cost(vector):
        return OBJECTIVE(GAINS.unpack(CYCLE, vector))

    exact = jax.jit(jax.jacfwd(cost))(start)
    steps = 1e-6 * np.eye(len(GAINS))
    numeric = [(cost(start + h) - cost(start - h)) / 2e-6 for h in steps]
    np.testing.assert_allclose(exact, numeric, rtol=1e-4, atol=1e-5)
    assert np.all(np.abs(exact) > 1e-4)


def test_bad_input():
    with pytest.raises(InputError, match="gain must be bounds"):
        design_gain(CYCLE, OBJECTIVE, (100.0, 10.0))
    for no_pair in ((10.0,), (1.0, 2.0, 3.0), [np.nan, 10.0], "10", None):
        with pytest.raises((InputError, TypeCheckError), match="gain"):
            design_gain(CYCLE, OBJECTIVE, no_pair)  # pyright: ignore[reportArgumentType]
    with pytest.raises((InputError, TypeCheckError), match="objective"):
        design_gain(CYCLE, cycle_performance, (10.0, 100.0))  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="Give finite ones"):
        design_gain(CYCLE, OBJECTIVE, Parameter("loop.controller.feedforward"))
    with pytest.raises(InputError, match="nodes must be from 2"):
        design_gain(CYCLE, OBJECTIVE, (10.0, 100.0), nodes=30)
    with pytest.raises(InputError, match="positoin"):
        design_gain(CYCLE, OBJECTIVE, Parameter("loop.controller.positoin_gain", "1/s", 1.0, 2.0))
    with pytest.raises(InputError, match="worst_error must be positive"):
        dataclasses.replace(OBJECTIVE, worst_error=0.0)
    with pytest.raises(InputError, match="time_weight must not be negative"):
        OBJECTIVE.reweighed(1.0, 1.0, -1.0)
