"""What the tests of the rack-and-pinion drive share: a motion with every part settable, the bench and its cascade."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import as_scalar
from twin.control import CascadeGains
from twin.drives.leipe import leipe_drive
from twin.references import AbstractReference, MotionPoint
from twin.simulation import simulate


class Motion(AbstractReference):
    """Constant velocity v, on it the cosine a·(1 - cos(2πft))."""

    start: Float[Array, ""]
    velocity: Float[Array, ""]
    amplitude: Float[Array, ""]
    frequency: Float[Array, ""]

    def __init__(self, start=0.0, velocity=0.0, amplitude=0.0, frequency=5.0):
        self.start, self.velocity = as_scalar(start), as_scalar(velocity)
        self.amplitude, self.frequency = as_scalar(amplitude), as_scalar(frequency)

    def __call__(self, t):
        omega, a = 2 * jnp.pi * self.frequency, self.amplitude
        return MotionPoint(
            self.start + self.velocity * t + a * (1 - jnp.cos(omega * t)),
            self.velocity + a * omega * jnp.sin(omega * t),
            a * omega**2 * jnp.cos(omega * t),
        )

    def switching_times(self):
        return jnp.zeros(0)


def gains(**changes):
    """A cascade for the bench of Leipe et al., of moderate gains."""
    fields = {
        "position_gain": 30.0,
        "velocity_gain": 340.0,
        "reset_time": 0.02,
        "preload_gain": 1e-3,
        "preload": 2.5,
        "rated_torque": 12.5,
        "torque_limit": 25.0,
    }
    return CascadeGains(**{**fields, **changes})


def both(drive, function, *values):
    """A drive with the leaves that a function of a drive train picks replaced, in both drive trains."""
    for train in (lambda d: d.train_1, lambda d: d.train_2):
        drive = eqx.tree_at(lambda d, train=train: function(train(d)), drive, tuple(map(as_scalar, values)))
    return drive


def mixed_drive():
    """Drive train 1 with its mesh in the tangent reading, drive train 2 in the secant reading."""
    return eqx.tree_at(lambda d: d.train_2, leipe_drive("tangent"), leipe_drive("secant").train_2)


def negative(tree):
    """Every array of a tree with its sign turned."""
    return jax.tree.map(jnp.negative, tree)


def firm(tree):
    """Arrays that are not weakly typed: a weak one would compile the same simulation anew."""
    return jax.tree.map(lambda x: jnp.asarray(x, dtype=x.dtype) if eqx.is_inexact_array(x) else x, tree)


def run(system, reference, times, initial_state, stepping):
    """A simulation, compiled once for each kind of system."""
    return _run(*firm((system, reference, jnp.asarray(times), initial_state)), stepping)


@eqx.filter_jit
def _run(system, reference, times, initial_state, stepping):
    return simulate(system, reference, times, initial_state=initial_state, stepping=stepping)
