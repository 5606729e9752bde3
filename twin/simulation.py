"""From a plant and a reference to a trajectory."""

import sys
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, PyTree

from twin._adaptive import DIVERGED, OUT_OF_STEPS, solve_adaptive
from twin._checks import InputError, increasing, is_concrete, require_x64
from twin._constant import run_sampled_loop, solve_constant
from twin.control.closed_loop import SampledLoop
from twin.plant import AbstractPlant
from twin.references import AbstractReference
from twin.stepping import AbstractStepping, AdaptiveSteps, ConstantSteps
from twin.trajectory import SimulationStatus, Trajectory


def simulate(
    system: AbstractPlant | SampledLoop,
    reference: AbstractReference,
    times: Float[ArrayLike, "times"],
    *,
    initial_state: PyTree[Array] | None = None,
    stepping: AbstractStepping | None = None,
) -> Trajectory:
    """Simulate a plant, a closed loop or a sampled loop.

    Differentiable with respect to every parameter of the system and of the reference, and to the initial state. The
    sensitivity to a parameter that moves a switching time is exact as long as what the reference returns is continuous.

    Args:
        system: a plant, or a plant with its controller.
        reference: function of time that returns the system's inputs (a plant's inputs, a loop's `MotionPoint`).
        times: times at which the trajectory is wanted [s]; for a sampled loop its ticks, one period apart.
        initial_state: state of the plant at `times[0]`; its own `initial_state()` if not given.
        stepping: `AdaptiveSteps` (the default for plants) or `ConstantSteps` (the default and only way for sampled
            loops, whose right-hand side jumps at every tick).

    Returns:
        The trajectory. A run that failed is marked by its status and holds NaN; one that is less accurate than asked
        for is marked and kept.

    Raises:
        InputError: 64-bit mode off, times not increasing or fewer than two, ticks that do not fit the period.
    """
    require_x64()
    times = jnp.asarray(times)
    if times.ndim != 1 or times.shape[0] < 2:
        raise InputError(f"times must be a vector of at least two times [s], but has shape {times.shape}.")
    increasing("times", times, "s")
    _check_reference(system, reference, times)
    if stepping is None:
        stepping = ConstantSteps() if isinstance(system, SampledLoop) else AdaptiveSteps()

    if isinstance(system, SampledLoop):
        if not isinstance(stepping, ConstantSteps):
            raise InputError("A sampled loop is simulated with ConstantSteps: its command jumps at every tick.")
        check_ticks(times, system.period)
        plant_state = system.plant.initial_state() if initial_state is None else initial_state
        states, outputs, estimate = run_sampled_loop(system, reference, plant_state, times, stepping)
        return _trajectory(times, states, outputs, _judge(estimate), estimate)

    state = system.initial_state() if initial_state is None else initial_state
    if isinstance(stepping, ConstantSteps):
        states, estimate = solve_constant(system, reference, state, times, stepping)
        status = _judge(estimate)
    elif isinstance(stepping, AdaptiveSteps):
        states, ending = solve_adaptive(system, reference, state, times, stepping)
        estimate = jnp.asarray(jnp.nan)
        status = SimulationStatus.where(
            ending == OUT_OF_STEPS, SimulationStatus.too_many_steps, SimulationStatus.successful
        )
        status = SimulationStatus.where(ending == DIVERGED, SimulationStatus.not_finite, status)
    else:
        raise InputError(f"stepping must be AdaptiveSteps or ConstantSteps, but is {type(stepping).__name__}.")
    inputs = jax.vmap(reference)(times)
    outputs = jax.vmap(system.outputs)(times, states, inputs)
    return _trajectory(times, states, outputs, status, estimate)


