"""Linear systems: linearisation and frequency response against the closed form of a two-mass drive."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.control import DelayedPlant
from twin.drives import TwoMass, two_mass_modes
from twin.laws import CoulombFriction, LuGreFriction, ViscousFriction
from twin.linear import frequency_response, linearise
from twin.parameters import Parameter, ParameterSpace

PATHS = (
    "plant.motor_inertia",
    "plant.load_inertia",
    "plant.stiffness",
    "plant.damping",
    "plant.motor_friction.viscous",
    "plant.load_friction.viscous",
    "plant.gain",
    "delay",
)
SPACE = ParameterSpace([Parameter(path) for path in PATHS])
OUTPUTS = ("position", "load_position")


def drive(damping=0.03, motor=0.02, load=0.05, gain=1.3, delay=1.1e-4):
    plant = TwoMass(4.8e-3, 3.9e-3, 548.0, damping, ViscousFriction(motor), ViscousFriction(load), gain)
    return DelayedPlant(plant, delay)


def closed_form(values, frequency):
    """Responses of motor and load angle to the command, as one writes them by hand."""
    j1, j2, k, d, b1, b2, gain, delay = values
    s = 2j * np.pi * frequency
    shaft = k + d * s
    motor, load = j1 * s**2 + b1 * s + shaft, j2 * s**2 + b2 * s + shaft
    common = gain * np.exp(-s * delay) / (motor * load - shaft**2)
    return np.stack([load * common, shaft * common])


@jax.jit
def respond(values, frequency):
    model = SPACE.with_values(drive(), values)
    return frequency_response(model.linearise(outputs=OUTPUTS), frequency, inputs=("command",)).values[:, 0]


def test_linearised_drive_has_the_closed_form_response():
    frequency = np.linspace(1.0, 400.0, 211)
    values = SPACE.values(drive())
    np.testing.assert_allclose(respond(values, frequency), closed_form(np.asarray(values), frequency), rtol=1e-11)


def test_second_order_form_agrees_with_the_state_space():
    plant = drive().plant
    frequency = np.linspace(5.0, 300.0, 60)
    first = frequency_response(linearise(plant, outputs=OUTPUTS), frequency)
    second = frequency_response(plant.second_order(), frequency)
    assert second.outputs == first.outputs
    assert second.inputs == first.inputs
    np.testing.assert_allclose(second.values, first.values, rtol=1e-11)


@pytest.mark.parametrize(
    ("what", "damping"),
    [("resonance", 0.03), ("antiresonance", 0.03), ("lightly damped resonance", 1e-4), ("undamped", 0.0)],
)
def test_derivative_of_the_response_agrees_with_central_differences(what, damping):
    model = drive(damping, motor=damping, load=damping)
    modes = two_mass_modes(model.plant)
    at = {"antiresonance": float(modes.antiresonance), "undamped": 60.0}.get(what, float(modes.resonance))
    frequency = np.array([at])
    values = np.asarray(SPACE.values(model))
    exact = np.asarray(jax.jit(jax.jacfwd(respond))(jnp.asarray(values), frequency))[:, 0]
    assert np.all(np.isfinite(exact))
    # Steps small beside the width of the resonance; the reference is the closed form, not the code under test.
    for i, scale in enumerate((4.8e-3, 3.9e-3, 548.0, 0.03, 0.03, 0.03, 1.0, 1e-4)):
        step = np.zeros(len(values))
        step[i] = 1e-7 * scale if damping < 1e-3 and i < 3 else 1e-5 * scale
        ends = [closed_form(values + sign * step, frequency)[:, 0] for sign in (1, -1)]
        numeric = (ends[0] - ends[1]) / (2 * step[i])
        np.testing.assert_allclose(exact[:, i], numeric, rtol=2e-4, atol=1e-6 * np.abs(exact[:, i]).max())


def test_undamped_free_drive_is_finite_off_its_poles():
    """The rigid body and the undamped vibration have poles on the axis; between them nothing is infinite."""
    model = drive(0.0, 0.0, 0.0)
    resonance = float(two_mass_modes(model.plant).resonance)
    frequency = np.array([1e-3, 1.0, resonance * (1 - 1e-9), resonance * (1 + 1e-9), 1e4])
    values = SPACE.values(model)
    assert np.all(np.isfinite(respond(values, frequency)))
    assert np.all(np.isfinite(jax.jit(jax.jacfwd(respond))(values, frequency)))


def test_modes_agree_with_eigenvalues_and_a_fine_search():
    plant = drive().plant
    modes = two_mass_modes(plant)
    poles = np.linalg.eigvals(np.asarray(linearise(plant).a))
    pole = poles[np.argmax(poles.imag)]
    assert modes.damping_ratio == pytest.approx(-pole.real / abs(pole), rel=1e-9)
    values = np.asarray(SPACE.values(drive()))
    for found, sign, near in ((modes.peak, 1, modes.resonance), (modes.dip, -1, modes.antiresonance)):
        grid = float(near) * np.linspace(0.98, 1.02, 200_001)
        best = grid[np.argmax(sign * np.abs(closed_form(values, grid)[0]))]
        assert float(found) == pytest.approx(best, rel=1e-6)


def test_modes_of_an_undamped_drive_are_finite_with_their_derivatives():
    space = SPACE.subset(PATHS[:6])
    model = drive(0.0, 0.0, 0.0)

    @jax.jit
    def modes(values):
        return jnp.stack(two_mass_modes(space.with_values(model, values).plant))

    values = space.values(model)
    found = modes(values)
    np.testing.assert_allclose(found[3:], found[:2], rtol=1e-12)
    assert found[2] == 0
    assert np.all(np.isfinite(jax.jit(jax.jacfwd(modes))(values)))


def test_derivatives_of_the_modes_agree_with_central_differences():
    space = SPACE.subset(PATHS[:6])
    values = space.values(drive())

    @jax.jit
    def modes(x):
        return jnp.stack(two_mass_modes(space.with_values(drive(), x).plant))

    exact = np.asarray(jax.jit(jax.jacfwd(modes))(values))
    for i in range(6):
        step = 1e-6 * values[i]
        change = jnp.zeros(6).at[i].set(step)
        numeric = (modes(values + change) - modes(values - change)) / (2 * step)
        np.testing.assert_allclose(exact[:, i], numeric, rtol=1e-5, atol=1e-8 * np.abs(exact).max())


def test_friction_enters_by_its_slope_at_the_operating_speed():
    plant = TwoMass(4.8e-3, 3.9e-3, 548.0, 0.03, CoulombFriction(1.0, 0.1), ViscousFriction(0.05))
    state = plant.initial_state()._replace(motor_velocity=jnp.asarray(0.2), load_velocity=jnp.asarray(0.2))
    frequency = np.linspace(5.0, 300.0, 20)
    first = frequency_response(linearise(plant, state, outputs=OUTPUTS), frequency)
    second = frequency_response(plant.second_order(velocity=0.2), frequency)
    np.testing.assert_allclose(second.values, first.values, rtol=1e-10)


def test_second_order_refuses_friction_with_memory():
    lugre = LuGreFriction(1.0, 1.5, 0.01, 1e5, 100.0, 0.1, 1e-4)
    with pytest.raises(InputError, match="motor_friction is LuGreFriction"):
        TwoMass(1.0, 1.0, 1.0, 0.0, lugre, ViscousFriction(0.0)).second_order()


def test_unknown_names_are_named():
    plant = drive().plant
    with pytest.raises(InputError, match="no output 'angle'"):
        linearise(plant, outputs=("angle",))
    with pytest.raises(InputError, match="no input 'torque'"):
        frequency_response(linearise(plant), np.array([1.0]), inputs=("torque",))
    with pytest.raises(InputError, match="must be a vector"):
        frequency_response(linearise(plant), np.array(1.0))
