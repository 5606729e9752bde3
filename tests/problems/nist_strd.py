"""NIST's certified nonlinear regressions (Statistical Reference Datasets, lower and average difficulty) as fits.

Predictors are written here as the files state them; data, starts and certified values come from the data folder.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from fitting.residuals.residual import AbstractResidual
from twin.io.data import data_file
from twin.parameters import Parameter, ParameterSpace


def _chwirut(b, x):
    return jnp.exp(-b[0] * x) / (b[1] + b[2] * x)


def _danwood(b, x):
    return b[0] * x ** b[1]


def _enso(b, x):
    def wave(cosine, sine, period):
        return cosine * jnp.cos(2 * jnp.pi * x / period) + sine * jnp.sin(2 * jnp.pi * x / period)

    return b[0] + wave(b[1], b[2], 12.0) + wave(b[4], b[5], b[3]) + wave(b[7], b[8], b[6])


def _gauss(b, x):
    first = b[2] * jnp.exp(-((x - b[3]) ** 2) / b[4] ** 2)
    return b[0] * jnp.exp(-b[1] * x) + first + b[5] * jnp.exp(-((x - b[6]) ** 2) / b[7] ** 2)


def _hahn(b, x):
    return (b[0] + x * (b[1] + x * (b[2] + x * b[3]))) / (1 + x * (b[4] + x * (b[5] + x * b[6])))


def _kirby(b, x):
    return (b[0] + x * (b[1] + x * b[2])) / (1 + x * (b[3] + x * b[4]))


def _lanczos(b, x):
    return b[0] * jnp.exp(-b[1] * x) + b[2] * jnp.exp(-b[3] * x) + b[4] * jnp.exp(-b[5] * x)


def _mgh17(b, x):
    return b[0] + b[1] * jnp.exp(-x * b[3]) + b[2] * jnp.exp(-x * b[4])


def _misra_a(b, x):
    return b[0] * (1 - jnp.exp(-b[1] * x))


def _misra_b(b, x):
    return b[0] * (1 - (1 + b[1] * x / 2) ** -2)


def _misra_c(b, x):
    return b[0] * (1 - (1 + 2 * b[1] * x) ** -0.5)


def _misra_d(b, x):
    return b[0] * b[1] * x / (1 + b[1] * x)


def _nelson(b, x):
    return b[0] - b[1] * x[0] * jnp.exp(-b[2] * x[1])


def _roszman(b, x):
    return b[0] - b[1] * x - jnp.arctan(b[2] / (x - b[3])) / jnp.pi


_PREDICTORS: dict[str, Callable] = {
    "Chwirut1": _chwirut,
    "Chwirut2": _chwirut,
    "DanWood": _danwood,
    "ENSO": _enso,
    "Gauss1": _gauss,
    "Gauss2": _gauss,
    "Gauss3": _gauss,
    "Hahn1": _hahn,
    "Kirby2": _kirby,
    "Lanczos1": _lanczos,
    "Lanczos2": _lanczos,
    "Lanczos3": _lanczos,
    "MGH17": _mgh17,
    "Misra1a": _misra_a,
    "Misra1b": _misra_b,
    "Misra1c": _misra_c,
    "Misra1d": _misra_d,
    "Nelson": _nelson,
    "Roszman1": _roszman,
}
NAMES = tuple(_PREDICTORS)


class Coefficients(eqx.Module):
    """The model of a curve: nothing but its coefficients."""

    b: Float[Array, "coefficients"]
    """Coefficients b, in the units of `Curve.units`."""


class Curve(AbstractResidual):
    """Predicted minus measured values of a curve."""

    predictor: Callable = eqx.field(static=True)
    """Function of coefficients and x."""
    x: Float[Array, "*variables samples"]
    """Independent variable or variables."""
    y: Float[Array, "samples"]
    """Measured values."""
    units: Float[Array, "coefficients"]
    """Units of the model's coefficients: the predictor takes b·units."""

    def __call__(self, model: Coefficients) -> Float[Array, "samples"]:
        return self.predictor(model.b * self.units, self.x) - self.y


@dataclass(frozen=True)
class CertifiedFit:
    """One data set with its certified answer."""

    name: str
    """Name at NIST."""
    predictor: Callable
    """Function of coefficients and x."""
    x: np.ndarray
    """Independent variable or variables (samples,) or (variables, samples)."""
    y: np.ndarray
    """Measured values; the logarithm of them where the model is for that (samples,)."""
    starts: tuple[np.ndarray, np.ndarray]
    """Far and near start."""
    values: np.ndarray
    """Certified estimates."""
    standard_errors: np.ndarray
    """Certified standard deviations of the estimates."""
    squares: float
    """Certified residual sum of squares."""

    def curve(self, units: ArrayLike = 1.0) -> Curve:
        """The residual, for a model whose coefficients are in some units."""
        units = jnp.broadcast_to(jnp.asarray(units, dtype=float), self.values.shape)
        return Curve(self.predictor, jnp.asarray(self.x), jnp.asarray(self.y), units)

    def space(self) -> ParameterSpace:
        """All coefficients free, without bounds and without a typical size."""
        return ParameterSpace([Parameter(f"b.{i}") for i in range(self.values.size)])

    def digits(self, values: ArrayLike) -> float:
        """Correct digits of the worst estimate: NIST's log relative error, at most 11 as certified."""
        return _digits(values, self.values)

    def error_digits(self, standard_errors: ArrayLike) -> float:
        """Correct digits of the worst standard error."""
        return _digits(standard_errors, self.standard_errors)


def _digits(found: ArrayLike, certified: np.ndarray) -> float:
    errors = np.abs(np.asarray(found) - certified) / np.abs(certified)
    worst = float(np.max(np.where(np.isfinite(errors), errors, np.inf)))
    return float(np.clip(-np.log10(max(worst, 1e-11)), 0.0, 11.0))


def certified_fits() -> dict[str, CertifiedFit]:
    """All data sets, by name.

    Raises:
        DataNotFound: if the data folder does not hold them.
    """
    stored = json.loads(data_file("nist_strd/nist_strd.json").read_text(encoding="utf-8"))
    return {name: _certified_fit(name, stored[name]) for name in NAMES}


def _certified_fit(name: str, stored: dict) -> CertifiedFit:
    columns = np.asarray(stored["data"], dtype=float).T
    y = np.log(columns[0]) if stored["model"].startswith("log[y]") else columns[0]
    return CertifiedFit(
        name=name,
        predictor=_PREDICTORS[name],
        x=columns[1] if len(columns) == 2 else columns[1:],
        y=y,
        starts=(np.asarray(stored["start1"]), np.asarray(stored["start2"])),
        values=np.asarray(stored["certified"]),
        standard_errors=np.asarray(stored["certified_sd"]),
        squares=stored["rss"],
    )
