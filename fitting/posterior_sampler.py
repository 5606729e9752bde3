"""The no-U-turn sampler over all chains at once, with step size and metric adapted for all of them together."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from fitting.posterior_target import Target, with_forward_gradient
from twin._checks import InputError


class Draws(NamedTuple):
    """What the chains drew after the warm-up."""

    vectors: Float[Array, "chains samples parameters"]
    """Scaled vectors."""
    values: Float[Array, "chains samples parameters"]
    """The same in SI."""
    divergent: Bool[Array, "chains samples"]
    """Whether the trajectory diverged or met a point without density."""
    acceptance: Float[Array, "chains samples"]
    """Mean acceptance probability along the trajectory."""
    steps: Int[Array, "chains samples"]
    """Leapfrog steps taken."""


class _Spread(NamedTuple):
    """Variance of the draws of one adaptation window, over all chains: Welford's sums."""

    number: Array
    mean: Array
    squares: Array


class _Adapted(NamedTuple):
    """What the warm-up adapts."""

    step_size: Any
    spread: _Spread
    inverse_mass: Array


@eqx.filter_jit
def draw(
    target: Target,
    places: Float[Array, "chains parameters"],
    key: PRNGKeyArray,
    warmup: int,
    samples: int,
    acceptance: float,
) -> Draws:
    """Run all chains as one batch and one loop: the kernel is compiled once for warm-up and sampling.

    The warm-up follows Stan's windows: step size by dual averaging all along, a diagonal metric from the draws of each
    window. Both are shared, from the mean acceptance and the draws of all chains: more to learn from, and chains of
    equal step size wait less for each other.

    Args:
        target: the posterior.
        places: starts in whitened coordinates.
        key: of all random numbers.
        warmup: draws to adapt by.
        samples: draws to keep.
        acceptance: acceptance rate to adapt the step size for.
    """
    blackjax = import_blackjax()
    from blackjax.adaptation.staged_adaptation import build_schedule
    from blackjax.adaptation.step_size import dual_averaging_adaptation

    density, kernel = with_forward_gradient(target), blackjax.nuts.build_kernel()
    begin, update, final = dual_averaging_adaptation(acceptance)
    chains, size = places.shape

    def one(carry: tuple[Any, _Adapted], now: tuple[Array, Array, Array]) -> tuple[tuple[Any, _Adapted], Draws]:
        (states, adapted), (key, stage, window_ends) = carry, now
        step = jnp.where(stage == 2, final(adapted.step_size), jnp.exp(adapted.step_size.log_step_size))
        moves = jax.vmap(lambda key, state: kernel(key, state, density, step, adapted.inverse_mass))
        states, info = moves(jax.random.split(key, chains), states)
        learned = update(adapted.step_size, jnp.mean(info.acceptance_rate))
        spread = _added(adapted.spread, states.position)
        ended = _Adapted(begin(final(learned)), _nothing(size), _metric(spread))
        adapted = _Adapted(
            _choose(stage < 2, learned, adapted.step_size),
            _choose(stage == 1, spread, adapted.spread),
            adapted.inverse_mass,
        )
        adapted = _choose(window_ends, ended, adapted)
        vectors = jax.vmap(target.vector)(states.position)
        values = jax.vmap(target.objective.space.unscaled)(vectors)
        return (states, adapted), Draws(
            vectors, values, info.is_divergent, info.acceptance_rate, info.num_integration_steps
        )

    states = jax.vmap(lambda place: blackjax.nuts.init(place, density))(places)
    schedule = jnp.concatenate(
        [jnp.asarray(build_schedule(warmup), dtype=int), jnp.tile(jnp.asarray([2, 0]), (samples, 1))]
    )
    keys = jax.random.split(key, warmup + samples)
    start = _Adapted(begin(jnp.asarray(1.0)), _nothing(size), jnp.ones(size))
    _, draws = jax.lax.scan(one, (states, start), (keys, schedule[:, 0], schedule[:, 1] == 1))
    return jax.tree.map(lambda x: jnp.swapaxes(x[warmup:], 0, 1), draws)


def import_blackjax() -> Any:
    """The library that the sampler comes from.

    Raises:
        InputError: if it is not installed.
    """
    try:
        import blackjax
    except ImportError as error:
        raise InputError(
            "Posterior sampling needs blackjax, which is not installed. Install it by the extra: "
            "pip install 'drivetwin[bayes]'."
        ) from error
    return blackjax


def _nothing(size: int) -> _Spread:
    return _Spread(jnp.asarray(0.0), jnp.zeros(size), jnp.zeros(size))


def _added(spread: _Spread, rows: Array) -> _Spread:
    """With more rows, by the pairwise update of Chan, Golub and LeVeque (The American Statistician 37, 1983)."""
    more, mean = rows.shape[0], jnp.mean(rows, axis=0)
    number = spread.number + more
    away = mean - spread.mean
    squares = spread.squares + jnp.sum((rows - mean) ** 2, axis=0) + away**2 * spread.number * more / number
    return _Spread(number, spread.mean + away * more / number, squares)


def _metric(spread: _Spread) -> Array:
    """Variance of a window's draws, drawn towards a small one by five draws' worth as in Stan."""
    variance = spread.squares / jnp.maximum(spread.number - 1, 1.0)
    return (spread.number * variance + 5 * 1e-3) / (spread.number + 5)


def _choose(condition: Array, yes: Any, no: Any) -> Any:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)
