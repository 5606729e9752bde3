"""The ball screw axis: simulation against energy, its linear models, its rigid limit."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.drives import BallScrewState, DriveInputs, SpringDampers, StructuralDamping, mauro_axis
from twin.laws import LuGreFriction, ViscousFriction
from twin.linear import frequency_response, linearise
from twin.paths import get_leaf, set_leaves
from twin.references import SampledSignal
from twin.simulation import simulate
from twin.stepping import AdaptiveSteps, ConstantSteps
from twin.trajectory import SimulationStatus

BODIES = ("motor_inertia", "end_inertia", "screw_inertia", "screw_mass", "nut_mass", "slide_mass")


DAMPERS = (3.0, 2.0, 4e4, 3e4, 2e4)


def deformations(axis, x):
    """How far the five springs are deformed by six displacements."""
    h = axis.lead / (2 * jnp.pi)
    return jnp.stack([x[0] - x[1], x[1] - x[2], x[3], x[3] + h * x[2] - x[4], x[4] - x[5]])


def energy(axis, state):
    """Kinetic and elastic energy, and that of the current's field."""
    k = axis.springs.in_series(axis.nut_position + (state.slide_displacement if axis.follow_nut else 0.0))
    kinetic = sum(getattr(axis, name) * v**2 for name, v in zip(BODIES, state[6:12], strict=True))
    elastic = jnp.sum(jnp.stack(k) * deformations(axis, state[:6]) ** 2)
    return 0.5 * (kinetic + elastic + axis.motor.inductance * state.current**2)


def random_state(axis, seed):
    """Some decimetre along the travel, with strains, speeds and a current."""
    rng = np.random.default_rng(seed)
    scale = np.array([1e-3] * 3 + [1e-4] * 3 + [5.0] * 3 + [0.05] * 3 + [10.0])
    base = np.array([30.0] * 3 + [0.0] + [0.095] * 2 + [0.0] * 7)
    values = base + scale * rng.standard_normal(13)
    return BallScrewState(*map(jnp.asarray, values), axis.friction.initial_state())


def following(axis, follow):
    fields = {name: getattr(axis, name) for name in axis.__dataclass_fields__}
    return type(axis)(**{**fields, "follow_nut": follow})


@pytest.mark.parametrize("follow", [True, False])
def test_energy_flows_in_by_the_terminals_and_out_by_losses(follow):
    """d/dt E = V·i + load·v - R·i² - losses of springs - T_f·ω, with k_e = k_T, to rounding, also while l changes."""
    axis = eqx.tree_at(lambda a: a.damping, mauro_axis(), SpringDampers(*DAMPERS))
    axis = following(axis, follow)
    inputs = DriveInputs(jnp.asarray(70.0), jnp.asarray(-400.0))

    @jax.jit
    def balance(state):
        field = axis.vector_field(jnp.zeros(()), state, inputs)
        rate = jax.jvp(lambda s: energy(axis, s), (state,), (field,))[1]
        loss = jnp.sum(jnp.asarray(DAMPERS) * deformations(axis, state[6:12]) ** 2)
        loss += axis.motor.resistance * state.current**2 + axis.friction(state.screw_speed) * state.screw_speed
        return rate, inputs.command * state.current + inputs.load * state.slide_velocity - loss

    for seed in range(5):
        assert np.isclose(*balance(random_state(axis, seed)), rtol=1e-9)


def test_free_axis_without_losses_keeps_its_energy():
    """A shove of the slide, 20 ms without voltage or damping; the winding is made open by a huge resistance."""
    axis = mauro_axis()
    axis = eqx.tree_at(lambda a: (a.damping, a.friction), axis, (StructuralDamping(0.0), ViscousFriction(0.0)))
    axis = set_leaves(axis, {"motor.torque_constant": 1e-12, "motor.back_emf": 1e-12})
    start = axis.initial_state()._replace(slide_velocity=jnp.asarray(0.5), motor_speed=jnp.asarray(120.0))
    rest = SampledSignal(np.array([0.0, 1.0]), jax.tree.map(lambda x: jnp.stack([x, x]), axis.rest_inputs()))
    stepping = AdaptiveSteps(rtol=1e-11, atol=1e-14)
    run = simulate(axis, rest, jnp.linspace(0.0, 0.02, 21), initial_state=start, stepping=stepping)
    assert run.status == SimulationStatus.successful
    energies = jax.vmap(lambda s: energy(axis, s))(run.states)
    assert np.ptp(run.outputs.position) > 1e-3
    assert np.allclose(energies, energies[0], rtol=1e-8)


def test_linearised_axis_is_its_second_order_system_behind_the_motor():
    """From voltage to slide: current, torque and back EMF around the mechanics of eq. 18."""
    axis = eqx.tree_at(lambda a: a.friction, mauro_axis(), ViscousFriction(0.02))
    frequency = jnp.geomspace(0.5, 3000.0, 60)
    full = frequency_response(linearise(axis, outputs=("position", "motor_angle", "current")), frequency)
    mechanics = frequency_response(axis.second_order(friction_speed=0.0), frequency)
    s = 2j * np.pi * frequency
    motor = axis.motor
    angle, position = mechanics["motor_angle", "torque"], mechanics["position", "torque"]
    impedance = motor.resistance + s * motor.inductance + motor.torque_constant * motor.back_emf * s * angle
    assert np.allclose(full["current", "command"] * impedance, 1.0, rtol=1e-8)
    assert np.allclose(full["motor_angle", "command"], motor.torque_constant * angle / impedance, rtol=1e-8)
    assert np.allclose(full["position", "command"], motor.torque_constant * position / impedance, rtol=1e-8)


