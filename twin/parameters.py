"""Which parameters of a model are free, with their units, bounds and scales."""

from collections.abc import Iterable
from typing import Any, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, is_concrete, require_x64
from twin.paths import get_leaf, set_leaves

Model = TypeVar("Model")

# Starts of tied parameters that agree to this are taken to be equal; they may come from different sums.
_SAME = 1e-9
# By which share a start may exceed its bounds: rounding of the logarithmic scale.
_ROUNDING = 1e-12


def _as_paths(value: Any) -> Any:
    if isinstance(value, str):
        raise InputError(f"tied must be a tuple of paths, but is the text {value!r}. Write tied=({value!r},).")
    return tuple(value)


class Parameter(eqx.Module):
    """One free parameter: where it is in the model, its unit, bounds and scale.

    Args:
        path: dotted path into the model, as "friction.coulomb".
        unit: SI unit of the value.
        lower: lower bound, in the unit.
        upper: upper bound, in the unit.
        scale: "linear", or "log" for a value that is positive and may change by factors.
        size: typical magnitude on the linear scale.
        prior: mean and standard deviation of what is known beforehand, in the unit.
        tied: other paths that always take the same value.

    Raises:
        InputError: bounds the wrong way round, an unknown scale, a size or a prior that is not positive.
    """

    path: str = eqx.field(static=True)
    """Dotted path into the model, `friction.coulomb`; an index picks an element of a tuple or vector."""
    unit: str = eqx.field(static=True, default="")
    """SI unit of the value, for tables and files; nothing is converted."""
    lower: float = eqx.field(static=True, default=-float("inf"))
    """Lower bound, in the unit."""
    upper: float = eqx.field(static=True, default=float("inf"))
    """Upper bound, in the unit."""
    scale: str = eqx.field(static=True, default="linear")
    """"linear": the fit moves value / size. "log": it moves ln(value); the value stays positive."""
    size: float | None = eqx.field(static=True, default=None)
    """Typical magnitude of the value on the linear scale; if not given, its bounds' range or else 1."""
    prior: tuple[float, float] | None = eqx.field(static=True, default=None)
    """Mean and standard deviation of a Gaussian prior, in the unit."""
    tied: tuple[str, ...] = eqx.field(static=True, default=(), converter=_as_paths)
    """Other paths that always take the same value, such as the same mass in the models of several data sets."""

    def __check_init__(self):
        if not (isinstance(self.path, str) and isinstance(self.unit, str)):
            raise InputError(
                f"Parameter takes a path, a unit and then bounds, but path is {self.path!r} and unit is {self.unit!r}. "
                'Write Parameter("plant.mass", "kg", 10, 1000).'
            )
        if self.scale not in ("linear", "log"):
            raise InputError(f'{self.path}: scale must be "linear" or "log", but is {self.scale!r}.')
        if np.isnan(self.lower) or np.isnan(self.upper):
            raise InputError(f"{self.path}: a bound is NaN. Use infinity where there is no bound.")
        if not self.lower < self.upper:
            raise InputError(
                f"{self.path}: the lower bound {self.lower:g} is not below the upper bound {self.upper:g} {self.unit}. "
                "Exchange them, or leave the parameter out of the space to hold it fixed."
            )
        if self.scale == "log" and self.lower < 0:
            object.__setattr__(self, "lower", 0.0) if np.isneginf(self.lower) else _refuse_log(self)
        if self.size is not None and not (np.isfinite(self.size) and self.size > 0):
            raise InputError(f"{self.path}: size must be positive and finite, but is {self.size}.")
        if self.prior is not None and not (np.all(np.isfinite(self.prior)) and self.prior[1] > 0):
            raise InputError(f"{self.path}: prior must be (mean, positive standard deviation), but is {self.prior}.")

    @property
    def label(self) -> str:
        """Path and unit, for tables and axes."""
        return f"{self.path} [{self.unit}]" if self.unit else self.path

    def to_scaled(self, value: ArrayLike) -> Float[Array, "..."]:
        """From the value in SI to the variable that a solver moves."""
        return self._scaled(jnp, jnp.asarray(value))

    def from_scaled(self, scaled: ArrayLike) -> Float[Array, "..."]:
        """From the variable that a solver moves to the value in SI."""
        return self._unscaled(jnp, jnp.asarray(scaled))

    def slope(self, value: ArrayLike) -> Float[Array, "..."]:
        """Derivative of the value with respect to the scaled variable."""
        value = jnp.asarray(value)
        return value if self.scale == "log" else jnp.full_like(value, self._size())

    # Written once for JAX and for NumPy.
    def _scaled(self, numpy: Any, value: Any) -> Any:
        return numpy.log(value) if self.scale == "log" else value / self._size()

    def _unscaled(self, numpy: Any, scaled: Any) -> Any:
        return numpy.exp(scaled) if self.scale == "log" else scaled * self._size()

    def _size(self) -> float:
        if self.size is not None:
            return self.size
        span = self.upper - self.lower
        return span if np.isfinite(span) else 1.0


