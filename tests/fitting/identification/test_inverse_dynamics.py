"""Inverse dynamics on records whose motion and force are known exactly."""

import numpy as np
import pytest
from scipy import ndimage, signal

from fitting.identification.inverse_dynamics import (
    DerivativeFilter,
    force_regression,
    inverse_dynamics,
    moving_speed,
    row_noise,
)
from tests.fitting.study.current_axis_study import motion
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


def test_standstill_falsifies_friction_unless_it_is_left_out():
    position, velocity, acceleration = motion()
    force = 95.0 * acceleration + 200.0 * velocity + np.where(velocity == 0, 0.0, 20.0 * np.sign(velocity)) - 3.0
    still = Record.create(
        1e-3 * np.arange(position.size),
        {"position": np.round(position / 1e-7) * 1e-7, "force": force},  # standstill, as an encoder counts it
        {"position": "m", "force": "N"},
    )
    kept = inverse_dynamics(still, AXIS, SPACE)
    slowest = moving_speed(still)
    assert slowest == pytest.approx(0.02 * np.abs(velocity).max(), rel=0.01)
    rows = force_regression(still, AXIS, SPACE, slowest=slowest)
    assert rows.left_out > 0 and np.abs(rows.velocity).min() >= slowest
    moving = inverse_dynamics(still, AXIS, SPACE, slowest=slowest)
    errors = [abs(one["friction.coulomb"].value - 20.0) for one in (kept, moving)]
    assert errors[0] > 5 * errors[1]
    np.testing.assert_allclose(moving.values, [95.0, 200.0, 20.0, -3.0], rtol=5e-3)
    with pytest.raises(InputError, match="are as fast as 9 m/s"):
        force_regression(still, AXIS, SPACE, slowest=9.0)


def test_noise_of_the_derivative_is_no_motion():
    rough = record()
    scatter = 1e-4
    assert moving_speed(rough, deviation=scatter) > 5 * moving_speed(rough)
    noise = scatter * np.random.default_rng(1).standard_normal(8000)
    _, velocity, _ = DerivativeFilter()(noise, 1e-3)
    assert moving_speed(rough, deviation=scatter) == pytest.approx(4 * velocity[50:-50].std(), rel=0.1)


@pytest.mark.parametrize("decimation", [1, 5, 10])
def test_noise_of_a_row(decimation):
    noise = np.random.default_rng(2).standard_normal(200_000)
    kept = signal.decimate(noise, decimation) if decimation > 1 else noise
    assert row_noise(decimation) == pytest.approx(kept.std(), rel=0.02)


def test_intervals_hold_where_errors_hang_together():
    """Twenty records with a slow force that the model does not know: the truth lies within two standard errors."""
    position, velocity, acceleration = motion()
    sure = {"correlated": [], "independent": []}
    for seed in range(20):
        slow = ndimage.gaussian_filter1d(np.random.default_rng(seed).standard_normal(position.size), 100)
        force = 95.0 * acceleration + 200.0 * velocity + 20.0 * np.sign(velocity) + 5 * slow / slow.std()
        one = Record.create(
            1e-3 * np.arange(position.size), {"position": position, "force": force}, {"position": "m", "force": "N"}
        )
        for kind, found in sure.items():
            result = inverse_dynamics(one, AXIS, SPACE, slowest=8e-3, correlated=kind == "correlated")
            found.append(np.abs(result.values - [95.0, 200.0, 20.0, 0.0]) < 2 * result.standard_errors)
    assert np.mean(sure["correlated"]) >= 0.8
    assert np.mean(sure["independent"]) < 0.7


def test_derivatives_of_a_smooth_motion():
    t = 1e-3 * np.arange(4000)
    _, velocity, acceleration = DerivativeFilter()(np.sin(5 * t), 1e-3)
    inner = slice(200, -200)
    np.testing.assert_allclose(velocity[inner], 5 * np.cos(5 * t)[inner], atol=1e-4)
    np.testing.assert_allclose(acceleration[inner], -25 * np.sin(5 * t)[inner], atol=1e-3)


def test_what_is_not_linear_is_refused():
    space = ParameterSpace([Parameter("mass"), Parameter("friction.width", "m/s")])
    axis = ServoAxis(1.0, CoulombViscousFriction(1.0, 1.0, 0.1))
    with pytest.raises(InputError, match=r"^friction.width does not enter the force linearly"):
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
