"""What-if sweeps: any result of a model over one or two of its parameters, computed in one batch."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, finite, require_x64
from twin.parameters import Parameter, ParameterSpace
from twin.paths import get_leaf, set_leaves

if TYPE_CHECKING:
    import pandas as pd


@dataclasses.dataclass(frozen=True, repr=False)
class Sweep:
    """Results over a grid of one or two parameters. Shows itself as a table in a notebook."""

    parameters: tuple[Parameter, ...]
    """What was varied, one or two."""
    values: tuple[np.ndarray, ...]
    """Values of each, SI, or factors on the present value where the sweep is relative."""
    present: tuple[float, ...]
    """Value of each in the model itself, SI."""
    relative: bool
    """Whether the values are factors."""
    results: dict[str, np.ndarray]
    """Results by name, each in the shape of the grid (values of the first, values of the second); NaN where a lane
    failed."""
    units: dict[str, str]
    """Units of the results that have one given."""

    @property
    def failed(self) -> np.ndarray:
        """Where any of the results is NaN, in the shape of the grid."""
        return np.any([np.isnan(values) for values in self.results.values()], axis=0)

    def __getitem__(self, name: str) -> np.ndarray:
        """One result in the shape of the grid.

        Raises:
            InputError: if there is no result of that name.
        """
        if name not in self.results:
            raise InputError(f"The sweep has no result {name!r}; it has {', '.join(self.results)}.")
        return self.results[name]

    def label(self, name: str) -> str:
        """Name and unit of a result."""
        self[name]
        return f"{name} [{self.units[name]}]" if self.units.get(name) else name

    def axis_label(self, axis: int) -> str:
        """Name and unit of a swept parameter; over its present value in a relative sweep."""
        parameter = self.parameters[axis]
        return f"{parameter.path} / ({self._now(axis)})" if self.relative else parameter.label

    def to_dataframe(self) -> "pd.DataFrame":
        """Table with one row per point: the parameters in SI, the factors of a relative sweep, the results, and a
        remark where a result is NaN."""
        import pandas as pd

        grid = [axis.ravel() for axis in np.meshgrid(*self.values, indexing="ij")]
        table = {}
        for parameter, values, now in zip(self.parameters, grid, self.present, strict=True):
            table[parameter.label] = values * now if self.relative else values
            if self.relative:
                table[f"{parameter.path} [relative]"] = values
        table |= {self.label(name): values.ravel() for name, values in self.results.items()}
        flat = {name: values.ravel() for name, values in self.results.items()}
        missing = [[name for name, values in flat.items() if np.isnan(values[i])] for i in range(grid[0].size)]
        table["remark"] = [f"NaN: {', '.join(names)}" if names else "" for names in missing]
        return pd.DataFrame(table)

    def _now(self, axis: int) -> str:
        return f"{self.present[axis]:g} {self.parameters[axis].unit}".strip()

    def _facts(self) -> str:
        names = " and ".join(f"{p.path} (now {self._now(i)})" for i, p in enumerate(self.parameters))
        lost = int(np.count_nonzero(self.failed))
        failed = f" {lost} of {self.failed.size} points have a result that is NaN." if lost else ""
        return f"Sweep of {names}: {self.failed.size} points.{failed}"

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(index=False, float_format=lambda x: f"{x:.6g}")
        return f"<div><p>{self._facts()}</p>{table}</div>"

    def __repr__(self) -> str:
        return f"{self.to_dataframe().to_string(index=False, float_format=lambda x: f'{x:.6g}')}\n{self._facts()}"


def sweep(
    model: Any,
    function: Callable[[Any], Any],
    over: "Mapping[str, ArrayLike | Sequence] | Mapping[Parameter, ArrayLike | Sequence]",
    *,
    space: ParameterSpace | None = None,
    relative: bool = False,
    units: Mapping[str, str] | None = None,
    batch_size: int | None = None,
) -> Sweep:
    """A result of a model over values of one parameter, or over a grid of two.

    All points are computed together, in one compiled program. It is compiled once for each function, structure of the
    model and number of values: define the function once at the top level, as a new lambda compiles anew.

    Args:
        model: any module.
        function: from a model to a scalar, or to a NamedTuple, dict or module of scalars; pure JAX.
        over: values of each parameter, by its dotted path or by a `Parameter`, whose unit labels the table, whose
            bounds the values must keep, and whose ties follow.
        space: where the parameters of bare paths are looked up, for their units, bounds and ties.
        relative: the values are factors on the present value.
        units: units of the results by name, for tables and plots.
        batch_size: points computed side by side; for memory, or where some points take much longer than others. The
            last batch is filled up. None: all at once.

    Returns:
        The results. A point that fails is NaN there, and marked in the table.

    Raises:
        InputError: 64-bit mode off, an unknown path, none or more than two parameters, values that are none, no vector
            or not finite or out of bounds, a present value of zero in a relative sweep, results that are not scalars, a
            unit for a result that there is not, a batch size below one.
    """
    require_x64()
    if not 1 <= len(over) <= 2:
        raise InputError(f"A sweep is over one or two parameters, but {len(over)} were given. Sweep two at a time.")
    if batch_size is not None and batch_size < 1:
        raise InputError(f"batch_size must be at least 1, but is {batch_size}.")
    parameters = tuple(_parameter(key, space) for key in over)
    present = tuple(float(get_leaf(model, parameter.path)) for parameter in parameters)
    values = tuple(_values(p, v, now, relative) for p, v, now in zip(parameters, over.values(), present, strict=True))
    absolute = [axis * now for axis, now in zip(values, present, strict=True)] if relative else values
    points = jnp.stack([jnp.asarray(axis.ravel()) for axis in np.meshgrid(*absolute, indexing="ij")])
    paths = tuple((parameter.path, *parameter.tied) for parameter in parameters)
    shape = tuple(axis.size for axis in values)
    found = _named(_compute(model, function, paths, points, batch_size), shape)
    for name in units or {}:
        if name not in found:
            raise InputError(f"units names the result {name!r}, but the results are {', '.join(found)}.")
    return Sweep(parameters, values, present, relative, found, dict(units or {}))


@eqx.filter_jit
def _compute(
    model: Any,
    function: Callable[[Any], Any],
    paths: tuple[tuple[str, ...], ...],
    points: Float[Array, "parameters points"],
    batch_size: int | None,
) -> Any:
    """Results at all points, in their own structure with a leading axis."""

    def at(point: Array) -> Any:
        found = function(set_leaves(model, {path: point[i] for i, tied in enumerate(paths) for path in tied}))
        return jax.tree.map(_scalar, found)

    lanes = points.T
    if batch_size is None:
        return jax.vmap(at)(lanes)
    count = lanes.shape[0]
    batches = -(-count // batch_size)
    filled = jnp.concatenate([lanes, jnp.broadcast_to(lanes[-1], (batches * batch_size - count, lanes.shape[1]))])
    found = jax.lax.map(jax.vmap(at), filled.reshape(batches, batch_size, -1))
    return jax.tree.map(lambda rows: rows.reshape(batches * batch_size)[:count], found)


def _scalar(value: Any) -> Array:
    if jnp.ndim(value) != 0:
        raise InputError(
            f"The function of a sweep returned an array of shape {jnp.shape(value)}, but each result must be one "
            "number. Reduce it, for instance by a measure of twin.performance."
        )
    return jnp.asarray(value, dtype=jnp.float64)


def _named(found: Any, shape: tuple[int, ...]) -> dict[str, np.ndarray]:
    named = {}
    for keys, values in jax.tree_util.tree_leaves_with_path(found):
        parts = [str(getattr(k, "name", getattr(k, "key", getattr(k, "idx", k)))) for k in keys]
        named[".".join(parts) or "value"] = np.asarray(values).reshape(shape)
    if not named:
        raise InputError("The function of a sweep returned nothing. Return a number, or several by name.")
    return named


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