def choose_substeps(
    system: AbstractPlant | SampledLoop,
    reference: AbstractReference,
    times: Float[ArrayLike, "times"],
    *,
    rtol: float = 1e-6,
    atol: float = 1e-9,
    most: int = 256,
) -> ConstantSteps:
    """The smallest power of two of substeps whose trajectory no longer changes when their number is doubled.

    Args:
        system: as in `simulate`; choose at representative parameters.
        reference: as in `simulate`.
        times: as in `simulate` [s].
        rtol: tolerance on the change of each state, relative to its largest magnitude.
        atol: absolute tolerance in each state's unit.
        most: substeps at which to give up.

    Returns:
        The stepping to pass to `simulate`.

    Raises:
        InputError: if even `most` substeps are too coarse.
    """
    coarse = _states(system, reference, times, 1)
    substeps = 1
    while substeps <= most:
        fine = _states(system, reference, times, 2 * substeps)
        if all(_close(a, b, rtol, atol) for a, b in zip(coarse, fine, strict=True)):
            return ConstantSteps(substeps=substeps)
        coarse, substeps = fine, 2 * substeps
    raise InputError(
        f"{most} substeps are not enough for rtol {rtol:g} and atol {atol:g}, or the simulation is unstable. "
        "Loosen the tolerance, widen the smoothing of friction, or use AdaptiveSteps if nothing is sampled."
    )


def _states(system: Any, reference: AbstractReference, times: ArrayLike, substeps: int) -> list[Array]:
    # Any error passes; an infinite tolerance times a state that stays at zero would be NaN.
    stepping = ConstantSteps(substeps=substeps, rtol=sys.float_info.max)
    return jax.tree.leaves(_compiled(system, reference, jnp.asarray(times), stepping).states)


@eqx.filter_jit
def _compiled(system: Any, reference: AbstractReference, times: Array, stepping: ConstantSteps) -> Trajectory:
    return simulate(system, reference, times, stepping=stepping)


def _close(coarse: Array, fine: Array, rtol: float, atol: float) -> bool:
    # NaN compares false: an unstable run is not close to anything.
    return bool(jnp.max(jnp.abs(coarse - fine)) <= atol + rtol * jnp.max(jnp.abs(fine)))


def _check_reference(system: Any, reference: Any, times: Array) -> None:
    if not isinstance(reference, AbstractReference):
        raise InputError(
            f"reference must be a reference, a function of time, but is a {type(reference).__name__}. "
            "Make one of samples by SampledReference(times, positions)."
        )
    wanted = {"position"} if isinstance(system, SampledLoop) else set(system.rest_inputs()._fields)
    given = getattr(jax.eval_shape(reference, times[0]), "_fields", ())
    if not wanted <= set(given):
        raise InputError(
            f"{type(system).__name__} is driven by {', '.join(sorted(wanted))}, but the reference gives "
            f"{', '.join(given) or 'something without names'}. To follow a motion, wrap drive and controller in a "
            "ClosedLoop or SampledLoop; to drive it openly, use SampledSignal with the drive's inputs."
        )


def _judge(estimate: Float[Array, ""]) -> SimulationStatus:
    status = SimulationStatus.where(estimate <= 1.0, SimulationStatus.successful, SimulationStatus.not_accurate)
    return SimulationStatus.where(jnp.isfinite(estimate), status, SimulationStatus.not_finite)


def _trajectory(times, states, outputs, status, estimate) -> Trajectory:
    finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(x)) for x in jax.tree.leaves((states, outputs))]))
    bad = (status != SimulationStatus.too_many_steps) & ~finite
    status = SimulationStatus.where(bad, SimulationStatus.not_finite, status)
    # An inaccurate run is marked but kept: a cliff of NaN in the middle of a fit would stop it there.
    good = (status == SimulationStatus.successful) | (status == SimulationStatus.not_accurate)

    def mask(x: Any) -> Array:
        return jnp.where(good, x, jnp.nan)

    return Trajectory(times, jax.tree.map(mask, states), jax.tree.map(mask, outputs), status, estimate)


def check_ticks(times: Float[Array, "times"], period: Float[Array, ""]) -> None:
    """Raise unless times are the ticks of a sampled controller; `simulate` cannot tell inside a compiled function.

    Args:
        times: times [s].
        period: period of the controller [s].

    Raises:
        InputError: naming the first period that does not fit.
    """
    if not (is_concrete(times) and is_concrete(period)):
        return
    seen = np.asarray(times)
    ticks = seen[0] + np.arange(seen.size) * float(period)
    worst = int(np.argmax(np.abs(seen - ticks)))
    if abs(seen[worst] - ticks[worst]) > 0.01 * float(period):
        raise InputError(
            f"times must be the ticks of the sampled controller, {float(period):g} s apart, but tick {worst} is at "
            f"{seen[worst]:g} s instead of {ticks[worst]:g} s. Simulate at the ticks and pick samples afterwards."
        )
