"""Where many fits start: points that fill the box of a parameter space."""

import numpy as np

from twin._checks import InputError
from twin.parameters import ParameterSpace

SAMPLERS = ("sobol", "latin_hypercube")


def sample_starts(space: ParameterSpace, count: int, *, sampler: str = "sobol", seed: int = 1) -> np.ndarray:
    """Starts that fill the bounds evenly, on the scale of each parameter.

    Args:
        space: free parameters, each with finite bounds on its scale.
        count: number of starts.
        sampler: "sobol" (scrambled; evenest when count is a power of two) or "latin_hypercube".
        seed: of the sampler; the same seed gives the same starts.

    Returns:
        Scaled vectors (count, parameters).

    Raises:
        InputError: a parameter without finite bounds, no start asked for, an unknown sampler.
    """
    if count < 1:
        raise InputError(f"starts must be at least 1, but is {count}.")
    if sampler not in SAMPLERS:
        raise InputError(f"sampler must be one of {', '.join(SAMPLERS)}, but is {sampler!r}.")
    lower, upper = np.asarray(space.lower), np.asarray(space.upper)
    for parameter, low, high in zip(space.parameters, lower, upper, strict=True):
        if not (np.isfinite(low) and np.isfinite(high)):
            positive = " above zero" if parameter.scale == "log" else ""
            raise InputError(
                f"{parameter.path}: starts are drawn between the bounds, but these are [{parameter.lower:g}, "
                f"{parameter.upper:g}] {parameter.unit}. Give finite bounds{positive}, or give the starts as an array."
            )
    from scipy.stats import qmc  # two seconds to import

    size = len(space)
    if sampler == "sobol":
        # Drawn to the next power of two, as the sequence is balanced only there.
        unit = qmc.Sobol(size, rng=np.random.default_rng(seed)).random_base2(max(count - 1, 0).bit_length())[:count]
    else:
        unit = qmc.LatinHypercube(size, rng=np.random.default_rng(seed)).random(count)
    return lower + unit * (upper - lower)
