"""A rack-and-pinion drive left alone never gains energy, and keeps it where nothing damps."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from twin.drives import DriveTrain, RackPinionDrive
from twin.laws import Backlash, HyperbolicDamping, RootStiffness, TangentMesh, ViscousFriction
from twin.references import SampledSignal
from twin.simulation import simulate
from twin.stepping import ConstantSteps

STEPS = 500
RADIUS = 0.08488 / 32
STEPPING = ConstantSteps(1, rtol=1e300, solver=diffrax.Tsit5())
FREE = ViscousFriction(0.0)


def _drive(p):
    """k1, k2, d1, d2, d3, play, inertia, mass, and the widths of contact [m] and of the root [N]."""
    k1, k2, d1, d2, d3, play, inertia, mass, width, force_width = p
    mesh = TangentMesh(RootStiffness(k1, k2, force_width), HyperbolicDamping(d1, d2, d3), Backlash(play, width))
    train = DriveTrain(inertia, FREE, mesh, 30.0)
    return RackPinionDrive(train, train, mass, FREE, 16.0, 2 * 16.0 * RADIUS)


def _energy(drive, state):
    r = drive.travel_per_radian
    total = 0.5 * drive.table_mass * state.table_velocity**2
    for train, angle, speed in (
        (drive.train_1, state.angle_1, state.speed_1),
        (drive.train_2, state.angle_2, state.speed_2),
    ):
        total += 0.5 * train.inertia * speed**2 + train.mesh.potential(r * angle - state.table_position)
    return total


@jax.jit
def _piece(p, state, h):
    """Energy after each of some free steps, and the state after the last."""
    drive = _drive(p)
    times = h * jnp.arange(STEPS + 1)
    rest = SampledSignal(np.array([0.0, 1.0]), jax.tree.map(lambda x: jnp.stack([x, x]), drive.rest_inputs()))
    states = simulate(drive, rest, times, initial_state=state, stepping=STEPPING).states
    return _energy(drive, states), jax.tree.map(lambda x: x[-1], states)


@jax.jit
def _power(p, state):
    """Rate of the energy along the vector field, and what both dampers take."""
    drive = _drive(p)
    field = drive.vector_field(jnp.zeros(()), state, drive.rest_inputs())
    rate = jax.jvp(lambda x: _energy(drive, x), (state,), (field,))[1]
    r, taken = drive.travel_per_radian, 0.0
    for mesh, angle, speed in (
        (drive.train_1.mesh, state.angle_1, state.speed_1),
        (drive.train_2.mesh, state.angle_2, state.speed_2),
    ):
        delta, along = r * angle - state.table_position, r * speed - state.table_velocity
        taken += (mesh.force(delta, along, 0.0) - mesh.force(delta, 0.0, 0.0)) * along
    return rate, taken


def _free(p, state, h, pieces):
    energies = []
    for _ in range(pieces):
        energy, state = _piece(p, state, h)
        energies.append(np.asarray(energy if not energies else energy[1:]))
    return np.concatenate(energies)


def _state(p, deflections, velocities):
    """Deflections from -1 to 1, where 1 is 20 µm beyond the play; velocities of the pitch circles and of the table."""
    reach = (0.5 * p[5] + 20e-6) / RADIUS
    angles = [jnp.asarray(d * reach) for d in deflections]
    speeds = [jnp.asarray(v / RADIUS) for v in velocities[:2]]
    start = _drive(p).initial_state()
    return start._replace(
        angle_1=angles[0],
        angle_2=angles[1],
        speed_1=speeds[0],
        speed_2=speeds[1],
        table_velocity=jnp.asarray(velocities[2]),
    )


# An impact is resolved where a step is shorter than the way over which contact is made, here at up to 0.06 m/s.
WIDTH = 1e-6
_parameters = st.tuples(
    st.floats(1e6, 4e7),
    st.floats(3.0, 20.0),
    st.floats(0.0, 2e6),
    st.floats(50.0, 2000.0),
    st.floats(0.0, 5e4),
    st.floats(0.0, 1e-4),
    st.floats(1e-3, 2e-2),
    st.floats(100.0, 1000.0),
)
_unit = st.floats(-1.0, 1.0)
_velocity = st.floats(-0.03, 0.03)
BENCH = (1.8709e7, 5.6406, 9.5376e5, 148.3813, 2.0734e4, 40e-6, 7.5e-3, 403.8)


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(_parameters, st.tuples(_unit, _unit), st.tuples(_velocity, _velocity, _velocity))
@example(BENCH, (0.0, 0.0), (0.03, -0.03, 0.0))
@example((*BENCH[:5], 1e-4, *BENCH[6:]), (-1.0, 1.0), (0.03, -0.03, 0.01))
def test_a_drive_left_alone_never_gains_energy(parameters, deflections, velocities):
    """Allowed is what halving the steps changes: the error of the finer run, which is judged, is smaller still."""
    p = np.array([*parameters, WIDTH, 1.0])
    state = _state(p, deflections, velocities)
    coarse, fine = _free(p, state, 1e-5, 3), _free(p, state, 5e-6, 6)
    error = np.max(np.abs(coarse - fine[::2]))
    rounding = 1e-14 * fine[0] + 1e-18
    assert error <= 1e-3 * fine[0] + rounding
    assert np.max(np.diff(fine)) <= error + rounding


@settings(deadline=None)
@given(_parameters, st.tuples(_unit, _unit), st.tuples(_velocity, _velocity, _velocity), st.floats(1e-8, 1e-5))
def test_what_is_lost_is_what_the_dampers_take(parameters, deflections, velocities, width):
    p = np.array([*parameters, width, 1.0])
    state = _state(p, deflections, velocities)
    rate, taken = map(float, _power(p, state))
    scale = sum(abs(v) for v in velocities) * 1e5
    assert taken >= 0
    assert abs(rate + taken) <= 1e-11 * scale


def test_without_damping_energy_is_kept_at_the_order_of_the_method():
    """Through the play, from flank to flank."""
    p = np.array([*BENCH[:2], 0.0, BENCH[3], 0.0, *BENCH[5:], 2e-5, 1000.0])
    state = _state(p, (0.0, 0.5), (0.03, -0.03, 0.01))
    drift = []
    for pieces in (1, 2, 4):
        energy = _free(p, state, 0.064 / (pieces * STEPS), pieces)
        drift.append(np.max(np.abs(energy - energy[0])) / energy[0])
    assert drift[-1] < 1e-11
    np.testing.assert_allclose(np.log2(np.divide(drift[:-1], drift[1:])), 5, atol=0.15)


def test_with_damping_a_drive_comes_to_rest_in_contact_or_in_its_play():
    p = np.array([*BENCH, WIDTH, 1.0])
    energy = _free(p, _state(p, (1.0, -1.0), (0.03, -0.03, 0.02)), 2e-5, 10)
    # What moves on alike cannot be damped: the momentum is kept.
    assert 0 < energy[-1] < 0.2 * energy[0]
