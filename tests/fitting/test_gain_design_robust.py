"""Designs over a spread of inertia and friction, and trade-off curves."""

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from positioning_cycles import CYCLE, GAIN, OBJECTIVE, ONE

from fitting.cycle_constraints import PeakLimit
from fitting.optimal_design import design
from fitting.plots_design import plot_trade_off
from fitting.robust_design import RobustLimit, RobustObjective, Variations
from fitting.trade_off import trade_off
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace
from twin.paths import get_leaf, set_leaves

mpl.use("Agg")

INERTIA, FRICTION = "loop.plant.inertia", "loop.plant.friction.coulomb"
SPREAD = Variations({INERTIA: [0.9, 1.2], FRICTION: [0.5, 1.0]})


class Gain(eqx.Module):
    gain: jax.Array
    plant: jax.Array


def miss(loop):
    return (loop.gain * loop.plant - 1) ** 2


@pytest.mark.slow
def test_variants_are_all_combinations():
    assert SPREAD.factors.tolist() == [[0.9, 0.5], [0.9, 1.0], [1.2, 0.5], [1.2, 1.0]]
    costs = np.asarray(RobustObjective(OBJECTIVE, SPREAD).costs(CYCLE))
    for row, cost in zip(SPREAD.factors, costs, strict=True):
        values = {path: f * get_leaf(CYCLE, path) for path, f in zip(SPREAD.paths, row, strict=True)}
        assert float(OBJECTIVE(set_leaves(CYCLE, values))) == pytest.approx(float(cost), abs=1e-10)
    mean = RobustObjective(OBJECTIVE, SPREAD, spread=2.0)(CYCLE)
    assert float(mean) == pytest.approx(np.mean(costs) + 2 * np.std(costs), abs=1e-8)
    worst = float(RobustObjective(OBJECTIVE, SPREAD, worst_case=1e-3)(CYCLE))
    assert np.max(costs) <= worst <= np.max(costs) + 1e-3 * np.log(4)


@pytest.mark.slow
def test_robust_design_is_better_in_the_worst_case():
    robust = RobustObjective(OBJECTIVE, SPREAD, worst_case=0.01)
    nominal = design(CYCLE, OBJECTIVE, ONE)
    hedged = design(CYCLE, robust, ONE)
    assert nominal.success
    assert hedged.success
    worst = {name: float(jnp.max(robust.costs(r.model))) for name, r in (("nominal", nominal), ("hedged", hedged))}
    assert worst["hedged"] < worst["nominal"] - 5e-4
    assert float(OBJECTIVE(nominal.model)) < float(OBJECTIVE(hedged.model))


def test_robust_design_in_closed_form():
    """Between plants of gain 1 and 2 the largest miss is smallest at 2/3; the mean of the misses is at 3/5."""
    start = Gain(jnp.asarray(1.0), jnp.asarray(1.0))
    space = ParameterSpace([Parameter("gain", "", 0.1, 2.0)])
    for options, gain in (({"worst_case": 1e-4}, 2 / 3), ({"spread": 0.0}, 3 / 5)):
        result = design(start, RobustObjective(miss, {"plant": [1.0, 2.0]}, **options), space)
        assert result["gain"] == pytest.approx(gain, abs=1e-3)


def test_a_limit_for_every_variant():
    limit = RobustLimit(PeakLimit("torque", 20.0), SPREAD)
    values = limit(CYCLE)
    assert values.shape == (4,)
    assert limit.names[3] == "peak torque, variant 3"
    assert float(values[0]) > float(values[2])  # more inertia, more torque


def test_no_spread_has_a_derivative_all_the_same():
    still = RobustObjective(OBJECTIVE, {INERTIA: [1.0, 1.0]})
    slope = jax.jit(jax.jacfwd(lambda k: still(set_leaves(CYCLE, {GAIN: k}))))(jnp.asarray(20.0))
    assert np.isfinite(slope)


@pytest.mark.slow
def test_trade_off_between_time_and_error():
    table = trade_off(CYCLE, OBJECTIVE, ONE, limits={"time": [0.21, 0.2, 0.19, 0.18]})
    assert (table["status"] == "converged").all()
    assert (table["time [s]"] <= table["limit of time [s]"] * (1 + 1e-7)).all()
    assert (np.diff(table["cost"]) > 0).all()
    assert (np.diff(table["error [m]"].abs()) > 0).all()
    assert not table["dominated"].any()
    assert f"{GAIN} [1/s]" in table.columns
    axes = plot_trade_off(table)
    assert axes.get_xlabel() == "response time [ms]"
    with pytest.raises(InputError, match="no column 'warmth'"):
        plot_trade_off(table, "warmth")


def test_plot_marks_what_is_not_the_curve():
    rows = [(1.0, 2.0, 0.3, "converged", False), (2.0, 3.0, 0.4, "converged", True), (1.0, 1.0, 0.2, "stalled", False)]
    table = pd.DataFrame(rows, columns=["error [m]", "energy [J]", "time [s]", "status", "dominated"])
    axes = plot_trade_off(table, colour=None)
    assert [text.get_text() for text in axes.get_legend().get_texts()][-2:] == ["dominated", "not converged"]


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Variations({}), "at least one path"),
        (lambda: Variations({INERTIA: [np.nan]}), "factors of loop.plant.inertia must be finite"),
        (lambda: Variations({"loop.plant.weight": [1.0]}).evaluate(OBJECTIVE, CYCLE), "weight"),
        (lambda: RobustObjective(OBJECTIVE, SPREAD, spread=-1.0), "spread must not be negative"),
        (lambda: RobustObjective(OBJECTIVE, SPREAD, worst_case=0.0), "width of the worst case must be positive"),
        (lambda: trade_off(CYCLE, OBJECTIVE, ONE), "either limits of one measure or weights"),
        (lambda: trade_off(CYCLE, OBJECTIVE, ONE, limits={"warmth": [1.0]}), "limits must name one of"),
        (lambda: trade_off(CYCLE, OBJECTIVE, ONE, weights=[(1.0, 2.0)]), "weights must be rows"),
    ],
)
def test_bad_input(build, message):
    with pytest.raises(InputError, match=message):
        build()
