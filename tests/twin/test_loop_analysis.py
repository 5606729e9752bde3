"""Closed loops of screw axes in the frequency domain: closed forms, a simulated sine, margins, stability."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from reference_systems import ContinuousCascade, two_mass, viscous_axis

from twin._checks import InputError
from twin.control import (
    ClosedLoop,
    FrictionSlope,
    PositionVelocityPI,
    check_stability,
    closed_loop_poles,
    closed_loop_response,
    open_loop_response,
    require_stable,
)
from twin.drives import DcMotor, RigidScrewAxis, mauro_axis
from twin.laws import LuGreFriction, ViscousFriction
from twin.linear import frequency_response
from twin.performance import stability_margin
from twin.references import AbstractReference, MotionPoint
from twin.simulation import simulate
from twin.stepping import ConstantSteps

LEAD, J, B = 0.02, 0.0105, 0.01
H = LEAD / (2 * np.pi)
R, L, KE, KT = 0.35, 4e-3, 1.5, 1.4
RIGID = RigidScrewAxis(DcMotor(R, L, KE, KT), J, LEAD, ViscousFriction(B))
KV, KP, KI, KFF = 45.4, 5.0, 250.0, 0.8
F = np.geomspace(0.1, 300.0, 60)
S = 2j * np.pi * F
SPEED = 20.0


def control(position_gain=KV, velocity_gain=KP, integral_gain=KI, **fields):
    return PositionVelocityPI(position_gain, velocity_gain, integral_gain, LEAD, feedforward=KFF, **fields)


LOOP = ClosedLoop(RIGID, control())
AXIS = mauro_axis()
ELASTIC = ClosedLoop(AXIS, control())


def rigid_parts():
    """Velocity controller times motor, θ̇/e."""
    motor = KT / ((L * S + R) * (J * S + B) + KT * KE)
    return (KP + KI / S) * motor


def test_response_is_the_closed_form():
    forward = rigid_parts() / S
    exact = forward * (KV + KFF * S) / (1 + forward * (KV + S))
    found = closed_loop_response(LOOP, F)
    assert found.outputs == ("position",) and found.inputs == ("reference",)
    np.testing.assert_allclose(found.values[0, 0], exact, rtol=1e-9)
    speed = closed_loop_response(LOOP, F, output="motor_speed").values[0, 0]
    np.testing.assert_allclose(speed, exact * S / H, rtol=1e-9)
    volts = closed_loop_response(LOOP, F, output="voltage").values[0, 0]
    np.testing.assert_allclose(volts, (KP + KI / S) * (KV + KFF * S - exact * (KV + S)) / H, rtol=1e-8)


def test_opened_loops_are_the_closed_forms():
    velocity = rigid_parts()
    for at, exact in (
        ("command", velocity * (1 + KV / S)),
        ("motor_angle", KV / S * velocity / (1 + velocity)),
        ("motor_speed", velocity / (1 + velocity * KV / S)),
    ):
        np.testing.assert_allclose(open_loop_response(LOOP, F, at=at)[at, at], exact, rtol=1e-8)
    scale = ClosedLoop(RIGID, control(feedback="slide"))
    np.testing.assert_allclose(
        open_loop_response(scale, F, at="position").values,
        open_loop_response(LOOP, F, at="motor_angle").values,
        rtol=1e-8,
    )


def test_poles_are_the_roots_of_the_polynomial():
    motor = np.polymul([L, R], [J, B]) + np.array([0, 0, KT * KE])
    polynomial = np.polyadd(np.polymul([1, 0, 0], motor), KT * np.polymul([KP, KI], [1, KV]))
    exact = np.roots(polynomial)
    exact = exact[np.argsort(np.abs(exact))]
    found = closed_loop_poles(LOOP)
    np.testing.assert_allclose(np.sort_complex(found.poles), np.sort_complex(exact), rtol=1e-9)
    np.testing.assert_allclose(found.frequency, np.abs(exact) / (2 * np.pi), rtol=1e-9)
    np.testing.assert_allclose(found.damping_ratio, -exact.real / np.abs(exact), rtol=1e-8)


class Sine(AbstractReference):
    """Position A·sin(ωt) with its derivatives."""

    amplitude: float
    omega: float

    def __call__(self, t):
        at = self.amplitude * jnp.sin(self.omega * t)
        return MotionPoint(at, self.amplitude * self.omega * jnp.cos(self.omega * t), -(self.omega**2) * at)

    def switching_times(self):
        return jnp.zeros(0)


@pytest.mark.parametrize("frequency", [4.0, 40.0])
def test_a_simulated_sine_has_the_response(frequency):
    times = np.linspace(0.0, 1.0, 2001)
    stepping = ConstantSteps(4, solver=diffrax.Tsit5())
    run = simulate(LOOP, Sine(1e-5, 2 * np.pi * frequency), times, stepping=stepping)
    last = times >= 0.75
    wave = np.exp(-2j * np.pi * frequency * times[last][:-1])
    # The phasor of sin(ωt) is -j.
    ratio = 2 * np.mean(np.asarray(run.outputs.position)[last][:-1] * wave) / (-1j * 1e-5)
    assert ratio == pytest.approx(complex(closed_loop_response(LOOP, np.array([frequency])).values[0, 0, 0]), rel=2e-4)


def test_the_elastic_axis_is_the_mechanics_behind_the_motor():
    """Built from M, B and K of eq. 18, the motor's electrics and the controller, without the state space."""
    mechanics = frequency_response(AXIS.second_order(friction_speed=SPEED), F, inputs=("torque",))
    motor, slide = (mechanics[name, "torque"] for name in ("motor_angle", "position"))
    electric = AXIS.motor
    torque = 1 / (
        (electric.inductance * S + electric.resistance) / electric.torque_constant + electric.back_emf * S * motor
    )
    for feedback, fed in (("motor", H * motor), ("slide", slide)):
        gain = (KP + KI / S) * torque
        exact = gain * slide * (KV + KFF * S) / H / (1 + gain * (KV * fed / H + S * motor))
        loop = ClosedLoop(AXIS, control(feedback=feedback))
        found = closed_loop_response(loop, F, friction_speed=SPEED)
        np.testing.assert_allclose(found.values[0, 0], exact, rtol=1e-6)


