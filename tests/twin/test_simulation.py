"""Simulation: known answers, rates of convergence, honest error estimates, and failures that are marked."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from reference_systems import ConstantInputs, SineCommand, two_mass, two_mass_matrices, viscous_axis
from scipy.linalg import expm
from scipy.signal import cont2discrete

from twin._checks import InputError
from twin.control import SampledLoop, SampledPositionVelocity
from twin.laws import CoulombViscousFriction
from twin.references import JerkLimitedMove, SampledReference
from twin.simulation import SimulationStatus, choose_substeps, simulate
from twin.stepping import AdaptiveSteps, ConstantSteps

REST = ConstantInputs(0.0, 0.0)


@eqx.filter_jit
def run(system, reference, times, *, stepping=None, initial_state=None):
    return simulate(system, reference, times, stepping=stepping, initial_state=initial_state)


TIGHT = AdaptiveSteps(rtol=1e-10, atol=1e-13)


def _ends(trajectory):
    """How a run ended, by name."""
    names = ("successful", "not_finite", "not_accurate", "too_many_steps")
    return next(name for name in names if bool(trajectory.status == getattr(SimulationStatus, name)))


def _columns(trajectory):
    return np.stack([np.asarray(leaf) for leaf in jax.tree.leaves(trajectory.states)], axis=-1)


def _two_mass_exact(drive, times, command, load, start):
    a, b, e = (np.asarray(x) for x in two_mass_matrices(drive))
    augmented = np.zeros((5, 5))
    augmented[:4, :4], augmented[:4, 4] = a, b * command + e * load
    return np.stack([(expm(augmented * t) @ np.append(start, 1.0))[:4] for t in times])


@pytest.mark.parametrize("stepping", [TIGHT, ConstantSteps(4, solver=diffrax.Tsit5())], ids=["adaptive", "constant"])
def test_a_coasting_axis(stepping):
    axis = viscous_axis(initial_position=0.1, initial_velocity=2.0)
    times = np.linspace(0.0, 1.5, 31)
    trajectory = run(axis, REST, times, stepping=stepping)
    assert _ends(trajectory) == "successful"
    np.testing.assert_allclose(trajectory.states.velocity, 2 * np.exp(-2 * times), rtol=2e-8)
    np.testing.assert_allclose(trajectory.channel("position"), 0.1 + 1 - np.exp(-2 * times), rtol=2e-8)
    assert np.isnan(trajectory.error_estimate) == isinstance(stepping, AdaptiveSteps)


def test_terminal_speed_offset_and_start_time():
    """A start other than t = 0, a command and a load: v -> (g·u + load - offset)/F_v."""
    axis = viscous_axis(gain=50.0, offset=30.0)
    times = 3.0 + np.linspace(0.0, 15.0, 16)
    trajectory = run(axis, ConstantInputs(2.0, 10.0), times, stepping=TIGHT)
    np.testing.assert_allclose(trajectory.states.velocity, 0.4 * (1 - np.exp(-2 * (times - 3))), rtol=1e-8)
    np.testing.assert_array_equal(trajectory.outputs.command, 2.0)
    np.testing.assert_array_equal(trajectory.outputs.force, 100.0)


@pytest.mark.parametrize("stepping", [TIGHT, ConstantSteps(8, solver=diffrax.Tsit5())], ids=["adaptive", "constant"])
def test_two_masses_against_the_matrix_exponential(stepping):
    drive = two_mass()
    times = np.linspace(0.0, 0.4, 41)
    trajectory = run(drive, ConstantInputs(3.0, -0.5), times, stepping=stepping)
    exact = _two_mass_exact(drive, times, 3.0, -0.5, np.zeros(4))
    np.testing.assert_allclose(
        _columns(trajectory) / np.max(np.abs(exact), axis=0), exact / np.max(np.abs(exact), axis=0), atol=1e-7
    )
    twist = exact[:, 0] - exact[:, 1]
    shaft = 40.0 * twist + 0.02 * (exact[:, 2] - exact[:, 3])
    np.testing.assert_allclose(trajectory.channel("shaft"), shaft, atol=1e-7 * np.max(np.abs(shaft)))


LOOP = SampledLoop(viscous_axis(gain=35.0, offset=4.0), SampledPositionVelocity(20.0, 100.0), 2e-3)
TICKS = np.arange(200) * 2e-3


def _sampled_loop_exactly(wanted):
    """The loop with its plant discretised by zero-order hold, tick by tick."""
    a, b = np.array([[0.0, 1.0], [0.0, -2.0]]), np.array([[0.0], [1 / 100.0]])
    propagation, effect, *_ = cont2discrete((a, b, np.eye(2), np.zeros((2, 1))), 2e-3)
    x, previous, before, states, commands = np.zeros(2), 0.0, 0.0, [], []
    for q_r in wanted:
        u = 100.0 * (20.0 * (q_r - x[0]) - (x[0] - before) / 4e-3)
        states.append(x)
        commands.append(u)
        previous, before = x[0], previous
        x = propagation @ x + effect[:, 0] * (35.0 * u - 4.0)
    return np.stack(states), np.stack(commands)


def test_a_sampled_loop_against_its_exact_discretisation():
    reference = SampledReference(TICKS, 0.05 * np.sin(12 * TICKS) ** 2)
    trajectory = run(LOOP, reference, TICKS, stepping=ConstantSteps(4, solver=diffrax.Tsit5()))
    states, commands = _sampled_loop_exactly(np.asarray(reference.position))
    assert _ends(trajectory) == "successful"
    np.testing.assert_allclose(_columns(trajectory), states, atol=1e-12)
    np.testing.assert_allclose(trajectory.channel("command"), commands, atol=1e-9)
    np.testing.assert_allclose(trajectory.channel("force"), 35 * commands, atol=3e-8)


@pytest.mark.parametrize(("solver", "order", "points"), [(diffrax.Bosh3(), 3, 160), (diffrax.Tsit5(), 5, 120)])
def test_rate_of_convergence(solver, order, points):
    drive, start = two_mass(), np.array([0.1, 0.0, 0.0, 1.0])
    state = drive.initial_state()._replace(motor_position=jnp.asarray(0.1), load_velocity=jnp.asarray(1.0))
    times = np.linspace(0.0, 0.2, points + 1)
    exact = _two_mass_exact(drive, times, 0.0, 0.0, start)
    propagation = expm(np.asarray(two_mass_matrices(drive)[0]) * times[1])
    largest = np.max(np.abs(exact), axis=0)
    errors, local, estimates = [], [], []
    for substeps in (1, 2, 4):
        stepping = ConstantSteps(substeps, rtol=1.0, atol=1e-30, solver=solver)
        trajectory = run(drive, REST, times, initial_state=state, stepping=stepping)
        x = _columns(trajectory)
        errors.append(np.max(np.abs(x - exact) / largest))
        local.append(np.max(np.abs(x[1:] - x[:-1] @ propagation.T) / largest))
        estimates.append(float(trajectory.error_estimate))
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), order, atol=0.2)
    # The estimate is that of the embedded method, one order lower, over one span: it errs on the safe side.
    np.testing.assert_allclose(np.log2(np.divide(estimates[:-1], estimates[1:])), order - 1, atol=0.2)
    assert np.all(np.asarray(estimates) > local)


@pytest.mark.parametrize("substeps", [1, 4])
def test_the_error_estimate_bounds_the_local_error(substeps):
    """Through two reversals of Coulomb friction, where the error is largest; each span started anew, and exactly."""
    axis = eqx.tree_at(lambda a: a.friction, viscous_axis(gain=35.0), CoulombViscousFriction(20.0, 200.0, 5e-3))
    sine, times = SineCommand(3.0, 2.0), np.linspace(0.0, 0.6, 301)
    exact = run(axis, sine, times, stepping=TIGHT).states
    stepping = ConstantSteps(substeps, rtol=1e-3, atol=1e-9)
    whole = run(axis, sine, times, stepping=stepping)
    starts = jax.tree.map(lambda x: x[:-1], exact)
    ends = _one_span(axis, sine, times, starts, stepping)
    error = max(
        float(jnp.max(jnp.abs(a - b[1:])) / (1e-9 + 1e-3 * jnp.max(jnp.abs(b))))
        for a, b in zip(jax.tree.leaves(ends), jax.tree.leaves(exact), strict=True)
    )
    assert _ends(whole) == "successful"
    assert 0 < error < float(whole.error_estimate) < 1


@eqx.filter_jit
def _one_span(system, reference, times, starts, stepping):
    def one(start, begin, end):
        span = jnp.stack([begin, end])
        trajectory = simulate(system, reference, span, initial_state=start, stepping=stepping)
        return jax.tree.map(lambda x: x[-1], trajectory.states)

    return jax.vmap(one)(starts, times[:-1], times[1:])


def test_the_error_estimate_bounds_the_local_error_of_a_sampled_loop():
    reference = SampledReference(TICKS, 0.05 * np.sin(12 * TICKS) ** 2)
    trajectory = run(LOOP, reference, TICKS, stepping=ConstantSteps(1, rtol=1e-6))
    x, command = _columns(trajectory), np.asarray(trajectory.channel("command"))
    force = (35 * command[:-1] - 4) / 100
    after = x[:-1, 1] * np.exp(-4e-3) + force * (1 - np.exp(-4e-3)) / 2
    error = np.max(np.abs(x[1:, 1] - after)) / (1e-9 + 1e-6 * np.max(np.abs(x[:, 1])))
    assert 0 < error < float(trajectory.error_estimate)


def _all_nan(trajectory):
    return all(bool(jnp.all(jnp.isnan(x))) for x in jax.tree.leaves((trajectory.states, trajectory.outputs)))


def _unstable():
    """Negative friction, as a solver may try it: the speed grows as exp(1e4·t) and overflows."""
    return eqx.tree_at(lambda a: a.friction.viscous, viscous_axis(initial_velocity=1.0), jnp.asarray(-1e6))


@pytest.mark.parametrize(
    ("system", "stepping", "end"),
    [
        (_unstable(), ConstantSteps(8), "not_finite"),
        (_unstable(), AdaptiveSteps(max_steps=4096), "not_finite"),
        (eqx.tree_at(lambda a: a.mass, viscous_axis(), jnp.asarray(jnp.nan)), ConstantSteps(4), "not_finite"),
        (eqx.tree_at(lambda a: a.mass, viscous_axis(), jnp.asarray(jnp.nan)), AdaptiveSteps(), "not_finite"),
        (two_mass(), AdaptiveSteps(max_steps=16), "too_many_steps"),
    ],
)
def test_trap_9_a_failed_run_is_marked_and_holds_no_number(system, stepping, end):
    trajectory = run(system, ConstantInputs(1.0, 0.0), np.linspace(0.0, 1.0, 101), stepping=stepping)
    assert _ends(trajectory) == end
    assert _all_nan(trajectory)
    assert "." in str(SimulationStatus[trajectory.status])


def test_coarse_steps_are_marked_and_kept():
    axis = eqx.tree_at(lambda a: a.friction.viscous, viscous_axis(initial_velocity=1.0), jnp.asarray(5e3))
    times = np.linspace(0.0, 1.0, 101)
    trajectory = run(axis, REST, times, stepping=ConstantSteps(1, rtol=1e-6))
    assert _ends(trajectory) == "not_accurate"
    assert float(trajectory.error_estimate) > 1
    error = np.max(np.abs(trajectory.states.velocity - np.exp(-50 * times)))
    assert 1e-6 < error < 0.01


def test_a_sampled_loop_with_the_wrong_sign_is_marked():
    loop = eqx.tree_at(lambda loop: loop.plant.gain, LOOP, jnp.asarray(-35e3))
    move = JerkLimitedMove(0.05, 0.5, 5.0, 100.0)
    trajectory = run(loop, move, np.arange(1000) * 2e-3)
    assert _ends(trajectory) == "not_finite"
    assert _all_nan(trajectory)


def _batched(masses, stepping):
    axes = jax.vmap(lambda m: eqx.tree_at(lambda a: a.mass, viscous_axis(gain=35.0), m))(jnp.asarray(masses))
    return _batch(axes, stepping)


@eqx.filter_jit
def _batch(axes, stepping):
    times = jnp.linspace(0.0, 0.3, 61)
    return jax.vmap(lambda axis: simulate(axis, SineCommand(3.0, 2.0), times, stepping=stepping))(axes)


MASSES = np.linspace(50.0, 150.0, 8)


@pytest.mark.parametrize("stepping", [ConstantSteps(2), AdaptiveSteps(rtol=1e-8)], ids=["constant", "adaptive"])
@pytest.mark.parametrize("bad", [np.nan, -1e-3, 0.0])
def test_a_bad_lane_of_a_batch_changes_no_other(stepping, bad):
    good = np.arange(8) != 3
    clean, spoiled = (_columns(_batched(np.where(good, MASSES, mass), stepping)) for mass in (100.0, bad))
    assert np.all(np.isnan(spoiled[3]))
    if isinstance(stepping, ConstantSteps):
        np.testing.assert_array_equal(spoiled[good], clean[good])
    else:
        np.testing.assert_allclose(spoiled[good], clean[good], rtol=1e-6, atol=1e-9)


def test_trap_2_constant_steps_do_not_depend_on_the_batch():
    stepping = ConstantSteps(2)
    together = _columns(_batched(MASSES, stepping))
    backwards = _columns(_batched(MASSES[::-1], stepping))[::-1]
    few = _columns(_batched(MASSES[2:5], stepping))
    alone = np.stack([_columns(_batched([mass], stepping))[0] for mass in MASSES])
    largest = np.max(np.abs(together), axis=(0, 1))
    for other, lanes in ((backwards, slice(None)), (few, slice(2, 5)), (alone, slice(None))):
        np.testing.assert_allclose(other / largest, together[lanes] / largest, rtol=0, atol=1e-13)


def test_trap_8_a_bad_lane_does_not_stall_its_batch():
    """Counted in evaluations of the vector field: a lane of NaN gives up after some tens of steps, not 100,000."""
    evaluations = []

    class CountingInputs(SineCommand.__bases__[0]):
        def __call__(self, t):
            jax.debug.callback(lambda _: evaluations.append(1), t)
            return ConstantInputs(1.0, 0.0)(t)

        def switching_times(self):
            return jnp.zeros(0)

    axis = eqx.tree_at(lambda a: a.mass, viscous_axis(), jnp.asarray(jnp.nan))
    trajectory = run(axis, CountingInputs(), np.linspace(0.0, 1.0, 11), stepping=AdaptiveSteps())
    jax.block_until_ready(trajectory.error_estimate)
    jax.effects_barrier()
    assert _all_nan(trajectory)
    assert len(evaluations) < 1000


def test_choose_substeps_takes_the_smallest_power_of_two():
    """A light axis, whose speed settles within a few ticks, against its exact discretisation."""
    move = JerkLimitedMove(0.05, 0.5, 5.0, 100.0)
    loop = eqx.tree_at(lambda loop: loop.plant.mass, LOOP, jnp.asarray(10.0))
    exact = _columns(run(loop, move, TICKS, stepping=ConstantSteps(8, solver=diffrax.Tsit5())))
    chosen = choose_substeps(loop, move, TICKS, rtol=1e-6)
    assert chosen.substeps in (2, 4, 8)
    errors = [
        np.max(
            np.abs(_columns(run(loop, move, TICKS, stepping=ConstantSteps(n))) - exact) / np.max(np.abs(exact), axis=0)
        )
        for n in (chosen.substeps, chosen.substeps // 2)
    ]
    assert errors[0] < 1.2e-6 < 3 * errors[1]


@pytest.mark.parametrize("system", [LOOP, eqx.tree_at(lambda loop: loop.plant.gain, LOOP, jnp.asarray(-35e3))])
def test_choose_substeps_gives_up(system):
    with pytest.raises(InputError, match="2 substeps are not enough for rtol 1e-13"):
        choose_substeps(system, JerkLimitedMove(0.05, 0.5, 5.0, 100.0), TICKS, rtol=1e-13, atol=1e-30, most=2)
