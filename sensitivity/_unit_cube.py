"""Samples of the unit cube as values of parameters, and what has to be given for that."""

import numpy as np

from twin._checks import InputError, require_x64
from twin.parameters import ParameterSpace


def from_unit(space: ParameterSpace, unit: np.ndarray) -> np.ndarray:
    """Values in SI (rows, parameters) of points of the unit cube, which is uniform in the scaled vector.

    Args:
        space: parameters with finite bounds.
        unit: points (rows, parameters) between 0 and 1.
    """
    lower, upper = np.asarray(space.lower), np.asarray(space.upper)
    values = space.unscaled_rows(lower + unit * (upper - lower))
    bounds = np.asarray([(p.lower, p.upper) for p in space.parameters])
    # Exponentials of logarithms miss the bounds by rounding.
    return np.clip(values, bounds[:, 0], bounds[:, 1])


def require_bounds(space: ParameterSpace) -> None:
    """Raise unless every parameter has finite bounds on its scale.

    Args:
        space: parameters.

    Raises:
        InputError: naming the parameters without.
    """
    require_x64()
    open_ended = ~np.isfinite(np.asarray(space.lower)) | ~np.isfinite(np.asarray(space.upper))
    if open_ended.any():
        raise InputError(
            f"Variances are taken between bounds, but these have none (zero is none on the log scale): "
            f"{space.named(open_ended)}. Give Parameter(path, unit, lower, upper) finite bounds."
        )


def require_seed(seed: int) -> None:
    """Raise unless a seed is a whole number of at least 1.

    Args:
        seed: seed.

    Raises:
        InputError: with the cure.
    """
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 1:
        raise InputError(f"seed must be a whole number of at least 1, but is {seed!r}. SALib takes 0 for no seed.")


def require_power_of_two(n: int) -> None:
    """Raise unless a number of points is a power of two of at least 8.

    Args:
        n: points.

    Raises:
        InputError: with the neighbouring powers.
    """
    if n < 8 or n & (n - 1):
        lower = 2 ** max(3, int(n).bit_length() - 1)
        raise InputError(
            f"n must be a power of two of at least 8, but is {n}: a Sobol sequence is balanced only there. "
            f"Take {lower} or {2 * lower}."
        )
