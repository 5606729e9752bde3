"""Integrals over signals that run straight from sample to sample, and the checks that their measures share."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, increasing, is_concrete, require_x64

# Exact for polynomials of degree nine; a smooth switch within one sample interval is met to a few digits.
_NODES = 5


def samples_of(times: ArrayLike, **signals: ArrayLike | None) -> tuple[Array, list[Array]]:
    """Times and signals as double-precision vectors of one length.

    Args:
        times: sample times (samples,) [s].
        signals: signals (samples,) or single numbers, by the name that a message gives them; None is passed over.

    Raises:
        InputError: 64-bit mode off, times that do not increase or are fewer than two, a signal of another length.
    """
    require_x64()
    t = jnp.asarray(times, dtype=jnp.float64)
    if t.ndim != 1 or t.size < 2:
        raise InputError(f"times must be a vector of at least two samples [s], but has shape {t.shape}.")
    increasing("times", t, "s")
    found = []
    for name, signal in signals.items():
        if signal is None:
            continue
        values = jnp.asarray(signal, dtype=jnp.float64)
        if values.shape not in ((), t.shape):
            raise InputError(
                f"{name} has shape {values.shape}, but times has {t.shape}. Give one value for each time; map over "
                "several runs by jax.vmap."
            )
        found.append(jnp.broadcast_to(values, t.shape))
    return t, found


def direction_of_travel(start: Float[Array, ""], target: Float[Array, ""]) -> Float[Array, ""]:
    """+1 or -1: where the target lies from the start.

    Raises:
        InputError: if both are the same.
    """
    if is_concrete(start) and is_concrete(target) and start == target:
        raise InputError(f"target and start are both {float(start):g}: there is no travel. Give the start of the move.")
    direction = jnp.sign(target - start)
    # In a batch a move without travel is marked.
    return jnp.where(direction == 0, jnp.nan, direction)


def area_above_zero(step: Array, begin: Array, end: Array) -> Float[Array, ""]:
    """Exact integral of max(v, 0) over straight pieces.

    Args:
        step: length of each piece.
        begin: value v at its begin.
        end: value v at its end.
    """
    first, second = jnp.where(begin > 0, begin, 0.0), jnp.where(end > 0, end, 0.0)
    # |v₀| + |v₁|, written so that its derivative at zero fits that of the positive parts above.
    spread = 2 * (first + second) - begin - end
    # Equal to zero and not "not above": what is NaN is to stay so.
    return jnp.sum(0.5 * step * (first + second) ** 2 / jnp.where(spread == 0, 1.0, spread))


def area_of(function: Callable[..., Array], step: Array, *ends: tuple[Array, Array]) -> Float[Array, ""]:
    """Integral of a smooth function of signals over straight pieces, by Gauss and Legendre's rule on each.

    Args:
        function: of the signals, elementwise.
        step: length of each piece.
        ends: values of each signal at the begins and at the ends of the pieces.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    share = 0.5 * (1 + nodes)[:, None]
    values = function(*(begin + share * (end - begin) for begin, end in ends))
    return jnp.sum(0.5 * weights[:, None] * step * values)