class ParameterSpace(eqx.Module):
    """An ordered set of free parameters of a model: the bridge between a model and a solver's vector.

    Args:
        parameters: the free parameters, in the order of the vector.

    Raises:
        InputError: no parameter, or a path that is there twice.
    """

    parameters: tuple[Parameter, ...]
    """The free parameters, in the order of the vector."""

    def __init__(self, parameters: Iterable[Parameter]):
        self.parameters = tuple(parameters)

    def __check_init__(self):
        if not self.parameters:
            raise InputError("A parameter space needs at least one parameter.")
        seen = set()
        for parameter in self.parameters:
            for path in (parameter.path, *parameter.tied):
                if path in seen:
                    raise InputError(
                        f"Parameter {path!r} is in the space twice. Remove one; a path is either free, or tied to one "
                        "other."
                    )
                seen.add(path)

    def __len__(self) -> int:
        return len(self.parameters)

    def __getitem__(self, path: str) -> Parameter:
        for parameter in self.parameters:
            if parameter.path == path:
                return parameter
        for parameter in self.parameters:
            if path in parameter.tied:
                raise InputError(f"{path!r} is tied to {parameter.path!r}. Ask for that one.")
        raise InputError(f"No free parameter {path!r}; the space has {', '.join(self.paths)}.")

    @property
    def paths(self) -> tuple[str, ...]:
        """Dotted paths, in order."""
        return tuple(p.path for p in self.parameters)

    @property
    def units(self) -> tuple[str, ...]:
        """Units, in order."""
        return tuple(p.unit for p in self.parameters)

    def named(self, mask: np.ndarray) -> str:
        """Paths that a mask over the parameters picks, for a message."""
        return ", ".join(path for path, named in zip(self.paths, mask, strict=True) if named)

    @property
    def lower(self) -> Float[Array, "parameters"]:
        """Lower bounds of the scaled vector."""
        return self._scaled_bounds("lower")

    @property
    def upper(self) -> Float[Array, "parameters"]:
        """Upper bounds of the scaled vector."""
        return self._scaled_bounds("upper")

    def values(self, model: Any) -> Float[Array, "parameters"]:
        """The free parameters' values in a model, SI; of tied ones the first's.

        Raises:
            InputError: if a path is not in the model.
        """
        require_x64()
        return jnp.stack([jnp.asarray(get_leaf(model, path)) for path in self.paths])

    def with_values(self, model: Model, values: Float[Array, "parameters"]) -> Model:
        """The model with its free parameters, and those tied to them, set to values in SI."""
        ties = enumerate(self.parameters)
        return set_leaves(model, {path: values[i] for i, p in ties for path in (p.path, *p.tied)})

    def pack(self, model: Any) -> Float[Array, "parameters"]:
        """The scaled vector of a model's free parameters."""
        return self.scaled(self.values(model))

    def unpack(self, model: Model, vector: Float[Array, "parameters"]) -> Model:
        """The model with its free parameters taken from a scaled vector."""
        return self.with_values(model, self.unscaled(vector))

    def scaled(self, values: Float[Array, "parameters"]) -> Float[Array, "parameters"]:
        """Values in SI to the scaled vector."""
        return jnp.stack([p.to_scaled(v) for p, v in zip(self.parameters, values, strict=True)])

    def unscaled(self, vector: Float[Array, "parameters"]) -> Float[Array, "parameters"]:
        """The scaled vector to values in SI."""
        return jnp.stack([p.from_scaled(v) for p, v in zip(self.parameters, vector, strict=True)])

    def scaled_rows(self, values: np.ndarray) -> np.ndarray:
        """`scaled` of many vectors (rows, parameters), outside of compiled code: any number, nothing to compile."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.stack([p._scaled(np, v) for p, v in zip(self.parameters, values.T, strict=True)], axis=1)

    def unscaled_rows(self, vectors: np.ndarray) -> np.ndarray:
        """`unscaled` of many vectors (rows, parameters) outside of compiled code."""
        with np.errstate(over="ignore", invalid="ignore"):
            return np.stack([p._unscaled(np, v) for p, v in zip(self.parameters, vectors.T, strict=True)], axis=1)

    def slopes(self, values: Float[Array, "parameters"]) -> Float[Array, "parameters"]:
        """Derivatives of the values with respect to the scaled vector."""
        return jnp.stack([p.slope(v) for p, v in zip(self.parameters, values, strict=True)])

    def subset(self, paths: Iterable[str]) -> "ParameterSpace":
        """The space of some of the parameters.

        Raises:
            InputError: if a path is not in the space.
        """
        return ParameterSpace([self[path] for path in paths])

    def prior_residual(self, values: Float[Array, "parameters"]) -> Float[Array, "priors"]:
        """(value - mean) / standard deviation of every parameter that has a prior."""
        rows = [(v - p.prior[0]) / p.prior[1] for p, v in zip(self.parameters, values, strict=True) if p.prior]
        return jnp.stack(rows) if rows else jnp.zeros((0,))

    def check_start(self, model: Any) -> None:
        """Raise unless the model's values are finite and within the bounds, and tied ones are equal.

        Raises:
            InputError: naming the parameter, its value and its bounds, or the two values that differ.
        """
        values = self.values(model)
        for parameter in self.parameters:
            _check_ties(parameter, model)
        if not is_concrete(values):
            return
        for parameter, value in zip(self.parameters, np.asarray(values), strict=True):
            if not np.isfinite(value):
                raise InputError(f"The start of {parameter.path} is {value}. Give the model a finite value.")
            # A fit that ended on a bound comes back from its logarithm with rounding.
            slack = _ROUNDING * abs(value)
            inside = parameter.lower - slack <= value <= parameter.upper + slack
            if not inside or (parameter.scale == "log" and value <= 0):
                raise InputError(
                    f"The start of {parameter.path} is {value:g} {parameter.unit}, outside its bounds "
                    f"[{parameter.lower:g}, {parameter.upper:g}]. Move the start inside, or widen the bounds."
                )

    def _scaled_bounds(self, side: str) -> Float[Array, "parameters"]:
        require_x64()
        values = jnp.asarray([getattr(p, side) for p in self.parameters], dtype=jnp.float64)
        return self.scaled(values)


def _check_ties(parameter: Parameter, model: Any) -> None:
    first = get_leaf(model, parameter.path)
    for path in parameter.tied:
        other = get_leaf(model, path)
        if not (is_concrete(first) and is_concrete(other)):
            continue
        a, b = float(first), float(other)
        if not abs(a - b) <= _SAME * max(abs(a), abs(b)) and np.isfinite(a):
            raise InputError(
                f"{parameter.path} and {path} are tied, but start at {a:.10g} and {b:.10g} {parameter.unit}. Give both "
                f"one value; space.with_values(model, space.values(model)) takes that of {parameter.path} for both."
            )


def _refuse_log(parameter: Parameter) -> None:
    raise InputError(
        f"{parameter.path}: the lower bound {parameter.lower:g} is negative, but the scale is log. "
        "Use a lower bound of at least zero, or the linear scale."
    )
