"""Derivative-based measures: mean squared derivatives, exact by automatic differentiation, and what they bound."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sensitivity._bootstrap import bootstrap_weights, require_interval, weighted, with_interval
from sensitivity._estimators import normalised
from sensitivity._unit_cube import from_unit, require_bounds, require_power_of_two, require_seed
from sensitivity.derivative_result import DerivativeMeasures
from sensitivity.evaluation import evaluate, named_columns, require_finite
from sensitivity.partition import require_threshold
from twin._checks import InputError
from twin.parameters import ParameterSpace


class Screening(NamedTuple):
    """What is left to study after screening."""

    kept: tuple[str, ...]
    """Paths of the parameters that may matter for some output."""
    left_out: tuple[str, ...]
    """Paths of those that matter for none."""
    highest: dict[str, float]
    """Highest upper end of the bound's interval over all outputs, by path."""


def derivative_measures(
    fn: Callable[..., Any],
    space: ParameterSpace,
    *,
    seed: int,
    model: Any = None,
    n: int = 256,
    outputs: Sequence[str] | None = None,
    mode: str = "auto",
    chunk: int = 64,
    confidence: float = 0.95,
    resamples: int = 100,
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> DerivativeMeasures:
    """Mean squared derivatives of every output, and the bounds on total effects that follow.

    For a parameter uniform in [a, b] and V the output's variance, S_Ti ≤ ν_i·(b - a)²/(π²·V), ν_i = E[(∂f/∂x_i)²]
    (Sobol' and Kucherenko 2009, theorem 3). Here x_i is the parameter on its scale, so that log parameters are uniform
    too, and the range is folded in: derivatives are with respect to x_i over (b - a).

    The bound holds where the function is continuous. A jump, as when a mode is paired with another one, has no
    derivative, and what it adds to the variance is not seen here.

    Args:
        fn: JAX function, as in `sobol`, differentiable in the chosen mode.
        space: parameters with finite bounds.
        seed: seed of samples and intervals, from 1.
        model: as in `sobol`.
        n: points, a power of two.
        outputs: names of the outputs, in order.
        mode: "forward" (cost grows with the parameters), "reverse" (with the outputs), or "auto" for what is fewer.
        chunk: points differentiated at once.
        confidence: probability that the intervals are made for.
        resamples: bootstrap samples that the intervals come from.
        store: folder that keeps what was evaluated, so that a study that was killed goes on.
        executor: where it is evaluated, see `twin.batch.batched`; None for this process.
        progress: show a bar.

    Returns:
        Measures and bounds.

    Raises:
        InputError: bounds missing, an output or derivative that is not finite at some sample, and so on.

    References:
        I. M. Sobol' and S. Kucherenko, Mathematics and Computers in Simulation 79 (2009) 3009-3017.
    """
    if mode not in ("auto", "forward", "reverse"):
        raise InputError(f'mode must be "auto", "forward" or "reverse", but is {mode!r}.')
    require_interval(confidence, resamples)
    values = derivative_samples(space, n, seed=seed)
    found = evaluate(
        _WithSlopes(fn, space, model is not None, mode),
        space,
        values,
        model=model,
        chunk=chunk,
        seed=seed,
        store=store,
        executor=executor,
        progress=progress,
    )
    done = {name[len(_VALUE) :]: array for name, array in found.items() if name.startswith(_VALUE)}
    slopes = [array.reshape(n, -1, len(space)) for name, array in found.items() if name.startswith(_SLOPE)]
    return measures_from_derivatives(
        space,
        values,
        done.get("", done),
        np.concatenate(slopes, axis=1),
        seed=seed,
        outputs=outputs,
        confidence=confidence,
        resamples=resamples,
    )


def derivative_samples(space: ParameterSpace, n: int = 256, *, seed: int) -> np.ndarray:
    """Points of a derivative-based study (n, parameters), SI: a scrambled Sobol sequence.

    Args:
        space: parameters with finite bounds; each is uniform between them on its own scale.
        n: points, a power of two.
        seed: seed of the scrambling, from 1.

    Raises:
        InputError: bounds missing, n not a power of two, no seed.
    """
    require_bounds(space)
    require_seed(seed)
    require_power_of_two(n)
    from scipy.stats import qmc

    return from_unit(space, qmc.Sobol(d=len(space), scramble=True, rng=np.random.default_rng(seed)).random(n))


def measures_from_derivatives(
    space: ParameterSpace,
    samples: Float[np.ndarray, "rows parameters"],
    values: Any,
    derivatives: Float[np.ndarray, "rows outputs parameters"],
    *,
    seed: int,
    outputs: Sequence[str] | None = None,
    confidence: float = 0.95,
    resamples: int = 100,
) -> DerivativeMeasures:
    """Measures and bounds as `derivative_measures`, from outputs and exact derivatives that were found elsewhere.

    Args:
        space: the parameters.
        samples: points, SI, as of `derivative_samples`.
        values: outputs there: (rows,), (rows, outputs), or a dict of such.
        derivatives: derivatives of the outputs with respect to the parameters in SI.
        seed: seed of the intervals, from 1.
        outputs: names of the outputs, in order.
        confidence: probability that the intervals are made for.
        resamples: bootstrap samples that the intervals come from.

    Returns:
        Measures and bounds.

    Raises:
        InputError: bounds missing, another number of rows, outputs or parameters, what is not finite.
    """
    require_bounds(space)
    require_seed(seed)
    require_interval(confidence, resamples)
    rows = len(samples)
    matrix, names = named_columns(values, outputs, rows)
    if derivatives.shape != (rows, len(names), len(space)):
        raise InputError(
            f"derivatives has the shape {derivatives.shape}, but there are {rows} samples, {len(names)} outputs and "
            f"{len(space)} parameters. Give the derivative of each output by each parameter, in this order."
        )
    require_finite(matrix, names, space, samples)
    pairs = [f"{name} with respect to {path}" for name in names for path in space.paths]
    require_finite(derivatives.reshape(rows, -1), pairs, space, samples, what="The derivative of")
    stretch = jax.vmap(space.slopes)(jnp.asarray(samples)) * (space.upper - space.lower)
    shares = derivatives * np.asarray(stretch)[:, None]
    weights = bootstrap_weights(rows, resamples, seed)
    # Both scaled by one deviation: their ratio is the same, and nothing is lost to a large mean.
    centred, spread = normalised(matrix), matrix.std(axis=0)
    spread = np.where(centred.any(axis=0), spread, 0.0)
    variance = weighted(weights, centred**2) - weighted(weights, centred) ** 2
    squares = weighted(weights, shares.transpose(0, 2, 1) ** 2)
    scale = np.where(spread > 0, variance * spread**2, np.inf)[:, None]
    nu, nu_conf = with_interval(squares, confidence)
    bound, bound_conf = with_interval(squares / (np.pi**2 * scale), confidence)
    return DerivativeMeasures(space, names, spread**2, nu, nu_conf, bound, bound_conf, rows, int(seed), confidence)


def screen(measures: DerivativeMeasures, threshold: float = 0.01) -> Screening:
    """Parameters that can be left out of a Sobol study, as their total effect is below a threshold for every output.

    A parameter is left out only if the upper end of its bound's interval is below the threshold. Nothing is said about
    the others: the bound can be far above the effect.

    Args:
        measures: of `derivative_measures`.
        threshold: total effect that matters.

    Returns:
        Paths kept, as `space.subset(screening.kept)` takes them, and paths left out.

    Raises:
        InputError: a threshold outside 0 to 1.
    """
    require_threshold(threshold)
    highest = (measures.bound + measures.bound_conf).max(axis=0)
    kept = highest >= threshold
    paths = np.asarray(measures.names)
    by_path = {path: float(value) for path, value in zip(measures.names, highest, strict=True)}
    return Screening(tuple(paths[kept].tolist()), tuple(paths[~kept].tolist()), by_path)


_VALUE, _SLOPE = "value ", "slope "


class _WithSlopes(eqx.Module):
    """A function's outputs together with their derivatives; compiled once for a function, space and mode."""

    fn: Callable[..., Any]
    """The function."""
    space: ParameterSpace
    """The parameters."""
    takes_model: bool = eqx.field(static=True)
    """Whether the function takes a model, not the values."""
    mode: str = eqx.field(static=True)
    """"auto", "forward" or "reverse"."""

    def __call__(self, target: Any) -> dict[str, Float[Array, "..."]]:
        """Outputs "value NAME", and their derivatives "slope NAME" by the values in SI, whose axis comes last.

        Args:
            target: values in SI (parameters,), or a model that has them.
        """
        values = self.space.values(target) if self.takes_model else target
        names: list[str] = [""]

        def twice(x: Float[Array, "parameters"]) -> tuple[list[Any], list[Any]]:
            done = self.fn(self.space.with_values(target, x) if self.takes_model else x)
            names[:] = map(str, done) if isinstance(done, Mapping) else [""]
            done = list(done.values()) if isinstance(done, Mapping) else [done]
            return done, done

        count = sum(leaf.size for leaf in jax.tree.leaves(eqx.filter_eval_shape(twice, values)[0]))
        forward = self.mode == "forward" or (self.mode == "auto" and count >= len(self.space))
        slopes, found = (jax.jacfwd if forward else jax.jacrev)(twice, has_aux=True)(values)
        by_name = {_VALUE + name: value for name, value in zip(names, found, strict=True)}
        return by_name | {_SLOPE + name: slope for name, slope in zip(names, slopes, strict=True)}
