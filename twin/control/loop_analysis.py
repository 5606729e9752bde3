"""Closed loops in the frequency domain: response to the reference, opened loop, poles."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Complex, Float, PyTree

from twin._checks import InputError, is_concrete, require_x64
from twin.control.closed_loop import ClosedLoop, ClosedLoopState
from twin.control.friction_at_speed import at_operating_point
from twin.frf import FRF
from twin.linear import StateSpace, frequency_response, linearise
from twin.plant import AbstractPlant
from twin.references import MotionPoint

# A pole within this share of the fastest one is zero but for rounding.
_ZERO = 1e-10


class ClosedLoopPoles(NamedTuple):
    """Poles of a closed loop, ascending in |s|; of a conjugate pair both."""

    poles: Complex[Array, "poles"]
    """Poles s [1/s]; exactly zero where they are so but for rounding."""
    frequency: Float[Array, "poles"]
    """|s|/2π [Hz]."""
    damping_ratio: Float[Array, "poles"]
    """-Re(s)/|s| [-]; zero for a pole at zero."""


def closed_loop_response(
    loop: ClosedLoop,
    frequency: Float[ArrayLike, "..."],
    *,
    output: str = "position",
    friction_speed: Float[ArrayLike, ""] | None = None,
    state: ClosedLoopState | None = None,
    reference: MotionPoint | None = None,
) -> FRF:
    """Response of a closed loop to its position reference, the feed-forward counted; differentiable.

    The set velocity is the derivative of the set position and the set acceleration that of the set velocity, as in any
    reference: G = G_position + jω·G_velocity + (jω)²·G_acceleration, each as far as the controller uses it.

    Args:
        loop: plant and controller.
        frequency: frequencies [Hz], a vector.
        output: output of the plant that responds; the position for the usual picture.
        friction_speed: operating speed at which the friction is taken for a straight line [rad/s for a screw, m/s for a
            linear law]; needed, or else the state, where friction is curved.
        state: operating point; friction has the slope that it has there, and one that is sharp blocks an axis at rest.
            `initial_state()`, at rest in the middle, if not given.
        reference: operating reference, which keeps the state; at zero if not given.

    Returns:
        The response to "reference" [output unit per m or rad of set position].

    Raises:
        InputError: 64-bit mode off, frequencies not a vector, an unknown output, a curved friction without an operating
            point, several friction laws or one with memory together with `friction_speed`.

    Source: Mauro, Pastorelli, Mohtar (2014), Fig. 7.
    """
    system = _linear(loop, (output,), friction_speed, state, reference)
    each = _frequency_response(system, frequency)
    s = 2j * jnp.pi * each.frequency
    parts = dict(zip(each.inputs, each.values[0], strict=True))
    values = parts["position"] + s * (parts["velocity"] + s * parts["acceleration"])
    return FRF(each.frequency, values[None, None], (output,), ("reference",))


def open_loop_response(
    loop: ClosedLoop,
    frequency: Float[ArrayLike, "..."],
    *,
    at: str = "command",
    friction_speed: Float[ArrayLike, ""] | None = None,
    state: ClosedLoopState | None = None,
    reference: MotionPoint | None = None,
) -> FRF:
    """Response of the loop opened at one signal, the others closed, for `twin.performance.stability_margin`.

    With negative feedback the closed loop is 1/(1 + G). Opened at the command, G holds position and velocity control
    together. Opened at the measured position it is the position loop around the closed velocity loop, opened at the
    motor's speed the velocity loop within the position loop.

    Args:
        loop: plant and controller.
        frequency: frequencies [Hz], a vector.
        at: "command" for what the actuator is told (the motor's voltage), or a measured signal that the controller
            feeds back: with `PositionVelocityPI` "motor_angle" or "position", as its `feedback` says, or "motor_speed".
        friction_speed: as in `closed_loop_response`.
        state: as in `closed_loop_response`.
        reference: as in `closed_loop_response`.

    Returns:
        G, from and to the signal [-].

    Raises:
        InputError: as `closed_loop_response`; several commands, a signal that the controller does not feed back.
    """
    loop = at_operating_point(loop, friction_speed, state)
    held = loop.rest_inputs() if reference is None else reference
    start = loop.initial_state() if state is None else state
    if at == "command" and len(jax.tree.leaves(loop.plant.rest_inputs().command)) > 1:
        raise InputError(
            "The controller gives several commands, and the loop can be opened at one signal only. Name a measured one."
        )
    opened = _OpenedLoop(loop, at, held, start)
    system = compiled_linearise(opened, start, opened.operating_inputs(), ("signal",))
    if is_concrete(system.b) and not (jnp.any(system.b) or jnp.any(system.d)):
        raise InputError(
            f"The controller does not feed back {at!r}: there is no loop to open. Name a signal that it uses; with "
            'PositionVelocityPI its `feedback` says whether that is "motor_angle" or "position".'
        )
    through = _frequency_response(system, frequency)
    return FRF(through.frequency, -through.values, (at,), (at,))


def closed_loop_poles(
    loop: ClosedLoop,
    *,
    friction_speed: Float[ArrayLike, ""] | None = None,
    state: ClosedLoopState | None = None,
    reference: MotionPoint | None = None,
) -> ClosedLoopPoles:
    """Poles of a closed loop near an operating point; differentiable where they are distinct.

    Args:
        loop: plant and controller.
        friction_speed: as in `closed_loop_response`.
        state: as in `closed_loop_response`.
        reference: as in `closed_loop_response`.

    Raises:
        InputError: as `closed_loop_response`.
    """
    return poles_of(_linear(loop, (), friction_speed, state, reference))


def poles_of(system: StateSpace) -> ClosedLoopPoles:
    """Poles of a linear system.

    Args:
        system: linear system.
    """
    require_x64()
    poles = jnp.linalg.eigvals(system.a)
    poles = poles[jnp.argsort(jnp.abs(jax.lax.stop_gradient(poles)))]
    size = jnp.abs(jax.lax.stop_gradient(poles))
    zero = size <= _ZERO * jnp.max(size)
    size = jnp.where(zero, 0.0, jnp.abs(jnp.where(zero, 1.0, poles)))
    ratio = jnp.where(zero, 0.0, -jnp.real(poles) / jnp.where(zero, 1.0, size))
    return ClosedLoopPoles(jnp.where(zero, 0.0, poles), size / (2 * jnp.pi), ratio)


def _linear(
    loop: ClosedLoop,
    outputs: tuple[str, ...],
    friction_speed: ArrayLike | None,
    state: ClosedLoopState | None,
    reference: MotionPoint | None,
) -> StateSpace:
    loop = at_operating_point(loop, friction_speed, state)
    return compiled_linearise(loop, state, reference, outputs or loop_outputs(loop)[:1])


@eqx.filter_jit
def compiled_linearise(plant: AbstractPlant, state: Any, inputs: Any, outputs: tuple[str, ...]) -> StateSpace:
    """As `linearise`; in one piece, as its many small operations would each be compiled alone.

    Args:
        plant: plant or loop.
        state: operating point.
        inputs: operating inputs.
        outputs: names of the outputs to keep.
    """
    return linearise(plant, state, inputs, outputs=outputs)


_frequency_response = eqx.filter_jit(frequency_response)


def loop_outputs(loop: ClosedLoop) -> tuple[str, ...]:
    """Names of what the plant of a loop records.

    Args:
        loop: plant and controller.
    """
    return loop.plant.outputs(jnp.zeros(()), loop.plant.initial_state(), loop.plant.rest_inputs())._fields


class _Signal(NamedTuple):
    signal: Any


class _OpenedLoop(AbstractPlant):
    """The loop with one signal cut: its input is what continues, its output what arrives."""

    loop: ClosedLoop
    at: str
    held: MotionPoint
    start: ClosedLoopState

    def initial_state(self) -> ClosedLoopState:
        return self.start

    def rest_inputs(self) -> _Signal:
        return _Signal(jnp.zeros(()))

    def operating_inputs(self) -> _Signal:
        return _Signal(self._run(jnp.zeros(()), self.start, None)[0])

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> PyTree[Array]:
        return self._run(t, state, inputs.signal)[1]

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> _Signal:
        return _Signal(self._run(t, state, inputs.signal)[0])

    def _run(self, t: Array, state: Any, signal: Array | None) -> tuple[Array, ClosedLoopState]:
        """The signal that arrives at the cut, and the state's rate."""
        plant, controller = self.loop.plant, self.loop.controller
        measured = plant.outputs(t, state.plant, plant.rest_inputs())
        if self.at != "command" and self.at not in measured._fields:
            raise InputError(f"The plant has no output {self.at!r}; open at command, {', '.join(measured._fields)}.")
        arriving = None if self.at == "command" else getattr(measured, self.at)
        if arriving is not None and signal is not None:
            measured = measured._replace(**{self.at: signal})
        command = controller.command(t, state.controller, self.held, measured)
        told = command
        if arriving is None:
            arriving = jax.tree.leaves(command)[0]
            if signal is not None:
                told = jax.tree.unflatten(jax.tree.structure(command), [signal])
        inputs = plant.rest_inputs()._replace(command=told)
        rate = ClosedLoopState(
            plant.vector_field(t, state.plant, inputs),
            controller.vector_field(t, state.controller, self.held, measured),
        )
        return arriving, rate
