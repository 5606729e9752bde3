"""The systems that tests of compiled exports write: with reference, times, inputs by name, and stepping."""

import jax
import jax.numpy as jnp
import numpy as np
from rack_pinion_systems import gains
from reference_systems import two_mass

from twin.control import SampledLoop, SampledPositionVelocity, SampledPreloadCascade
from twin.drives import DriveInputs, RackPinionInputs, ServoAxis, TorquePair, leipe_drive, mauro_axis
from twin.laws import LuGreFriction
from twin.references import AbstractReference, MotionPoint, SampledSignal
from twin.stepping import ConstantSteps


class Ticks(AbstractReference):
    """A motion given at the ticks."""

    signal: SampledSignal

    def __init__(self, times, values):
        self.signal = SampledSignal(times, MotionPoint(*map(jnp.asarray, values)), interpolation="hold")

    def __call__(self, t):
        return self.signal(t)

    def switching_times(self):
        return self.signal.switching_times()


def held(times, inputs):
    """Inputs held over each period."""
    return SampledSignal(times, inputs, interpolation="hold")


def motion(times, length=0.02, frequency=4.0):
    omega = 2 * np.pi * frequency
    return (
        length * (1 - np.cos(omega * times)),
        length * omega * np.sin(omega * times),
        length * omega**2 * np.cos(omega * times),
    )


def wave(times, amplitude, frequency, bias=0.0):
    return bias + amplitude * np.sin(2 * np.pi * frequency * times)


def servo_loop():
    friction = LuGreFriction(20.0, 30.0, 0.01, 2e5, 300.0, 60.0, 1e-4)
    axis = ServoAxis(mass=95.0, friction=friction, gain=35.0, initial_position=0.1)
    return SampledLoop(axis, SampledPositionVelocity(160.0, 240.0, 8.0), period=1e-3, command_limit=6.0)


def preload_loop():
    return SampledLoop(leipe_drive(), SampledPreloadCascade(gains(), position_every=2, delayed=True), period=2.5e-4)


def plant_case(plant, period, inputs, names, substeps=4, ticks=200):
    """An openly driven plant: its reference, and the inputs of its FMU."""
    times = np.arange(ticks) * period
    values = inputs(times)
    reference = held(jnp.asarray(times), values)
    return (
        plant,
        reference,
        times,
        {f"input.{n}": np.asarray(v) for n, v in names(values).items()},
        ConstantSteps(substeps),
    )


def drive_names(values):
    return {"command": values.command, "load": values.load}


def two_mass_case():
    def inputs(t):
        return DriveInputs(jnp.asarray(wave(t, 2.0, 7.0)), jnp.asarray(wave(t, 0.1, 3.0, 0.05)))

    return plant_case(two_mass(), 1e-3, inputs, drive_names)


def ball_screw_case():
    def inputs(t):
        return DriveInputs(jnp.asarray(wave(t, 20.0, 15.0)), jnp.asarray(wave(t, 50.0, 8.0, 30.0)))

    return plant_case(mauro_axis(), 1e-4, inputs, drive_names, substeps=8)


def rack_pinion_case():
    def inputs(t):
        pair = TorquePair(jnp.asarray(wave(t, 8.0, 12.0, 1.0)), jnp.asarray(wave(t, 8.0, 9.0, -1.0)))
        return RackPinionInputs(pair, jnp.asarray(wave(t, 200.0, 5.0)))

    def names(v):
        return {"command.motor_1": v.command.motor_1, "command.motor_2": v.command.motor_2, "load": v.load}

    return plant_case(leipe_drive(), 2e-4, inputs, names)


def loop_case(loop, length):
    period = float(loop.period)
    times = np.arange(400) * period
    values = motion(times, length)
    names = ("reference.position", "reference.velocity", "reference.acceleration")
    return loop, Ticks(jnp.asarray(times), values), times, dict(zip(names, values, strict=True)), ConstantSteps(4)


CASES = {
    "two_mass": two_mass_case,
    "ball_screw": ball_screw_case,
    "rack_pinion": rack_pinion_case,
    "servo_loop": lambda: loop_case(servo_loop(), 0.02),
    "preload_loop": lambda: loop_case(preload_loop(), 0.01),
}


def worst(rows, outputs):
    """Largest error of each output, relative to its largest magnitude."""
    expected = np.stack([np.asarray(x) for x in jax.tree.leaves(outputs)], axis=1)
    peak = np.max(np.abs(expected), axis=0)
    return float(np.max(np.abs(rows - expected) / np.where(peak == 0, 1.0, peak)))
