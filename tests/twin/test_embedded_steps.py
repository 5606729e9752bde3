"""Embedded Runge-Kutta steps that end at every saved time."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin._embedded import integrate_embedded
from twin.control import CascadeGains, ClosedLoop, PreloadCascade
from twin.drives import leipe_drive
from twin.references import JerkLimitedMove
from twin.simulation import SimulationStatus, simulate
from twin.stepping import AdaptiveSteps, EmbeddedSteps

TIMES = jnp.linspace(0.0, 3.0, 13)
NO_KNOTS = jnp.zeros(0)


def swing(t, y):
    """Undamped, with a frequency of one radian per second."""
    return [y[1], -y[0]]


def run(stepping, field=swing, start=(1.0, 0.0), knots=NO_KNOTS):
    return integrate_embedded(field, [jnp.asarray(x) for x in start], TIMES, knots, stepping)


@pytest.mark.parametrize("solver", [diffrax.Bosh3(), diffrax.Tsit5(), diffrax.Dopri5()])
def test_error_follows_the_tolerance(solver):
    errors, steps = [], []
    for rtol in (1e-4, 1e-6, 1e-8):
        (position, velocity), complete, stuck, tried = run(EmbeddedSteps(rtol=rtol, atol=rtol, solver=solver))
        assert bool(complete) and not bool(stuck)
        errors.append(float(jnp.max(jnp.abs(jnp.stack([position - jnp.cos(TIMES), velocity + jnp.sin(TIMES)])))))
        steps.append(int(tried))
    assert all(error < 20 * rtol for error, rtol in zip(errors, (1e-4, 1e-6, 1e-8), strict=True))
    assert steps[0] <= steps[1] <= steps[2] != steps[0]


def test_a_jump_at_a_knot_is_met_exactly():
    # Slope 1 before the knot and 5 after it: any step across it would be off.
    knot = 0.7
    (found,), complete, _, tried = run(
        EmbeddedSteps(), lambda t, y: [jnp.where(t < knot, 1.0, 5.0)], (0.0,), jnp.asarray([knot, knot, 1.5, 99.0])
    )
    wanted = np.where(knot > TIMES, TIMES, knot + 5 * (TIMES - knot))
    np.testing.assert_allclose(found, wanted, rtol=1e-13)
    assert bool(complete)
    assert int(tried) < 60


def test_a_lane_that_blows_up_stops_and_leaves_the_others_alone():
    def one(growth):
        return run(EmbeddedSteps(), lambda t, y: [growth * y[0] ** 2], (1.0,))

    (found,), complete, stuck, _ = jax.vmap(one)(jnp.asarray([0.1, 2.0]))
    np.testing.assert_array_equal(complete, [True, False])
    np.testing.assert_array_equal(stuck, [False, True])
    np.testing.assert_allclose(found[0], 1 / (1 - 0.1 * TIMES), rtol=1e-4)


def test_too_few_steps_are_told_from_divergence():
    _, complete, stuck, tried = run(EmbeddedSteps(rtol=1e-8, atol=1e-8, max_steps=20))
    assert not bool(complete) and not bool(stuck)
    assert int(tried) == 20


def test_solver_without_a_shared_stage_is_refused():
    with pytest.raises(InputError, match="Bosh3"):
        EmbeddedSteps(solver=diffrax.Midpoint())


@pytest.fixture(scope="module")
def rack():
    gains = CascadeGains(25.0, 700.0, 0.02, 5e-4, 1.25, 12.5, 30.0)
    return ClosedLoop(leipe_drive(), PreloadCascade(gains)), JerkLimitedMove(0.02, 0.3, 2.0, 50.0, start_time=0.05)


def _torque(rack, stepping):
    loop, reference = rack
    times = jnp.linspace(0.0, 0.3, 31)

    def torque(relative):
        values = (loop.plant.train_1.inertia, loop.plant.train_1.mesh.backlash.play, loop.plant.table_mass)
        changed = eqx.tree_at(
            lambda m: (m.plant.train_1.inertia, m.plant.train_1.mesh.backlash.play, m.plant.table_mass),
            loop,
            tuple(v * r for v, r in zip(values, relative, strict=True)),
        )
        out = simulate(changed, reference, times, stepping=stepping)
        return out.outputs.torque_1, out.status

    return torque


def test_drive_with_its_sensitivities_agrees_with_diffrax_alone_and_in_a_batch(rack):
    fast = _torque(rack, EmbeddedSteps(rtol=1e-6, atol=1e-9, solver=diffrax.Tsit5()))
    slow = _torque(rack, AdaptiveSteps(rtol=1e-8, atol=1e-11))
    ones = jnp.ones(3)
    wanted, _ = jax.jit(slow)(ones)
    derivative = jax.jit(jax.jacfwd(lambda r: slow(r)[0]))(ones)
    batch, status = jax.jit(jax.vmap(fast))(jnp.stack([ones, 1.1 * ones]))
    scale = float(jnp.max(jnp.abs(wanted)))
    np.testing.assert_allclose(batch[0], wanted, atol=1e-4 * scale)
    assert bool(jnp.all(status == SimulationStatus.successful))
    found = jax.jit(jax.jacfwd(lambda r: fast(r)[0]))(ones)
    np.testing.assert_allclose(found, derivative, atol=1e-3 * float(jnp.max(jnp.abs(derivative))))
