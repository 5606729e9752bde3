"""A drive whose table is held by a stop: at rest both yield under the motors' forces."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rack_pinion_systems import firm, run

from twin._checks import InputError
from twin.drives import AgainstStop, RackPinionInputs, TorquePair
from twin.drives.leipe import leipe_drive
from twin.references import SampledSignal
from twin.stepping import ConstantSteps

DRIVE = leipe_drive()
STOP = AgainstStop(DRIVE, stiffness=2e8, damping=3e5)
R = float(DRIVE.travel_per_radian)
TIMES = np.linspace(0.0, 0.5, 1001)


@pytest.mark.parametrize(("torques", "load"), [((5.0, 0.0), 0.0), ((-8.0, 3.0), 0.0), ((4.0, 2.0), -500.0)])
def test_the_static_deflection_is_that_of_mesh_and_stop(torques, load):
    """The equilibrium, with the friction of motors and guides at rest zero."""
    forces = np.asarray(torques) / R
    table = (np.sum(forces) + load) / 2e8
    angles = [(table + float(DRIVE.train_1.mesh.deflection(f))) / R for f in forces]
    zero = jnp.zeros(())
    state = DRIVE.initial_state()._replace(
        angle_1=zero + angles[0], angle_2=zero + angles[1], table_position=zero + table
    )
    inputs = RackPinionInputs(TorquePair(zero + torques[0], zero + torques[1]), zero + load)
    rates = STOP.vector_field(zero, state, inputs)
    for rate in jax.tree.leaves(rates):
        assert abs(float(rate)) < 1e-3
    held = STOP.outputs(zero, state, inputs)
    np.testing.assert_allclose([held.force_1, held.force_2], forces, rtol=1e-9, atol=1e-9)
    assert float(held.position_1 - held.table_position) == pytest.approx(
        float(DRIVE.train_1.mesh.deflection(forces[0]))
    )


def test_a_slow_torque_leads_there():
    """Up to the friction of the motor, which holds against the way."""
    torque = 6.0 * np.minimum(TIMES / 0.3, 1.0)
    signal = SampledSignal(TIMES, RackPinionInputs(TorquePair(torque, 0 * torque), 0 * torque))
    seen = run(STOP, signal, TIMES, firm(STOP.initial_state()), ConstantSteps(8)).outputs
    force = float(seen.force_1[-1])
    assert force == pytest.approx(6.0 / R, rel=0.05)
    assert float(seen.table_position[-1]) == pytest.approx(force / 2e8, rel=0.02)
    bent = float(seen.position_1[-1] - seen.table_position[-1])
    assert bent == pytest.approx(float(DRIVE.train_1.mesh.deflection(force)), rel=1e-3)
    assert abs(float(seen.table_velocity[-1])) < 1e-5


def test_the_stop_takes_energy_out():
    moving = DRIVE.initial_state()._replace(table_position=jnp.asarray(1e-5), table_velocity=jnp.asarray(0.02))
    free = DRIVE.vector_field(jnp.zeros(()), moving, DRIVE.rest_inputs())
    held = STOP.vector_field(jnp.zeros(()), moving, STOP.rest_inputs())
    expected = -(2e8 * 1e-5 + 3e5 * 0.02) / float(DRIVE.table_mass)
    assert float(held.table_velocity - free.table_velocity) == pytest.approx(expected, rel=1e-12)
    assert float(held.speed_1) == float(free.speed_1)


@pytest.mark.parametrize(
    ("stiffness", "damping", "message"),
    [
        (0.0, 1.0, "stiffness of the stop must be positive"),
        (float("nan"), 1.0, "stiffness of the stop must be finite"),
        (1e8, -1.0, "damping of the stop must not be negative"),
    ],
)
def test_bad_input_is_named(stiffness, damping, message):
    with pytest.raises(InputError, match=message):
        AgainstStop(DRIVE, stiffness, damping)
