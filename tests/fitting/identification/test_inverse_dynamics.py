"""Inverse dynamics on records whose motion and force are known exactly."""

import numpy as np
import pytest

from fitting.identification.inverse_dynamics import DerivativeFilter, inverse_dynamics
from twin._checks import InputError
from twin.drives import ServoAxis
from twin.laws import CoulombViscousFriction, LuGreFriction
from twin.parameters import Parameter, ParameterSpace
from twin.record import Record

SPACE = ParameterSpace([Parameter(p) for p in ("mass", "friction.viscous", "friction.coulomb", "offset")])
AXIS = ServoAxis(1.0, CoulombViscousFriction(1.0, 1.0, 1e-9))


def record(samples=8000, channels=("position", "force")):
    t = 1e-3 * np.arange(samples)
    slow, fast = 2 * np.pi * 0.5, 2 * np.pi * 1.3
    position = 0.1 * np.sin(slow * t) + 0.02 * np.sin(fast * t)
    velocity = 0.1 * slow * np.cos(slow * t) + 0.02 * fast * np.cos(fast * t)
    acceleration = -0.1 * slow**2 * np.sin(slow * t) - 0.02 * fast**2 * np.sin(fast * t)
    force = 95.0 * acceleration + 200.0 * velocity + 20.0 * np.sign(velocity) - 3.0
    known = {"position": position, "force": force}
    return Record.create(t, {c: known[c] for c in channels}, {"position": "m", "force": "N"})


def test_known_motion_gives_the_parameters_back():
    result = inverse_dynamics(record(), AXIS, SPACE, decimation=1)
    np.testing.assert_allclose(result.values, [95.0, 200.0, 20.0, -3.0], rtol=2e-3)
    assert result.success


def test_fixed_parameters_stay_in_the_model():
    space = SPACE.subset(["mass", "friction.coulomb"])
    axis = ServoAxis(1.0, CoulombViscousFriction(1.0, 200.0, 1e-9), offset=-3.0)
    result = inverse_dynamics(record(), axis, space, decimation=1)
    np.testing.assert_allclose(result.values, [95.0, 20.0], rtol=2e-3)
    assert result.model.friction.viscous == 200.0


def test_derivatives_of_a_smooth_motion():
    t = 1e-3 * np.arange(4000)
    _, velocity, acceleration = DerivativeFilter()(np.sin(5 * t), 1e-3)
    inner = slice(200, -200)
    np.testing.assert_allclose(velocity[inner], 5 * np.cos(5 * t)[inner], atol=1e-4)
    np.testing.assert_allclose(acceleration[inner], -25 * np.sin(5 * t)[inner], atol=1e-3)


def test_what_is_not_linear_is_refused():
    space = ParameterSpace([Parameter("mass"), Parameter("friction.width", "m/s")])
    axis = ServoAxis(1.0, CoulombViscousFriction(1.0, 1.0, 0.1))
    with pytest.raises(InputError, match=r"friction.width enter the force linearly"):
        inverse_dynamics(record(), axis, space)


def test_friction_with_memory_is_refused():
    axis = ServoAxis(1.0, LuGreFriction(1.0, 2.0, 0.01, 1e4, 10.0, 1.0, 1e-3))
    with pytest.raises(InputError, match="LuGreFriction has an internal state"):
        inverse_dynamics(record(), axis, ParameterSpace([Parameter("mass")]))


def test_short_record_missing_channel_and_cutoff_are_refused():
    with pytest.raises(InputError, match="300 samples are too few for 4 parameters"):
        inverse_dynamics(record(300), AXIS, SPACE)
    with pytest.raises(InputError, match="force"):
        inverse_dynamics(record(channels=("position",)), AXIS, SPACE)
    with pytest.raises(InputError, match="Nyquist frequency 500 Hz"):
        inverse_dynamics(record(), AXIS, SPACE, derivatives=DerivativeFilter(cutoff=600.0))
