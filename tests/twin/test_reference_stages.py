"""References evaluated for all stages before the loop: at the right times, at the method's order, differentiable."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from reference_systems import ConstantInputs, ContinuousCascade, SineCommand, viscous_axis

from twin.control import ClosedLoop
from twin.references import JerkLimitedMove, SumReference
from twin.simulation import choose_substeps, simulate
from twin.stepping import ConstantSteps, runge_kutta_steps, stage_times

SOLVERS = [diffrax.Heun(), diffrax.Ralston(), diffrax.Midpoint(), diffrax.Bosh3(), diffrax.Tsit5()]
NAMES = [type(s).__name__ for s in SOLVERS]


@pytest.mark.parametrize("substeps", [1, 4])
@pytest.mark.parametrize("solver", SOLVERS, ids=NAMES)
def test_every_stage_gets_the_input_of_its_own_time(solver, substeps):
    stepping = ConstantSteps(substeps, solver=solver)
    start, length = jnp.asarray(0.3), jnp.asarray(0.02)
    times = stage_times(stepping, start, length)
    assert times.shape == (substeps, len(solver.tableau.c) + 1)
    np.testing.assert_allclose(times[:, 0], 0.3 + 0.02 / substeps * np.arange(substeps), rtol=1e-14)

    def apart(t, state, given):
        return jnp.abs(t - given)

    end, _ = runge_kutta_steps(stepping, apart, start, length, jnp.zeros(()), times)
    assert abs(float(end)) < 1e-17


AXIS = viscous_axis(gain=35.0)


def _exact(times, force, omega):
    """M·v̇ + F_v·v = force·sin(ωt) from rest, M = 100, F_v = 200."""
    a, b = 2.0, force / 100
    return b / (a**2 + omega**2) * (a * np.sin(omega * times) - omega * (np.cos(omega * times) - np.exp(-a * times)))


@eqx.filter_jit
def _run(reference, times, stepping):
    return simulate(AXIS, reference, times, stepping=stepping).states.velocity


@pytest.mark.parametrize(("solver", "order"), [(diffrax.Heun(), 2), (diffrax.Ralston(), 2), (diffrax.Bosh3(), 3)])
def test_order_under_a_moving_input(solver, order):
    times, errors = np.linspace(0.0, 0.5, 17), []
    for substeps in (1, 2, 4):
        velocity = _run(SineCommand(3.0, 2.0), times, ConstantSteps(substeps, rtol=1e3, solver=solver))
        errors.append(np.max(np.abs(velocity - _exact(times, 105.0, 4 * np.pi))))
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), order, atol=0.25)


TIMES = np.linspace(0.0, 0.4, 101)


def _positions(p):
    moves = (JerkLimitedMove(p[0], p[1], p[2], p[3], p[4]), JerkLimitedMove(-0.5 * p[0], p[1], p[2], p[3], p[5]))
    loop = ClosedLoop(AXIS, ContinuousCascade(p[6], 80.0, 300.0))
    result = simulate(loop, SumReference(moves), TIMES, stepping=ConstantSteps(2, solver=diffrax.Ralston()))
    return jnp.stack([result.states.plant.position, result.states.plant.velocity])


@pytest.mark.slow
def test_derivatives_with_respect_to_the_reference_are_exact():
    """Limits, start times and distance of two moves after each other, and a gain; by a method whose last stage is not
    the next one's first."""
    p = np.array([0.05, 0.25, 8.0, 400.0, 0.0123, 0.2345, 20.0])
    run, slopes = jax.jit(_positions), jax.jit(jax.jacfwd(_positions))
    exact = slopes(p)
    for i, h in enumerate(1e-5 * p):
        e = h * np.eye(p.size)[i]
        expected = (run(p + e) - run(p - e)) / (2 * h)
        error = np.linalg.norm(exact[..., i] - expected) / np.linalg.norm(expected)
        assert error < 1e-5, (i, error)


def test_substeps_are_chosen_for_what_stands_still():
    """States that stay at zero have no magnitude with which an error could be compared."""
    chosen = choose_substeps(AXIS, ConstantInputs(0.0, 0.0), TIMES[:5])
    assert chosen.substeps == 1
