"""The position and velocity control of a screw axis against closed forms, its voltage limit, and its derivatives."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from twin._checks import InputError
from twin.control import ClosedLoop, PositionVelocityPI
from twin.drives import DcMotor, RigidScrewAxis, ScrewAxisOutputs
from twin.io.units import to_si
from twin.laws import ViscousFriction
from twin.references import AbstractReference, MotionPoint
from twin.simulation import simulate
from twin.stepping import ConstantSteps

LEAD, INERTIA, SPEED = 0.02, 0.0105, 0.1
H = LEAD / (2 * np.pi)
R, L, KE, KT = 0.35, 4e-3, 1.5, 1.5
AXIS = RigidScrewAxis(DcMotor(R, L, KE, KT), INERTIA, LEAD, ViscousFriction(0.0))
KV, KP, KI = 45.0, 5.0, 250.0
TIMES = np.linspace(0.0, 0.1, 201)
STEPPING = ConstantSteps(substeps=4, solver=diffrax.Dopri5())


def control(position_gain=KV, velocity_gain=KP, integral_gain=KI, **fields):
    return PositionVelocityPI(position_gain, velocity_gain, integral_gain, fields.pop("lead", LEAD), **fields)


def matrices(kff, h=H):
    """d/dt (θ, ω, i, I) = A·x + b_x·x_ref + b_v·ẋ_ref, by hand."""
    e = np.array([-KV, -1.0, 0.0, 0.0])  # speed error of the states, the loop closed over h·θ
    a = np.zeros((4, 4))
    a[0, 1], a[1, 2] = 1.0, KT / INERTIA
    a[2] = (KP * e + np.array([0.0, -KE, -R, 1.0])) / L
    a[3] = KI * e
    return a, np.array([0, 0, KP / L, KI]) * KV / h, np.array([0, 0, KP / L, KI]) * kff / h


class Ramp(AbstractReference):
    """A set position that is held from the start, or runs from there."""

    height: jax.Array
    velocity: jax.Array

    def __call__(self, t):
        return MotionPoint(self.height + self.velocity * t, self.velocity, jnp.zeros(()))

    def switching_times(self):
        return jnp.zeros(0)


def step(height):
    return Ramp(jnp.asarray(height), jnp.zeros(()))


def run(controller, reference, times=TIMES, axis=AXIS):
    return simulate(ClosedLoop(axis, controller), reference, times, stepping=STEPPING)


@pytest.mark.parametrize("lead", [LEAD, -LEAD])
@pytest.mark.parametrize("feedback", ["motor", "slide"])
def test_step_is_that_of_the_linear_system(lead, feedback):
    axis = eqx.tree_at(lambda a: a.lead, AXIS, jnp.asarray(lead))
    found = run(control(lead=lead, feedback=feedback), step(1e-3), axis=axis)
    a, b, _ = matrices(0.0, lead / (2 * np.pi))
    still = -np.linalg.solve(a, b * 1e-3)
    for k in (20, 60, 200):
        exact = still - scipy.linalg.expm(a * TIMES[k]) @ still
        assert float(found.states.plant.angle[k]) == pytest.approx(exact[0], rel=1e-5)
        assert float(found.outputs.position[k]) == pytest.approx(lead / (2 * np.pi) * exact[0], rel=1e-5)
        assert float(found.states.controller.integral[k]) == pytest.approx(exact[3], rel=1e-4, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("kff", [0.0, 0.6, 1.0])
def test_following_error_of_a_ramp(kff):
    """A PI velocity controller leaves no velocity error: the position lags by (1 - k_FF)·v/k_v."""
    times = np.linspace(0.0, 1.2, 2401)
    found = run(control(feedforward=kff), Ramp(jnp.zeros(()), jnp.asarray(SPEED)), times)
    lag = SPEED * times - np.asarray(found.outputs.position)
    assert lag[-1] == pytest.approx((1 - kff) * SPEED / KV, abs=3e-8)
    a, b_x, b_v = matrices(kff)
    everything = np.zeros((6, 6))
    everything[:4, :4], everything[:4, 4], everything[:4, 5], everything[4, 5] = a, b_x, b_v, 1.0
    exact = scipy.linalg.expm(everything * times[100]) @ np.array([0, 0, 0, 0, 0, SPEED])
    assert lag[100] == pytest.approx(exact[4] - H * exact[0], rel=1e-5)


def measured(angle=0.0, speed=0.0, position=0.0):
    o = jnp.zeros(())
    return ScrewAxisOutputs(jnp.asarray(position), o, jnp.asarray(angle), jnp.asarray(speed), o, o, o, o, o)


def test_command_is_the_formula_and_without_a_limit_exactly_so():
    t, state = jnp.zeros(()), control().initial_state()._replace(integral=jnp.asarray(2e9))
    at = MotionPoint(jnp.asarray(0.01), jnp.asarray(0.2), jnp.zeros(()))
    seen = measured(angle=2.0, speed=30.0, position=0.004)
    for feedback, x in (("motor", H * 2.0), ("slide", 0.004)):
        c = control(feedback=feedback, feedforward=0.8)
        error = (KV * (0.01 - x) + 0.8 * 0.2) / H - 30.0
        assert float(c.command(t, state, at, seen)) == pytest.approx(KP * error + 2e9, rel=1e-15)
        assert float(c.vector_field(t, state, at, seen).integral) == pytest.approx(KI * error, rel=1e-12)
    limited = control(voltage_limit=300.0).command(t, state, at, seen)
    assert 299.9 < float(limited) <= 300.0


@pytest.mark.slow
def test_anti_windup_keeps_the_integral_from_running_away():
    times = np.linspace(0.0, 0.8, 1601)
    peaks = []
    for anti_windup in (False, True):
        found = run(control(voltage_limit=60.0, anti_windup=anti_windup), step(0.05), times)
        assert float(jnp.max(jnp.abs(found.outputs.voltage))) <= 60.0
        peaks.append(float(jnp.max(found.outputs.position)) / 0.05 - 1)
    assert peaks[1] < 0.2 * peaks[0] and peaks[0] > 0.1
    assert float(found.outputs.position[-1]) == pytest.approx(0.05, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("voltage_limit", [float("inf"), 80.0])
@pytest.mark.parametrize("anti_windup", [False, True])
def test_derivatives(voltage_limit, anti_windup):
    """To the gains, the lead and the limit; at 80 V the step starts in the limit."""

    @jax.jit
    def result(p):
        c = control(
            p[0], p[1], p[2], lead=p[3], feedforward=p[4], voltage_limit=voltage_limit * p[5], anti_windup=anti_windup
        )
        found = run(c, step(5e-3), TIMES[:121])
        return jnp.stack([found.outputs.position[-1] * 1e3, found.states.controller.integral[-1]])

    p = jnp.array([KV, KP, KI, LEAD, 0.9, 1.0])
    exact = np.asarray(jax.jacfwd(result)(p))
    steps = 1e-5 * np.asarray(p)
    rough = np.stack([(result(p + s) - result(p - s)) / (2 * s.sum()) for s in np.diag(steps)], axis=1)
    assert np.all(np.isfinite(exact))
    np.testing.assert_allclose(exact * p, rough * p, rtol=2e-4, atol=1e-6 * np.max(np.abs(exact * p)))
    assert np.any(exact[:, 5] != 0) == np.isfinite(voltage_limit)


@pytest.mark.slow
def test_derivatives_at_awkward_points():
    """No error, exactly at the limit, far beyond it, all gains zero."""
    t, state = jnp.zeros(()), control().initial_state()
    for voltage_limit in (float("inf"), 10.0):
        for wanted in (0.0, 10.0, -10.0, 1e12):

            def command(p):
                c = control(p[0], p[1], p[2], voltage_limit=p[3], anti_windup=True)
                at = MotionPoint(p[4] * jnp.ones(()), jnp.zeros(()), jnp.zeros(()))
                return jnp.stack(
                    [c.command(t, state, at, measured()), c.vector_field(t, state, at, measured()).integral]
                )

            p = jnp.array([KV, KP, KI, voltage_limit, wanted * H / (KP * KV)])
            for jacobian in (jax.jacfwd(command)(p), jax.jacrev(command)(p)):
                assert bool(jnp.all(jnp.isfinite(jacobian))), (voltage_limit, wanted)
    assert float(control(0.0, 0.0, 0.0).command(t, state, MotionPoint(t, t, t), measured(1.0, 1.0))) == 0.0


def test_gain_in_the_unit_of_machine_controllers():
    controller = control(position_gain=to_si(2725, "1/min", "1/s"))
    assert float(controller.position_gain) == pytest.approx(2725 / 60, rel=1e-15)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"position_gain": -1.0}, "position_gain"),
        ({"velocity_gain": float("nan")}, "velocity_gain"),
        ({"integral_gain": float("inf")}, "integral_gain"),
        ({"feedforward": float("nan")}, "feedforward"),
        ({"lead": 0.0}, "lead"),
        ({"lead": float("inf")}, "lead"),
        ({"voltage_limit": 0.0}, "voltage_limit"),
        ({"voltage_limit": float("nan")}, "voltage_limit"),
        ({"feedback": "table"}, '"motor" or "slide"'),
        ({"velocity_gain": 0.0, "anti_windup": True}, "anti_windup"),
    ],
)
def test_bad_input_is_named(fields, message):
    with pytest.raises(InputError, match=message):
        control(**fields)


@pytest.mark.slow
def test_a_bad_sample_of_a_batch_is_marked():
    def last(p):
        found = run(control(velocity_gain=p, anti_windup=True, voltage_limit=100.0), step(1e-3), TIMES[:21])
        return found.outputs.position[-1]

    found = jax.vmap(last)(jnp.array([5.0, jnp.nan, 6.0]))
    assert list(np.isfinite(found)) == [True, False, True]