def test_rigid_axis_is_the_low_frequency_limit():
    axis = eqx.tree_at(lambda a: a.friction, mauro_axis(), ViscousFriction(0.02))
    rigid = axis.rigid()
    h = 0.02 / (2 * np.pi)
    rotating = axis.motor_inertia + axis.end_inertia + axis.screw_inertia
    assert np.isclose(rigid.inertia, rotating + h**2 * 205.0, rtol=1e-14)
    frequency = jnp.array([0.1, 0.3, 1.0, 3.0])
    pair = [frequency_response(linearise(a), frequency) for a in (axis, rigid)]
    for output in ("position", "motor_angle", "current", "torque"):
        ratio = pair[0][output, "command"] / pair[1][output, "command"]
        # The difference grows as the square of the frequency over the first natural one.
        assert np.all(np.abs(ratio - 1) < 3 * (frequency / 152.0) ** 2 + 1e-6), output
    load = pair[0]["velocity", "load"] / pair[1]["velocity", "load"]
    assert np.abs(load[0] - 1) < 1e-2


def test_rigid_and_elastic_axis_run_alike():
    axis = mauro_axis()
    times = np.linspace(0.0, 0.3, 61)
    volts = SampledSignal(np.array([0.0, 0.1, 0.3]), DriveInputs(np.array([0.0, 60.0, 60.0]), np.zeros(3)))
    stepping = AdaptiveSteps(solver=diffrax.Tsit5())
    elastic, rigid = (simulate(a, volts, times, stepping=stepping) for a in (axis, axis.rigid()))
    assert elastic.status == SimulationStatus.successful
    assert rigid.status == SimulationStatus.successful
    assert elastic.outputs._fields == rigid.outputs._fields
    assert float(rigid.outputs.position[-1]) > 0.02
    assert np.allclose(elastic.outputs.position, rigid.outputs.position, atol=5e-5)
    assert np.allclose(elastic.outputs.power, rigid.outputs.power, atol=60.0)
    assert np.allclose(elastic.outputs.torque, 1.5 * elastic.outputs.current, rtol=1e-14)
    assert np.allclose(elastic.outputs.power, elastic.outputs.voltage * elastic.outputs.current, rtol=1e-14)


def test_sensitivities_of_a_run():
    """The travel's derivative with respect to a mass, a stiffness and the lead, against differences."""
    axis, paths = mauro_axis(), ("slide_mass", "springs.support", "lead")
    nominal = jnp.stack([get_leaf(axis, path) for path in paths])
    volts = SampledSignal(np.array([0.0, 0.01, 0.05]), DriveInputs(np.array([0.0, 60.0, 60.0]), np.zeros(3)))

    def travel(factors):
        changed = set_leaves(axis, dict(zip(paths, nominal * factors, strict=True)))
        run = simulate(changed, volts, np.linspace(0.0, 0.05, 26), stepping=ConstantSteps(40))
        return run.outputs.position[-1]

    slopes = jax.jit(jax.jacfwd(travel))(jnp.ones(3))
    compiled, h = jax.jit(travel), 1e-4
    for i, slope in enumerate(slopes):
        step = h * jnp.zeros(3).at[i].set(1.0)
        assert np.isclose(slope, (compiled(1 + step) - compiled(1 - step)) / (2 * h), rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("elastic", [True, False])
def test_friction_with_memory(elastic):
    """Below breakaway the bristles hold the screw against the motor."""
    axis = eqx.tree_at(lambda a: a.friction, mauro_axis(), LuGreFriction(1.2, 1.8, 4.0, 500.0, 1.0, 0.01, 1e-3))
    axis = axis if elastic else axis.rigid()
    volts = SampledSignal(np.array([0.0, 0.01, 0.3]), DriveInputs(np.array([0.0, 0.2, 0.2]), np.zeros(3)))
    run = simulate(axis, volts, np.linspace(0.0, 0.3, 7), stepping=AdaptiveSteps(solver=diffrax.Tsit5()))
    assert run.status == SimulationStatus.successful
    torque = 1.5 * 0.2 / 0.35
    assert np.isclose(run.outputs.torque[-1], torque, rtol=2e-2)
    assert np.isclose(500.0 * run.states.friction.deflection[-1], torque, rtol=2e-2)


def test_friction_with_memory_has_no_slope():
    axis = eqx.tree_at(lambda a: a.friction, mauro_axis(), LuGreFriction(1.2, 1.8, 4.0, 500.0, 1.0, 0.01, 1e-3))
    assert axis.second_order().viscous.shape == (6, 6)
    with pytest.raises(InputError, match="linearise"):
        axis.second_order(friction_speed=0.0)


@pytest.mark.slow
def test_nut_that_leaves_the_screw_marks_the_run():
    axis = mauro_axis()
    start = axis.initial_state()._replace(
        slide_velocity=jnp.asarray(3.0),
        nut_velocity=jnp.asarray(3.0),
        **{name: 3.0 / axis.travel_per_radian for name in ("motor_speed", "end_speed", "screw_speed")},
    )
    rest = SampledSignal(np.array([0.0, 1.0]), jax.tree.map(lambda x: jnp.stack([x, x]), axis.rest_inputs()))
    axis = set_leaves(axis, {"motor.torque_constant": 1e-6, "motor.back_emf": 1e-6})
    run = simulate(axis, rest, np.linspace(0.0, 0.5, 6), initial_state=start, stepping=ConstantSteps(2000))
    assert run.status == SimulationStatus.not_finite
    assert np.all(np.isnan(run.outputs.position))
