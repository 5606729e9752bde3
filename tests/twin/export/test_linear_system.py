"""Linear systems in python-control and SciPy answer as the twin does."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from reference_systems import two_mass

from twin._checks import InputError
from twin.drives import leipe_drive, mauro_axis
from twin.export import from_control, state_names, to_control, to_scipy
from twin.frf import FRF
from twin.linear import StateSpace, frequency_response, linearise

control = pytest.importorskip("control")
# Below, free drives are ill conditioned: stiffness is 1e10 times what inertia resists.
FREQUENCY = np.geomspace(1.0, 2000.0, 60)
PLANTS = {"two_mass": two_mass, "rack_pinion": leipe_drive, "ball_screw": mauro_axis}


def free_two_mass():
    return eqx.tree_at(lambda d: d.damping, two_mass(), jnp.asarray(0.0)).second_order()


SYSTEMS = {name: lambda make=make: linearise(make()) for name, make in PLANTS.items()}
SYSTEMS |= {
    "second_order": lambda: two_mass().second_order(1.0),
    "rigid_body": free_two_mass,
    "screw_second_order": lambda: mauro_axis().second_order(0.3),
}


def worst(values, expected):
    """Largest error of each response, relative to its peak."""
    peak = np.max(np.abs(expected), axis=-1, keepdims=True)
    return float(np.max(np.abs(values - expected) / np.where(peak == 0, 1.0, peak)))


@pytest.mark.parametrize("name", SYSTEMS)
def test_python_control_answers_as_the_twin(name):
    system = SYSTEMS[name]()
    expected = np.asarray(frequency_response(system, FREQUENCY).values)
    other = to_control(system)
    assert worst(np.asarray(other(2j * np.pi * FREQUENCY, squeeze=False)), expected) < 1e-10
    assert [name.replace("_", ".") for name in other.input_labels] == [name.replace("_", ".") for name in system.inputs]
    assert tuple(other.output_labels) == system.outputs


@pytest.mark.parametrize("name", SYSTEMS)
def test_scipy_holds_the_same_matrices(name):
    system = SYSTEMS[name]()
    one, other = to_control(system), to_scipy(system)
    for matrix in "ABCD":
        np.testing.assert_array_equal(getattr(one, matrix), getattr(other, matrix))


@pytest.mark.parametrize("name", PLANTS)
def test_states_have_the_plants_names(name):
    plant = PLANTS[name]()
    other = to_control(linearise(plant), states=state_names(plant))
    assert other.state_labels == [name.replace(".", "_") for name in state_names(plant)]


def test_a_frequency_response_keeps_its_values_and_names():
    frf = frequency_response(linearise(two_mass()), FREQUENCY)
    there = to_control(frf)
    back = from_control(there)
    assert isinstance(back, FRF)
    np.testing.assert_allclose(back.values, frf.values, rtol=1e-15)
    np.testing.assert_allclose(back.frequency, frf.frequency, rtol=1e-15)
    assert (back.inputs, back.outputs) == (frf.inputs, frf.outputs)


def test_a_state_space_comes_back_as_it_was():
    system = linearise(two_mass())
    back = from_control(to_control(system))
    assert isinstance(back, StateSpace)
    assert eqx.tree_equal(back, system)


def test_dead_time_by_a_pade_approximation():
    system = linearise(two_mass(), delay=2e-4)
    low = np.geomspace(1.0, 200.0, 30)
    other = to_control(system, pade_order=4)
    assert tuple(other.input_labels) == system.inputs
    expected = np.asarray(frequency_response(system, low).values)
    assert worst(np.asarray(other(2j * np.pi * low, squeeze=False)), expected) < 1e-6


def test_what_cannot_be_converted_is_refused():
    late = linearise(two_mass(), delay=1e-4)
    with pytest.raises(InputError, match=r"dead time of 0\.0001 s"):
        to_control(late)
    with pytest.raises(InputError, match="dead time"):
        to_scipy(late)
    damped = eqx.tree_at(lambda s: s.hysteretic, two_mass().second_order(), jnp.eye(2))
    with pytest.raises(InputError, match="hysteretic"):
        to_control(damped)
    with pytest.raises(InputError, match="2 names, but the system has 4"):
        to_control(linearise(two_mass()), states=("a", "b"))
    with pytest.raises(InputError, match="discrete"):
        from_control(control.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], dt=0.1))
    with pytest.raises(InputError, match="TransferFunction"):
        from_control(control.tf([1.0], [1.0, 1.0]))
