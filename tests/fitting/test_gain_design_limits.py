"""Gains designed together under limits of the cycle, checked by the sharp measures."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from positioning_cycles import CYCLE, GAINS, OBJECTIVE, ONE, sharp_peak

from fitting.cycle_constraints import MeasureLimit, OvershootLimit, PeakLimit, SensitivityLimit, cycle_constraints
from fitting.cycle_run import CycleRun
from fitting.optimal_design import design
from twin._checks import InputError
from twin.control import open_loop_response
from twin.parameters import Parameter, ParameterSpace
from twin.performance import cycle_performance, overshoot, stability_margin

F = np.geomspace(1.0, 500.0, 60)
TOGETHER = ParameterSpace(
    [
        *ONE.parameters,
        Parameter("loop.controller.velocity_gain", "Vs/rad", 0.1, 3.0, scale="log"),
        Parameter("loop.controller.integral_gain", "V/rad", 1.0, 100.0, scale="log"),
        Parameter("loop.controller.feedforward", "-", 0.0, 1.0),
    ]
)


def sharp_overshoot(cycle):
    run = cycle.simulate()
    return float(overshoot(run.times, run.channel("position"), cycle.target, start=cycle.move.start_position))


@pytest.mark.slow
def test_design_under_limits_keeps_the_sharp_ones():
    limits = {"torque": 12.0, "voltage": 100.0, "overshoot": 0.02}
    assert sharp_overshoot(CYCLE) > 0.02
    result = design(CYCLE, OBJECTIVE, TOGETHER, constraints=cycle_constraints(**limits), experiment=CycleRun.of)
    assert result.success
    assert result.cost < float(OBJECTIVE(CYCLE)) - 0.1
    assert "peak torque" in result.constraint_names
    cycle = result.model
    assert sharp_peak(cycle, "torque") <= 12.0
    assert sharp_peak(cycle, "voltage") <= 100.0
    assert sharp_overshoot(cycle) <= 0.02 * (1 + 1e-3)  # between samples the parabola may lie above them
    assert result.binding
    # What holds it back is used up but for the smooth maximum.
    if "peak torque" in result.binding:
        assert sharp_peak(cycle, "torque") > 0.97 * 12.0


@pytest.mark.slow
def test_limits_lie_on_the_safe_side_of_the_sharp_measures():
    peak = sharp_peak(CYCLE, "torque")
    smooth = 1 - float(PeakLimit("torque", peak)(CYCLE))
    assert 1.0 <= smooth <= 1 + 2e-3 * np.log(2 * CYCLE.times.size)
    run = CYCLE.simulate()
    highest = float(jnp.max(run.channel("position")) / CYCLE.target - 1)
    beyond = 1 - float(OvershootLimit(highest)(CYCLE))
    assert 1.0 <= beyond <= 1 + 2e-2 * np.log(CYCLE.times.size + 1)
    measures = cycle_performance(CYCLE)
    assert float(MeasureLimit("time", measures.time)(CYCLE)[0]) == pytest.approx(0.0, abs=1e-12)
    below = MeasureLimit("error", 1e-3)(CYCLE)
    np.testing.assert_allclose(below, 1 + np.array([-1, 1]) * float(measures.error) / 1e-3)
    for limit in (PeakLimit("torque", peak), MeasureLimit("energy", 1.0), SensitivityLimit(2.0, F)):
        np.testing.assert_allclose(limit(CYCLE), limit(CycleRun.of(CYCLE)), rtol=1e-12)


def test_sensitivity_is_that_of_the_opened_loop():
    state, reference = CycleRun.of(CYCLE).fastest()
    opened = {
        "rest": open_loop_response(CYCLE.loop, F, state=CYCLE.loop.initial_state()),
        "moving": open_loop_response(CYCLE.loop, F, state=state, reference=reference),
    }
    for at, response in opened.items():
        sharp = float(stability_margin(response).sensitivity_peak)
        found = 2.0 * (1 - float(SensitivityLimit(2.0, F, at=at)(CYCLE)))
        assert sharp <= found <= sharp + 1e-2 * np.log(F.size)
    limits = cycle_constraints(sensitivity=2.0, current=10.0, energy=20.0, time=0.2)
    names = [name for limit in limits for name in limit.function.names]
    assert names == ["peak current", "sensitivity peak, moving", "sensitivity peak, rest", "energy", "time"]


@pytest.mark.slow
def test_derivatives_of_the_limits():
    limits = cycle_constraints(torque=12.0, overshoot=0.02, error=1e-3)
    start = GAINS.pack(CYCLE)

    @jax.jit
    def values(vector):
        run = CycleRun.of(GAINS.unpack(CYCLE, vector))
        return jnp.concatenate([jnp.ravel(limit.function(run)) for limit in limits])

    exact = jax.jit(jax.jacfwd(values))(start)
    steps = 1e-6 * np.eye(len(GAINS))
    numeric = np.stack([(values(start + h) - values(start - h)) / 2e-6 for h in steps], axis=1)
    np.testing.assert_allclose(exact, numeric, rtol=1e-4, atol=1e-4 * np.max(np.abs(numeric)))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: cycle_constraints(), "at least one limit"),
        (lambda: PeakLimit("torque", 0.0), "limit of the peak torque must be positive"),
        (lambda: OvershootLimit(0.0), "limit of the overshoot must be positive"),
        (lambda: SensitivityLimit(1.0, F), "limit of the sensitivity peak less 1"),
        (lambda: SensitivityLimit(2.0, F, at="noon"), '"moving" or "rest"'),
        (lambda: MeasureLimit("warmth", 1.0), "measure must be one of error, energy, time"),
        (lambda: PeakLimit("heat", 1.0)(CYCLE), "no output 'heat'"),
    ],
)
def test_bad_input(build, message):
    with pytest.raises(InputError, match=message):
        build()
