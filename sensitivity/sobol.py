"""Sobol indices: which parameters cause the variance of which outputs. One sample matrix serves all outputs."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from sensitivity._bootstrap import bootstrap_weights, require_interval
from sensitivity._estimators import Estimates, estimates, normalised
from sensitivity.evaluation import evaluate, named_columns, require_finite
from sensitivity.sobol_design import SobolSamples, sobol_samples
from sensitivity.sobol_result import SobolIndices
from twin.parameters import ParameterSpace

# Fewest base points that an earlier estimate of a run is made from.
_FEWEST = 8


def sobol(
    fn: Callable[..., Any],
    space: ParameterSpace,
    *,
    seed: int,
    model: Any = None,
    n: int = 1024,
    second_order: bool = False,
    groups: Mapping[str, Sequence[str]] | None = None,
    outputs: Sequence[str] | None = None,
    chunk: int = 256,
    confidence: float = 0.95,
    resamples: int = 100,
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> SobolIndices:
    """Sobol indices of every output of a function.

    Args:
        fn: JAX function of the values in SI (parameters,), or of the model if one is given. It returns a number, a
            vector, or a dict of such, all real. Define it once and keep it: a new lambda compiles anew.
        space: parameters with finite bounds; each is uniform between them on its own scale.
        seed: seed of samples and intervals, from 1.
        model: model whose parameters take the sampled values; None where `fn` takes the vector.
        n: base points, a power of two; `fn` is evaluated n·(parameters + 2) times.
        second_order: estimate the second-order indices too, with n·(2·parameters + 2) evaluations.
        groups: paths by group name; a group has one index. Parameters in no group stand alone.
        outputs: names of the outputs, in order.
        chunk: samples evaluated at once.
        confidence: probability that the intervals are made for.
        resamples: bootstrap samples that the intervals come from.
        store: folder that keeps what was evaluated, so that a study that was killed goes on.
        executor: where it is evaluated, see `twin.batch.batched`; None for this process.
        progress: show a bar.

    Returns:
        The indices with their intervals, and how they converged with n.

    Raises:
        InputError: bounds missing, n not a power of two, an output that is not finite at some sample, and so on.
    """
    samples = sobol_samples(space, n, seed=seed, second_order=second_order, groups=groups)
    values = evaluate(
        fn,
        space,
        samples.values,
        model=model,
        chunk=chunk,
        seed=seed,
        store=store,
        executor=executor,
        progress=progress,
    )
    return sobol_indices(samples, values, outputs=outputs, confidence=confidence, resamples=resamples)


def sobol_indices(
    samples: SobolSamples,
    values: Any,
    *,
    outputs: Sequence[str] | None = None,
    confidence: float = 0.95,
    resamples: int = 100,
) -> SobolIndices:
    """Sobol indices from outputs that were evaluated elsewhere; all outputs in one go, as SALib finds them one by one.

    Args:
        samples: of `sobol_samples`.
        values: outputs at `samples.values`: (rows,), (rows, outputs), or a dict of such.
        outputs: names of the outputs, in order.
        confidence: probability that the intervals are made for.
        resamples: bootstrap samples that the intervals come from, at least 2.

    Returns:
        The indices, with the total variance of each output.

    Raises:
        InputError: another number of rows than samples, an output that is not finite.

    References:
        A. Saltelli et al., Computer Physics Communications 181 (2010) 259-270 (first order and total).
        A. Saltelli, Computer Physics Communications 145 (2002) 280-297 (second order).
    """
    matrix, names = named_columns(values, outputs, len(samples))
    require_interval(confidence, resamples)
    require_finite(matrix, names, samples.space, samples.values)
    sizes = [samples.n // k for k in (8, 4, 2, 1) if samples.n // k >= _FEWEST]
    found = [_first(samples, matrix, size, confidence, resamples) for size in sizes]
    blocks = samples.blocks(matrix)
    base = np.concatenate([blocks["A"], blocks["B"]])
    moved = normalised(matrix).any(axis=0)
    return SobolIndices(
        space=samples.space,
        groups=samples.groups,
        outputs=names,
        variance=np.where(moved, base.var(axis=0), 0.0),
        sizes=np.asarray(sizes),
        S1_by_size=np.stack([x.S1 for x in found]),
        S1_conf_by_size=np.stack([x.S1_conf for x in found]),
        ST_by_size=np.stack([x.ST for x in found]),
        ST_conf_by_size=np.stack([x.ST_conf for x in found]),
        S2=found[-1].S2,
        S2_conf=found[-1].S2_conf,
        seed=samples.seed,
        confidence=confidence,
        resamples=resamples,
    )


def _first(samples: SobolSamples, matrix: np.ndarray, size: int, confidence: float, resamples: int) -> Estimates:
    """Estimates from the first base points alone, with their own normalisation: what a smaller study had said."""
    blocks = samples.split(normalised(matrix[: size * samples.step]))
    kept = {name: block for name, block in blocks.items() if name != "BA" or size == samples.n}
    return estimates(kept, bootstrap_weights(size, resamples, samples.seed), confidence)
