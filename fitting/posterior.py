"""Posterior sampling: all parameter values that data, priors and bounds leave plausible, by Hamiltonian Monte Carlo."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, PRNGKeyArray

from fitting.fit import check_residual
from fitting.mixing import effective_size, r_hat
from fitting.objective import Objective
from fitting.posterior_result import Posterior
from fitting.posterior_sampler import draw, import_blackjax
from fitting.posterior_target import Target, whitened_target
from fitting.residuals.residual import AbstractResidual
from fitting.result import FitResult
from twin._checks import InputError, require_x64
from twin.parameters import ParameterSpace

_SHRINKS = 6
"""Starts tried for a chain, each half as far out as the one before; after them the centre."""


def sample_posterior(
    residual: AbstractResidual,
    model: Any,
    space: ParameterSpace | None = None,
    *,
    chains: int = 4,
    warmup: int = 500,
    samples: int = 1000,
    seed: int = 1,
    variance: str = "estimated",
    starts: Float[ArrayLike, "chains parameters"] | None = None,
    acceptance: float = 0.8,
) -> Posterior:
    """Sample the posterior of the free parameters by the no-U-turn sampler.

    For parameters whose uncertainty linear theory does not describe: banana-shaped, cut off by a bound, or not limited
    by the data on one side. Sampler: M. D. Hoffman and A. Gelman, "The No-U-Turn Sampler", JMLR 15 (2014), in the form
    of blackjax, in coordinates that linear theory whitens; see `fitting.posterior_sampler` for the warm-up.

    Likelihood: with weights that are exact (`variance="known"`) its logarithm is -½·Σr². Otherwise the weights are
    right only up to a common factor σ², over which Jeffreys' prior 1/σ² is integrated: -(m/2)·ln Σr² with m data, from
    which a linear model gets Student's t with m - n degrees of freedom. Rows of priors stay absolute, -½·Σr², as they
    are in the fit.

    Prior: uniform within the bounds on each parameter's own scale (in the value, or in its logarithm), times the
    Gaussian prior where the parameter has one; the mode is then the fit. A parameter that nothing else limits needs
    two finite bounds.

    Robust losses: the loss takes the place of ½·Σr² in both forms. Bounded losses such as Tukey's leave a plateau far
    away from the data, so that all parameters need finite bounds.

    A point whose simulation fails has no density, and is never accepted. General constraints are not looked at.

    Args:
        residual: the evidence.
        model: the fit around which to start, or a fitted model.
        space: free parameters; those of the fit if not given.
        chains: chains, run as one batch; at least 2.
        warmup: draws of each chain that adapt the sampler and are dropped.
        samples: draws of each chain that are kept.
        seed: of all random numbers.
        variance: "estimated" from the residual, or "known" where the weights are exact.
        starts: starts of the chains in SI (chains, parameters), such as the minima of a multi-start. By default they
            are drawn around the model with twice the standard deviations of linear theory; chains that all start
            around one minimum cannot know of another.
        acceptance: acceptance rate to adapt the step size for; nearer to 1 means smaller steps.

    Returns:
        The samples, and whether they can be trusted.

    Raises:
        InputError: blackjax not installed, a posterior that does not exist (see "Prior"), a residual that is not
            finite at the model, wrong shape of the starts, numbers out of range.
    """
    require_x64()
    _check_numbers(chains, warmup, samples, variance, acceptance)
    import_blackjax()
    start, space = _model_and_space(model, space)
    space.check_start(start)
    rows = check_residual(residual, start, space)
    target = whitened_target(Objective(residual, start, space), variance)
    start_key, run_key = jax.random.split(jax.random.key(seed))
    places = _drawn(target, chains, start_key) if starts is None else _given(target, starts, chains)
    draws = draw(target, places, run_key, warmup, samples, acceptance)
    vectors = np.asarray(draws.vectors)
    return Posterior(
        space=space,
        values=np.asarray(draws.values),
        r_hat=r_hat(vectors),
        effective_size=effective_size(vectors),
        divergences=int(np.sum(np.asarray(draws.divergent))),
        acceptance=np.mean(np.asarray(draws.acceptance), axis=1),
        evaluations=int(np.sum(np.asarray(draws.steps))),
        data=rows,
        variance=variance,
    )


@eqx.filter_jit
def _drawn(target: Target, chains: int, key: PRNGKeyArray) -> Float[Array, "chains n"]:
    """Starts twice as far out as the posterior is wide; nearer where the model cannot be evaluated there."""

    def one(key: Array) -> Array:
        far = 2 * jax.random.normal(key, target.centre.shape)
        tries = far * jnp.append(0.5 ** jnp.arange(_SHRINKS), 0.0)[:, None]
        return tries[jnp.argmax(jnp.isfinite(_log_densities(target, tries)))]

    return jax.vmap(one)(jax.random.split(key, chains))


@eqx.filter_jit
def _log_densities(target: Target, places: Float[Array, "places n"]) -> Float[Array, "places"]:
    return jax.vmap(lambda z: target.log_density(z))(places)


def _given(target: Target, starts: ArrayLike, chains: int) -> Float[Array, "chains n"]:
    """Starts in SI to whitened coordinates, a little off the bounds."""
    space = target.objective.space
    values = np.asarray(starts, dtype=float)
    if values.shape != (chains, len(space)):
        raise InputError(
            f"starts has shape {values.shape}; give one row for each of the {chains} chains and {len(space)} columns "
            f"({', '.join(space.paths)})."
        )
    places = _placed(target, jnp.asarray(space.scaled_rows(values)))
    bad = ~np.isfinite(np.asarray(_log_densities(target, places)))
    if bad.any():
        raise InputError(
            f"The residual is not finite at the start of chain {int(np.argmax(bad))}. Start it elsewhere, or leave "
            "starts out."
        )
    return places


@eqx.filter_jit
def _placed(target: Target, vectors: Float[Array, "chains n"]) -> Float[Array, "chains n"]:
    """Scaled vectors to whitened coordinates."""
    box = target.box
    off = jnp.minimum(1e-6 * box.width, 0.25 * (box.upper - box.lower))
    inside = jnp.clip(vectors, box.lower + off, box.upper - off)
    return jax.vmap(lambda x: target.whitened(x))(inside)


def _model_and_space(model: Any, space: ParameterSpace | None) -> tuple[Any, ParameterSpace]:
    if isinstance(model, FitResult):
        return model.model, model.space if space is None else space
    if space is None:
        raise InputError("space is missing: name the free parameters, or give a FitResult in place of the model.")
    return model, space


def _check_numbers(chains: int, warmup: int, samples: int, variance: str, acceptance: float) -> None:
    for name, value, least in (("chains", chains, 2), ("warmup", warmup, 20), ("samples", samples, 10)):
        if value < least:
            raise InputError(f"{name} must be at least {least}, but is {value}.")
    if variance not in ("estimated", "known"):
        raise InputError(f'variance must be "estimated" or "known", but is {variance!r}.')
    if not 0 < acceptance < 1:
        raise InputError(f"acceptance must be between 0 and 1, but is {acceptance}. Use 0.8 to 0.99.")
