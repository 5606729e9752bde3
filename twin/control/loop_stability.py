"""Whether a closed loop is stable, and if not, which pole says so and which gain to change."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Complex, Float

from twin._checks import InputError
from twin.control.closed_loop import ClosedLoop, ClosedLoopState
from twin.control.friction_at_speed import at_operating_point
from twin.control.loop_analysis import compiled_linearise, loop_outputs, poles_of
from twin.linear import StateSpace
from twin.references import MotionPoint

# A growth slower than this share of the fastest pole is rounding.
_STILL = 1e-10


class StabilityReport(eqx.Module):
    """Whether a closed loop is stable near an operating point."""

    stable: bool = eqx.field(static=True)
    """Whether every motion dies out. Poles at zero do not count as long as the position is controlled."""
    poles: Complex[np.ndarray, "poles"]
    """All poles, ascending in |s| [1/s]."""
    unstable_poles: Complex[np.ndarray, "unstable"]
    """Poles that grow, Im(s) >= 0, the fastest growing first [1/s]; zeros where the position is not controlled."""
    message: str = eqx.field(static=True)
    """One sentence: the worst pole and what to do."""


def check_stability(
    loop: ClosedLoop,
    *,
    friction_speed: Float[ArrayLike, ""] | None = None,
    state: ClosedLoopState | None = None,
    reference: MotionPoint | None = None,
) -> StabilityReport:
    """Judge a closed loop by its poles.

    The sentence names the gain that moves the worst pole most: the largest share of d Re(s) over d ln(gain).

    Args:
        loop: plant and controller with known values, not traced; in a batch use `closed_loop_poles`.
        friction_speed: as in `closed_loop_response`.
        state: as in `closed_loop_response`.
        reference: as in `closed_loop_response`.

    Raises:
        InputError: 64-bit mode off, values that are not finite, a curved friction without an operating point, several
            friction laws or one with memory together with `friction_speed`.
    """
    loop = at_operating_point(loop, friction_speed, state)
    system = _system(loop, state, reference)
    if not np.all(np.isfinite(np.asarray(system.a))):
        raise InputError(
            "The linearised loop is not finite, so that it has no poles. Check the parameters, and that the operating "
            "point lies within the travel."
        )
    poles = np.asarray(poles_of(system).poles)
    controlled = bool(np.any(np.asarray(system.b)[:, system.inputs.index("position")] != 0))
    growing = poles[(np.real(poles) > _STILL * np.max(np.abs(poles))) & (np.imag(poles) >= 0)]
    growing = growing[np.argsort(-np.real(growing))]
    if growing.size:
        return StabilityReport(False, poles, growing, _sentence(growing, loop, system, state, reference))
    drifting = poles[poles == 0]
    if drifting.size and not controlled:
        return StabilityReport(
            False,
            poles,
            drifting,
            "The position is not controlled, it stays wherever it is pushed (a pole at 0 Hz): give the position and "
            "velocity controllers gains above zero.",
        )
    moving = poles[poles != 0]
    last = moving[np.argmax(np.real(moving))]
    return StabilityReport(True, poles, growing, f"The closed loop is stable; what dies out last {_describe(last)}.")


def require_stable(
    loop: ClosedLoop,
    *,
    friction_speed: Float[ArrayLike, ""] | None = None,
    state: ClosedLoopState | None = None,
    reference: MotionPoint | None = None,
) -> StabilityReport:
    """As `check_stability`, with an error for a loop that is not stable.

    Args:
        loop: plant and controller.
        friction_speed: as in `check_stability`.
        state: as in `check_stability`.
        reference: as in `check_stability`.

    Raises:
        InputError: a loop that is not stable; otherwise as `check_stability`.
    """
    report = check_stability(loop, friction_speed=friction_speed, state=state, reference=reference)
    if not report.stable:
        raise InputError(report.message)
    return report


def _system(loop: ClosedLoop, state: ClosedLoopState | None, reference: MotionPoint | None) -> StateSpace:
    return compiled_linearise(loop, state, reference, loop_outputs(loop)[:1])


def _describe(pole: complex) -> str:
    if pole.imag == 0:
        return f"is a pole at {abs(pole) / (2 * np.pi):.3g} Hz that does not oscillate (real part {pole.real:+.3g} 1/s)"
    return (
        f"is a pole at {abs(pole) / (2 * np.pi):.3g} Hz with damping ratio {-pole.real / abs(pole):.3g} "
        f"(real part {pole.real:+.3g} 1/s)"
    )


def _sentence(
    growing: np.ndarray,
    loop: ClosedLoop,
    system: StateSpace,
    state: ClosedLoopState | None,
    reference: MotionPoint | None,
) -> str:
    others = f" ({growing.size} such poles)" if growing.size > 1 else ""
    cure = _cure(growing[0], loop, system, state, reference)
    return f"The closed loop is unstable{others}: what grows fastest {_describe(growing[0])}; {cure}."


def _cure(
    pole: complex, loop: ClosedLoop, system: StateSpace, state: ClosedLoopState | None, reference: MotionPoint | None
) -> str:
    """Which gain of the controller moves the pole most, and in which direction."""
    gains, tree = jax.tree_util.tree_flatten_with_path(loop.controller)
    named = [str(getattr(path[-1], "name", "")) for path, _ in gains]
    values = [value for _, value in gains]
    chosen = [i for i, name in enumerate(named) if name.endswith("gain") and jnp.ndim(values[i]) == 0]

    def matrix(shares: jax.Array) -> jax.Array:
        changed = list(values)
        for share, i in zip(shares, chosen, strict=True):
            changed[i] = values[i] * share
        return _system(ClosedLoop(loop.plant, jax.tree.unflatten(tree, changed)), state, reference).a

    if not chosen:
        return "lower the gains of the controller"
    slopes = np.asarray(jax.jit(jax.jacfwd(matrix))(jnp.ones(len(chosen))))
    right, left = (_vector(a, pole) for a in (np.asarray(system.a), np.asarray(system.a).T))
    moves = np.real(np.einsum("i,ijk,j->k", left, slopes, right) / (left @ right))
    most = int(np.argmax(np.abs(moves)))
    if not np.isfinite(moves[most]) or moves[most] == 0:
        return "lower the gains of the controller"
    return f"{'lower' if moves[most] > 0 else 'raise'} {named[chosen[most]]}, which moves this pole most"


def _vector(matrix: np.ndarray, pole: complex) -> np.ndarray:
    values, vectors = np.linalg.eig(matrix)
    return vectors[:, np.argmin(np.abs(values - pole))]
