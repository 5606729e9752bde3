"""Derivatives of trajectories: as accurate as the tolerance, through reversals of every friction law."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from reference_systems import (
    ConstantInputs,
    ContinuousCascade,
    SineCommand,
    two_mass,
    two_mass_matrices,
    viscous_axis,
)
from scipy.linalg import expm

from twin.control import ClosedLoop, SampledLoop, SampledPositionVelocity
from twin.drives import ServoAxis
from twin.laws import (
    AsymmetricFriction,
    CoulombViscousFriction,
    DahlFriction,
    LuGreFriction,
    StribeckFriction,
    SumFriction,
    TabulatedFriction,
    ViscousFriction,
)
from twin.references import JerkLimitedMove
from twin.simulation import choose_substeps, simulate
from twin.stepping import AdaptiveSteps, ConstantSteps

W = 2e-3
TIMES = np.linspace(0.0, 0.6, 61)
_FINE = np.linspace(0.0, 0.6, 16 * 60 + 1)
_SPEEDS = jnp.array([-0.5, -0.1, -0.03, -0.01, 0.0, 0.01, 0.03, 0.1, 0.5])
_FORCES = jnp.array([-22.0, -8.0, -5.6, -4.4, 0.0, 4.0, 5.4, 8.2, 24.0])
# Several laws share one axis, as compiling takes the time; each goes through reversal and standstill all the same.
FRICTION = {
    "laws of speed": SumFriction(
        (
            ViscousFriction(40.0),
            CoulombViscousFriction(5.0, 40.0, W),
            AsymmetricFriction(4.0, 5.0, 40.0, 30.0, W),
            StribeckFriction(4.0, 6.0, 0.02, 40.0, W),
            TabulatedFriction(_SPEEDS, _FORCES),
        )
    ),
    "laws with memory": SumFriction(
        (
            LuGreFriction(9.0, 13.0, 0.02, 5e4, 150.0, 100.0, W),
            DahlFriction(
                9.0,
                100.0,
                2e-4,
                asymmetry=-20.0,
                rise=2.0,
                rate_limit=1000.0,
                width=W,
                damping=30.0,
                initial_direction=-0.2,
            ),
        )
    ),
}


def _flat(tree):
    return jnp.stack(jax.tree.leaves(tree), axis=-1)


@eqx.filter_jit
def _states(arrays, fixed, times, stepping):
    system, reference = eqx.combine(arrays, fixed)
    return _flat(simulate(system, reference, times, stepping=stepping).states)


@eqx.filter_jit
def _forward(arrays, fixed, times, stepping):
    vector, unravel = ravel_pytree(arrays)
    return jnp.moveaxis(jax.jacfwd(lambda v: _states(unravel(v), fixed, times, stepping))(vector), 2, 0)


@eqx.filter_jit
def _reverse(arrays, fixed, times, stepping):
    vector, unravel = ravel_pytree(arrays)
    return jnp.moveaxis(jax.jacrev(lambda v: _states(unravel(v), fixed, times, stepping))(vector), 2, 0)


@eqx.filter_jit
def _many(vectors, unravel, fixed, times, stepping):
    return jax.vmap(lambda v: _states(unravel(v), fixed, times, stepping))(vectors)


def _central_differences(arrays, fixed, times, stepping, part, order=2):
    """Derivatives (parameters, times, states) by runs that differ in one parameter each."""
    vector, unravel = ravel_pytree(arrays)
    offsets, weights = {2: ([-1, 1], [-1 / 2, 1 / 2]), 4: ([-2, -1, 1, 2], [1 / 12, -8 / 12, 8 / 12, -1 / 12])}[order]
    step = part * _size(arrays)
    points = vector + np.asarray(offsets)[:, None, None] * np.diag(step)
    runs = _many(points.reshape(-1, vector.size), unravel, fixed, times, stepping)
    runs = np.asarray(runs).reshape(len(offsets), vector.size, *runs.shape[1:])
    return np.einsum("o,opts->pts", weights, runs) / step[:, None, None]


def _size(arrays):
    """Typical magnitude of the parameters: 0.01 for what is zero."""
    vector = np.abs(np.asarray(ravel_pytree(arrays)[0]))
    return np.where(vector == 0, 0.01, vector)


def _error(derivative, expected, arrays, states, floor):
    """Largest relative error of a derivative, in the norm over the trajectory.

    What changes a state by less than `floor` of it, were the parameter doubled, is compared with that.
    """
    scale = _size(arrays)[:, None] / np.linalg.norm(states, axis=0)
    error, influence = (np.linalg.norm(x, axis=1) * scale for x in (np.asarray(derivative) - expected, expected))
    return float(np.max(error / np.maximum(influence, floor)))


class Case:
    """An axis with several friction laws under a sinusoidal force, and its derivatives by tight central differences."""

    def __init__(self, friction):
        system = ServoAxis(95.0, friction, gain=35.0, offset=-3.0), SineCommand(3.0, 2.0)
        self.system = system
        # The speeds of a table are where its slope bends; differences across a bend are one-sided.
        free = jax.tree_util.tree_map_with_path(
            lambda path, leaf: eqx.is_inexact_array(leaf) and path[-1].name != "velocities", system
        )
        self.arrays, self.fixed = eqx.partition(system, free)
        # Constant steps, as differences of adaptive runs are rough.
        tight = ConstantSteps(6, solver=diffrax.Tsit5(), rtol=float("inf"))
        self.states = np.asarray(_states(self.arrays, self.fixed, _FINE, tight))[::16]
        self.expected = _central_differences(self.arrays, self.fixed, _FINE, tight, 3e-6)[:, ::16]

    def error(self, derivative, floor):
        return _error(derivative, self.expected, self.arrays, self.states, floor)


@pytest.fixture(scope="module", params=FRICTION)
def case(request):
    return Case(FRICTION[request.param])


def test_the_case_starts_at_standstill_and_reverses(case):
    velocity = case.states[:, 1]
    assert velocity[0] == 0
    assert velocity.max() > 0.05 and velocity.min() < -0.05
    influence = np.linalg.norm(case.expected, axis=1) * _size(case.arrays)[:, None]
    assert np.all(influence.max(axis=1) > 1e-5)


@pytest.mark.slow
def test_trap_1_the_tolerance_controls_the_derivative(case):
    for rtol in (1e-5, 1e-7):
        stepping = AdaptiveSteps(rtol=rtol, atol=1e-7 * rtol)
        assert case.error(_forward(case.arrays, case.fixed, TIMES, stepping), 1e-2) < 10 * rtol


@pytest.mark.slow
def test_constant_steps_give_the_derivative_of_what_they_compute(case):
    stepping = ConstantSteps(4)
    forward = _forward(case.arrays, case.fixed, TIMES, stepping)
    own = _central_differences(case.arrays, case.fixed, TIMES, stepping, 3e-6)
    assert _error(forward, own, case.arrays, case.states, 1e-3) < 2e-6
    reverse = _reverse(case.arrays, case.fixed, TIMES, stepping)
    np.testing.assert_allclose(reverse, forward, rtol=1e-9, atol=1e-12 * np.max(np.abs(forward)))


@pytest.mark.slow
def test_chosen_constant_steps_give_an_accurate_derivative(case):
    chosen = choose_substeps(*case.system, TIMES, rtol=1e-5)
    assert case.error(_forward(case.arrays, case.fixed, TIMES, chosen), 1.0) < 1e-4


# A positioning move over a closed loop: the switching times move with distance, limits and start.
LOOP = ClosedLoop(
    ServoAxis(95.0, CoulombViscousFriction(20.0, 200.0, W), gain=35.0, offset=-3.0), ContinuousCascade(40.0, 80.0, 50.0)
)
MOVE = JerkLimitedMove(0.03, 0.2, 2.0, 60.0, start_time=0.05, start_position=0.001)


@pytest.fixture(scope="module")
def positioning():
    arrays, fixed = eqx.partition((LOOP, MOVE), eqx.is_inexact_array)
    tight = AdaptiveSteps(rtol=1e-12, atol=1e-16)
    states = np.asarray(_states(arrays, fixed, TIMES, tight))
    return arrays, fixed, states, _central_differences(arrays, fixed, TIMES, tight, 1e-3, order=4)


@pytest.mark.slow
def test_trap_4_a_moving_switching_time_counts(positioning):
    arrays, fixed, states, expected = positioning
    for rtol in (1e-5, 1e-7):
        forward = _forward(arrays, fixed, TIMES, AdaptiveSteps(rtol=rtol, atol=1e-7 * rtol))
        assert _error(forward, expected, arrays, states, 0.1) < 10 * rtol
    # Distance, limits, start time and start position come last; each of them moves the trajectory.
    influence = np.linalg.norm(expected[-6:, :, 0], axis=1) * _size(arrays)[-6:]
    assert np.all(influence > 1e-3)


def test_trap_4_constant_steps_see_a_moving_switching_time(positioning):
    arrays, fixed, states, expected = positioning
    forward = _forward(arrays, fixed, np.linspace(0.0, 0.6, 601), ConstantSteps(2))[:, ::10]
    assert _error(forward, expected, arrays, states, 1.0) < 1e-3


@pytest.mark.slow
def test_trap_3_reverse_mode_through_adaptive_steps(positioning):
    """What was "jvp to a custom_vjp function" in one direction and no `grad` in the other."""
    arrays, fixed, _, expected = positioning
    stepping = AdaptiveSteps(rtol=1e-9, atol=1e-12, solver=diffrax.Tsit5(), max_steps=4096, gradient="reverse")

    @eqx.filter_jit
    def slopes(arrays, stepping):
        return ravel_pytree(jax.grad(lambda a: _states(a, fixed, TIMES, stepping)[-1, 0])(arrays))[0]

    size = _size(arrays)
    np.testing.assert_allclose(slopes(arrays, stepping) * size, expected[:, -1, 0] * size, atol=1e-6)


DRIVE = two_mass()


@pytest.mark.parametrize(
    "stepping",
    [AdaptiveSteps(rtol=1e-9, atol=1e-13), ConstantSteps(4, solver=diffrax.Tsit5())],
    ids=["adaptive", "constant"],
)
def test_derivative_by_the_initial_state_is_the_transition_matrix(stepping):
    a = np.asarray(two_mass_matrices(DRIVE)[0])

    @eqx.filter_jit
    def transition(state, times, stepping):
        vector, unravel = ravel_pytree(state)
        inputs = ConstantInputs(3.0, 0.0)
        return jax.jacfwd(
            lambda v: _flat(simulate(DRIVE, inputs, times, initial_state=unravel(v), stepping=stepping).states)
        )(vector)

    times = np.linspace(0.0, 0.2, 41)
    computed = transition(DRIVE.initial_state(), times, stepping)
    exact = np.stack([expm(a * t) for t in times])
    np.testing.assert_allclose(
        computed / np.max(np.abs(exact), axis=0), exact / np.max(np.abs(exact), axis=0), atol=1e-6
    )


@pytest.mark.slow
@pytest.mark.parametrize("stepping", [AdaptiveSteps(rtol=1e-9), ConstantSteps(4)], ids=["adaptive", "constant"])
def test_a_jacobian_under_vmap_equals_those_one_by_one(stepping):
    """A batch of models, each with its own Jacobian: v = F/F_v·(1 - exp(-F_v·t/M))."""
    times = np.linspace(0.0, 0.5, 101)

    @eqx.filter_jit
    def jacobian(values, stepping):
        def speed(values):
            axis = eqx.tree_at(lambda a: (a.mass, a.friction.viscous), viscous_axis(), (values[0], values[1]))
            return simulate(axis, ConstantInputs(values[2], 0.0), times, stepping=stepping).states.velocity

        return jax.jacfwd(speed)(values)

    def exact(values):
        return values[2] / values[1] * (1 - jnp.exp(-values[1] * times / values[0]))

    batch = jnp.array([[100.0, 200.0, 50.0], [50.0, 400.0, -20.0], [300.0, 100.0, 5.0]])
    together = jax.vmap(lambda values: jacobian(values, stepping))(batch)
    expected = jax.vmap(jax.jacfwd(exact))(batch)
    np.testing.assert_allclose(together * batch[:, None], expected * batch[:, None], rtol=1e-5, atol=1e-7)
    alone = jnp.stack([jacobian(values, stepping) for values in batch])
    np.testing.assert_allclose(together, alone, rtol=1e-7, atol=1e-12)


@pytest.mark.slow
def test_derivatives_of_a_sampled_loop_forward_and_reverse():
    """More ticks than one chunk of the recursion, and not a multiple of it."""
    loop = SampledLoop(LOOP.plant, SampledPositionVelocity(40.0, 80.0, command_limit=4.0), 1e-3, command_limit=9.0)
    arrays, fixed = eqx.partition((loop, MOVE), eqx.is_inexact_array)
    ticks, stepping = np.arange(300) * 1e-3, ConstantSteps(2)
    forward = _forward(arrays, fixed, ticks, stepping)
    own = _central_differences(arrays, fixed, ticks, stepping, 1e-6)
    states = np.asarray(_states(arrays, fixed, ticks, stepping))
    # The period decides when a tick is, and the ticks given must fit it: it cannot be varied on its own.
    varied = np.asarray(ravel_pytree(arrays)[0]) != 1e-3
    keep = lambda x: np.asarray(x) * varied[:, None, None]  # noqa: E731
    assert _error(keep(forward), keep(own), arrays, states, 1e-3) < 1e-5
    reverse = _reverse(arrays, fixed, ticks, stepping)
    np.testing.assert_allclose(reverse, forward, rtol=1e-9, atol=1e-12 * np.max(np.abs(forward)))
