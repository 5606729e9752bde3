"""How well something that follows from fitted parameters is known, from the fit that lies beside a study."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from fitting.result import FitResult
from fitting.study.study_file import StudyFile
from twin._checks import InputError

FITTED, RESULT = "fitted.toml", "fit.npz"
"""The study that a fit writes, and the fit itself."""
_SAME = 1e-9


def fit_beside(study: StudyFile) -> FitResult | None:
    """The fit whose values a study has: `fit.npz` beside `fitted.toml`.

    Args:
        study: the study.

    Returns:
        The fit; None for other studies, and where the values were changed since.
    """
    file = study.document.file.with_name(RESULT)
    if study.document.file.name != FITTED or not file.is_file():
        return None
    try:
        found = FitResult.load(file, study.model)
        now = np.asarray(found.space.values(study.model))
    except InputError:
        return None
    return found if np.allclose(now, found.values, rtol=_SAME, atol=0.0) else None


def spread(function: Callable[[Any], Float[np.ndarray, "..."]], fit: FitResult) -> Float[np.ndarray, "..."]:
    """Standard error of a function of the model, carried over from the parameters' covariance.

    Half the difference between the function's values one standard deviation to either side, along the principal axes
    of the covariance, squared and summed: for a straight function J·Σ·Jᵀ. Parameters at a bound, and those that the
    data do not see, count as known.

    Args:
        function: from a model to numbers.
        fit: the fit.

    Returns:
        The standard error of each number.
    """
    sizes, axes = np.linalg.eigh(np.nan_to_num(fit.scaled_covariance))
    total = np.zeros(np.shape(function(fit.model)))
    for size, axis in zip(sizes, axes.T, strict=True):
        if size <= 0:
            continue
        ends = [
            function(fit.space.unpack(fit.model, jnp.asarray(fit.scaled + side * np.sqrt(size) * axis)))
            for side in (-1, 1)
        ]
        total += ((ends[1] - ends[0]) / 2) ** 2
    return np.sqrt(total)