def test_far_below_the_first_mode_the_elastic_axis_is_the_rigid_one():
    rigid = ClosedLoop(AXIS.rigid(), control())
    f = np.array([0.1, 0.3, 1.0, 3.0])
    found, exact = (closed_loop_response(loop, f, friction_speed=SPEED).values[0, 0] for loop in (ELASTIC, rigid))
    assert np.all(np.abs(found / exact - 1) < 2e-3 * np.array([0.01, 0.1, 1.0, 10.0]))
    assert complex(found[0]) == pytest.approx(1 - S[0] * (1 - KFF) / KV, rel=1e-4)


@pytest.mark.slow
def test_the_gain_margin_of_the_position_loop_is_where_it_becomes_unstable():
    f = np.linspace(40.0, 110.0, 701)
    opened = open_loop_response(ELASTIC, f, at="motor_angle", friction_speed=SPEED)
    margin = float(stability_margin(opened).gain_margin)
    assert 1.2 < margin < 2.0

    @jax.jit
    def growth(factor):
        loop = ClosedLoop(AXIS, control(KV * margin * factor))
        return jnp.max(jnp.real(closed_loop_poles(loop, friction_speed=SPEED).poles))

    assert growth(0.99) < 0 < growth(1.01)


def test_an_unstable_gain_is_named():
    loop = ClosedLoop(AXIS, control(150.0))
    report = check_stability(loop, friction_speed=SPEED)
    (pole,) = report.unstable_poles
    assert not report.stable and pole.real > 0
    assert f"{abs(pole) / 2 / np.pi:.3g} Hz" in report.message and "lower position_gain" in report.message
    assert f"damping ratio {-pole.real / abs(pole):.3g}" in report.message
    with pytest.raises(InputError, match=r"unstable.*Hz.*lower position_gain"):
        require_stable(loop, friction_speed=SPEED)
    wound = check_stability(ClosedLoop(AXIS, control(integral_gain=2500.0)), friction_speed=SPEED)
    assert "lower integral_gain" in wound.message
    assert require_stable(ELASTIC, friction_speed=SPEED).unstable_poles.size == 0


