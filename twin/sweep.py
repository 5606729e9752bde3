"""What-if sweeps: any results of a model over values of its parameters, computed as one batch."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._batch_kernel import of_one
from twin._checks import InputError, finite, require_x64
from twin.batch import batched
from twin.parameters import Parameter, ParameterSpace
from twin.paths import get_leaf, set_leaves
from twin.sweep_result import Sweep

Outputs = Callable[[Any], Any]


def sweep(
    model: Any,
    over: "Mapping[str, ArrayLike | Sequence] | Mapping[Parameter, ArrayLike | Sequence]",
    outputs: Outputs | Mapping[str, Outputs],
    *,
    grid: bool = True,
    space: ParameterSpace | None = None,
    relative: bool = False,
    units: Mapping[str, str] | None = None,
    chunk_size: int | str = "auto",
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> Sweep:
    """Results of a model over a grid, or a list, of values of its parameters.

    All points are computed by `twin.batch.batched`. The program is compiled once for each function and structure of
    the model: define the function once at the top level, as a new lambda compiles anew.

    Args:
        model: any module.
        over: values of each parameter, by its dotted path or by a `Parameter`, whose unit labels the table, whose
            bounds the values must keep, and whose ties follow.
        outputs: from a model to a number or an array, or to a NamedTuple, dict or module of such; pure JAX. Or several
            such functions by name.
        grid: all combinations of the values; if not, the values of all parameters are those of the points in turn.
        space: where the parameters of bare paths are looked up, for their units, bounds and ties.
        relative: the values are factors on the present value.
        units: units of the results by name, for tables and plots.
        chunk_size: points computed side by side, see `twin.batch.batched`.
        store: folder that keeps what was computed, so that a long sweep that was killed goes on.
        executor: where it is computed, see `twin.batch.batched`; None for this process.
        progress: show a bar.

    Returns:
        The results. A point that fails is NaN there, and marked in the table.

    Raises:
        InputError: 64-bit mode off, an unknown path, a path given twice, no parameters, values that are none, no vector
            or not finite or out of bounds, lists of unequal length, a present value of zero in a relative sweep,
            complex results, a unit for a result that there is not, a chunk size below one, a store that holds another
            sweep.
    """
    require_x64()
    if not over:
        raise InputError("A sweep is over one parameter or more, but none was given.")
    parameters = tuple(_parameter(key, space) for key in over)
    paths = tuple((parameter.path, *parameter.tied) for parameter in parameters)
    varied = [path for tied in paths for path in tied]
    twice = [path for path in varied if varied.count(path) > 1]
    if twice:
        raise InputError(f"{twice[0]} is swept twice. Give its values once.")
    present = tuple(float(get_leaf(model, parameter.path)) for parameter in parameters)
    values = tuple(_values(p, v, now, relative) for p, v, now in zip(parameters, over.values(), present, strict=True))
    if not grid and len({axis.size for axis in values}) > 1:
        seen = ", ".join(f"{p.path} has {axis.size}" for p, axis in zip(parameters, values, strict=True))
        raise InputError(f"The values of a list must be equally many, but {seen}. Sweep over a grid, or fill them up.")
    absolute = [axis * now for axis, now in zip(values, present, strict=True)] if relative else list(values)
    points = [axis.ravel() for axis in np.meshgrid(*absolute, indexing="ij")] if grid else absolute
    functions = dict(outputs) if isinstance(outputs, Mapping) else outputs
    at = _AtPoint(model, functions, paths)
    rows = np.stack(points, axis=-1)
    expected = _expected(at, rows[0])
    for name in units or {}:
        if name not in expected:
            raise InputError(f"units names the result {name!r}, but the results are {', '.join(expected)}.")
    found = batched(at, rows, chunk_size=chunk_size, store=store, executor=executor, progress=progress)
    shape = tuple(axis.size for axis in values) if grid else values[0].shape
    # Where no point could be computed there are no outputs at all.
    computed = {name: np.full((len(rows), *inner), np.nan) for name, inner in expected.items()}
    computed |= found.outputs.items()
    results = {name: computed[name].reshape(*shape, *inner) for name, inner in expected.items()}
    return Sweep(parameters, values, present, relative, results, dict(units or {}), grid, dict(found.messages))


def _expected(at: "_AtPoint", row: np.ndarray) -> dict[str, tuple[int, ...]]:
    """Names and shapes of the results."""
    found = eqx.filter_eval_shape(of_one, at, jnp.asarray(row))
    return {name: value.shape for name, value in zip(found.names, found.values, strict=True)}


class _AtPoint(eqx.Module):
    """The results at one point."""

    model: Any
    """The model."""
    outputs: Outputs | dict[str, Outputs]
    """Its results."""
    paths: tuple[tuple[str, ...], ...] = eqx.field(static=True)
    """Paths that take each value."""

    def __call__(self, point: Float[Array, "parameters"]) -> Any:
        """Results by name.

        Args:
            point: values of the parameters, SI.
        """
        here = set_leaves(self.model, {path: point[i] for i, tied in enumerate(self.paths) for path in tied})
        if isinstance(self.outputs, dict):
            return {name: jax.tree.map(_real, function(here)) for name, function in self.outputs.items()}
        return jax.tree.map(_real, self.outputs(here))


def _real(value: Any) -> Array:
    if jnp.iscomplexobj(value):
        raise InputError("The function of a sweep returned complex numbers. Return magnitude and phase, for instance.")
    return jnp.asarray(value, dtype=jnp.float64)


def _parameter(key: str | Parameter, space: ParameterSpace | None) -> Parameter:
    if isinstance(key, Parameter):
        return key
    return space[key] if space is not None and key in space.paths else Parameter(key)


def _values(parameter: Parameter, values: Any, present: float, relative: bool) -> np.ndarray:
    path = parameter.path
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1 or array.size == 0:
        raise InputError(f"The values of {path} must be a vector of at least one, but have the shape {array.shape}.")
    finite(f"values of {path}", array, parameter.unit)
    if relative and present == 0:
        raise InputError(f"{path} is zero in the model: a relative sweep does not change it. Give values in SI.")
    absolute = array * present if relative else array
    outside = (absolute < parameter.lower) | (absolute > parameter.upper)
    if outside.any():
        raise InputError(
            f"{path} is to take the value {absolute[outside][0]:g}, outside of its bounds {parameter.lower:g} to "
            f"{parameter.upper:g} {parameter.unit}. Change the values or the bounds."
        )
    return array
