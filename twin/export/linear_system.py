"""Linear systems of the twin as those of python-control and SciPy, and back."""

from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from twin._checks import InputError, require_x64
from twin.export._library import library
from twin.frf import FRF
from twin.linear import SecondOrder, StateSpace

if TYPE_CHECKING:
    import control
    import scipy.signal


def to_control(
    system: StateSpace | SecondOrder | FRF,
    *,
    states: tuple[str, ...] | None = None,
    pade_order: int | None = None,
) -> "control.StateSpace | control.FrequencyResponseData":
    """A linear system for python-control, its inputs and outputs named as the twin's.

    python-control allows no dots in names: "command.motor_1" becomes "command_motor_1".

    Args:
        system: a state space, a second-order system, or a frequency response.
        states: names of the states, those of `twin.export.state_names`; "x[0]", "x[1]", ... if not given. A
            second-order system has its degrees of freedom first and their rates behind.
        pade_order: order of the Padé approximation that stands for a dead time, which a state space cannot hold.

    Returns:
        A `control.StateSpace` in continuous time, or of a frequency response a `control.FrequencyResponseData` over the
        angular frequency [rad/s].

    Raises:
        InputError: python-control is not installed, 64-bit mode off, hysteretic damping, a dead time without
            `pade_order` or below zero, names that do not suit the states, another kind of system.
    """
    require_x64()
    ct: Any = library("control", "control")
    if isinstance(system, FRF):
        omega = 2 * np.pi * np.asarray(system.frequency)
        return ct.FrequencyResponseData(
            np.asarray(system.values), omega, inputs=_plain(system.inputs), outputs=_plain(system.outputs)
        )
    matrices = _matrices(system)
    names = None if states is None else _plain(states)
    if names is not None and len(names) != matrices[0].shape[0]:
        raise InputError(
            f"states gives {len(names)} names, but the system has {matrices[0].shape[0]} states. Give one name for "
            "each, or none."
        )
    linear = ct.StateSpace(*matrices, inputs=_plain(system.inputs), outputs=_plain(system.outputs), states=names)
    delay = float(system.delay) if isinstance(system, StateSpace) else 0.0
    return linear if delay == 0 else _behind_dead_time(ct, linear, delay, pade_order)


def to_scipy(system: StateSpace | SecondOrder) -> "scipy.signal.StateSpace":
    """A linear system for SciPy, which knows no names.

    Args:
        system: a state space without dead time, or a second-order system without hysteretic damping.

    Returns:
        A `scipy.signal.StateSpace` in continuous time (`StateSpaceContinuous`).

    Raises:
        InputError: 64-bit mode off, hysteretic damping, a dead time, another kind of system.
    """
    require_x64()
    import scipy.signal  # half a second to import

    matrices = _matrices(system)
    if isinstance(system, StateSpace) and float(system.delay) != 0:
        raise InputError(
            f"The system has a dead time of {float(system.delay):g} s, which SciPy's state space cannot hold. Set "
            "delay to zero, or use to_control with pade_order."
        )
    return scipy.signal.StateSpace(*matrices)


def from_control(system: Any) -> StateSpace | FRF:
    """A linear system of python-control as the twin's.

    Args:
        system: a `control.StateSpace` in continuous time, or a `control.FrequencyResponseData`.

    Returns:
        A `StateSpace` without dead time, or an `FRF` of the form "ratio".

    Raises:
        InputError: python-control is not installed, 64-bit mode off, a system in discrete time or of another kind.
    """
    require_x64()
    ct: Any = library("control", "control")
    if isinstance(system, ct.FrequencyResponseData):
        order = np.argsort(system.omega)
        frequency = jnp.asarray(system.omega[order] / (2 * np.pi))
        values = jnp.asarray(system.frdata[..., order], dtype=complex)
        return FRF(frequency, values, tuple(system.output_labels), tuple(system.input_labels))
    if not isinstance(system, ct.StateSpace):
        raise InputError(
            f"system must be a control.StateSpace or control.FrequencyResponseData, but is a {type(system).__name__}. "
            "Convert it by control.ss."
        )
    if not system.isctime():
        raise InputError(
            f"The system is in discrete time (dt = {system.dt}), but the twin's state space is continuous. Give the "
            "continuous system."
        )
    a, b, c, d = (jnp.asarray(matrix) for matrix in (system.A, system.B, system.C, system.D))
    return StateSpace(a, b, c, d, tuple(system.input_labels), tuple(system.output_labels))


def _matrices(system: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    if isinstance(system, StateSpace):
        a, b, c, d = (np.asarray(matrix) for matrix in (system.a, system.b, system.c, system.d))
        return a, b, c, d
    if not isinstance(system, SecondOrder):
        raise InputError(
            f"system must be a StateSpace, a SecondOrder or an FRF, but is a {type(system).__name__}. Linearise a "
            "plant by twin.linear.linearise first."
        )
    if np.any(np.asarray(system.hysteretic)):
        raise InputError(
            "The system has hysteretic damping, which no state space with real numbers can hold. Convert its frequency "
            "response instead: to_control(frequency_response(system, frequency))."
        )
    mass, viscous, stiffness = (np.asarray(m) for m in (system.mass, system.viscous, system.stiffness))
    inputs, outputs = np.asarray(system.input_map), np.asarray(system.output_map)
    size = mass.shape[0]
    lower = -np.linalg.solve(mass, np.hstack([stiffness, viscous]))
    a = np.vstack([np.hstack([np.zeros((size, size)), np.eye(size)]), lower])
    b = np.vstack([np.zeros_like(inputs), np.linalg.solve(mass, inputs)])
    c = np.hstack([outputs, np.zeros_like(outputs)])
    return a, b, c, np.zeros((outputs.shape[0], inputs.shape[1]))


def _plain(names: tuple[str, ...]) -> list[str]:
    return [name.replace(".", "_") for name in names]


def _behind_dead_time(ct: Any, linear: Any, delay: float, order: int | None) -> Any:
    if delay < 0 or order is None or order < 1:
        raise InputError(
            f"The system has a dead time of {delay:g} s, which a state space cannot hold. Give pade_order (3 will "
            "often do) if it is positive, or convert the frequency response: to_control(frequency_response(system, f))."
        )
    one = ct.ss(ct.tf(*ct.pade(delay, order)))
    late = ct.append(*[one] * linear.ninputs)
    late.set_inputs(linear.input_labels)
    both = linear * late
    both.set_inputs(linear.input_labels)
    both.set_outputs(linear.output_labels)
    return both