def test_poles_at_zero_count_only_if_the_position_is_free():
    still = check_stability(ClosedLoop(RIGID, control(integral_gain=0.0)))
    assert still.stable and still.poles[0] == 0
    free = check_stability(ClosedLoop(RIGID, control(0.0)))
    assert not free.stable and free.unstable_poles.tolist() == [0] and "not controlled" in free.message
    assert not check_stability(ClosedLoop(AXIS, control(0.0, 0.0, 0.0)), friction_speed=SPEED).stable


def test_derivatives():
    def everything(p):
        loop = ClosedLoop(AXIS, control(*p))
        g = closed_loop_response(loop, np.array([5.0, 70.0]), friction_speed=SPEED).values[0, 0]
        opened = open_loop_response(loop, np.array([5.0, 70.0]), friction_speed=SPEED).values[0, 0]
        poles = closed_loop_poles(loop, friction_speed=SPEED)
        return jnp.concatenate([g.real, g.imag, opened.real, opened.imag, poles.damping_ratio[:4], poles.frequency[:4]])

    everything = jax.jit(everything)
    p = jnp.array([KV, KP, KI])
    exact = np.asarray(jax.jacfwd(everything)(p)) * p
    rough = [(everything(p * (1 + 1e-5 * e)) - everything(p * (1 - 1e-5 * e))) / 2e-5 for e in np.eye(3)]
    np.testing.assert_allclose(exact, np.stack(rough, axis=1), rtol=1e-5, atol=1e-7)


def test_derivatives_where_a_pole_is_zero():
    def sizes(ki):
        poles = closed_loop_poles(ClosedLoop(RIGID, control(integral_gain=ki)))
        return jnp.concatenate([poles.frequency, poles.damping_ratio])

    assert bool(jnp.all(jnp.isfinite(jax.jacfwd(sizes)(jnp.zeros(())))))


def test_other_plants_and_controllers():
    loop = ClosedLoop(viscous_axis(), ContinuousCascade(20.0, 3e3, 0.0))
    s = 2j * np.pi * 3.0
    exact = 3e3 * (20.0 + s) / (100 * s**2 + 200 * s + 3e3 * (20.0 + s))
    assert complex(closed_loop_response(loop, np.array([3.0])).values[0, 0, 0]) == pytest.approx(exact, rel=1e-12)
    assert check_stability(loop).stable
    assert "lower" in check_stability(ClosedLoop(viscous_axis(), ContinuousCascade(20.0, 3e3, 1e9))).message


def test_the_operating_point_must_be_stated():
    with pytest.raises(InputError, match=r"StribeckFriction.*friction_speed"):
        closed_loop_response(ELASTIC, F)
    for analysis in (closed_loop_poles, check_stability):
        with pytest.raises(InputError, match="friction_speed"):
            analysis(ELASTIC)
    # At rest the sharp friction blocks: its slope there damps what is unstable in motion.
    fast = ClosedLoop(AXIS, control(150.0))
    assert check_stability(fast, state=fast.initial_state()).stable
    falling = eqx.tree_at(lambda loop: loop.plant.friction, LOOP, FrictionSlope(-0.2))
    assert float(falling.plant.friction(2.0)) == -0.4


def test_bad_input_is_named():
    lugre = LuGreFriction(1.0, 1.5, 0.1, 1e5, 300.0, 0.01, 0.01)
    cases = [
        (lambda: closed_loop_response(LOOP, F, output="slip"), "no output 'slip'"),
        (lambda: closed_loop_response(LOOP, 3.0), "vector"),
        (lambda: open_loop_response(LOOP, F, at="slip"), "no output 'slip'"),
        (lambda: open_loop_response(LOOP, F, at="position"), "does not feed back 'position'"),
        (lambda: closed_loop_poles(ClosedLoop(two_mass(), control()), friction_speed=1.0), "2 friction laws"),
        (
            lambda: closed_loop_poles(eqx.tree_at(lambda x: x.plant.friction, LOOP, lugre), friction_speed=1.0),
            "with memory",
        ),
        (lambda: check_stability(eqx.tree_at(lambda x: x.plant.inertia, LOOP, jnp.asarray(jnp.nan))), "not finite"),
    ]
    for call, message in cases:
        with pytest.raises(InputError, match=message):
            call()
