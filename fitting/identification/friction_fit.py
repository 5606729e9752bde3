"""A Stribeck law through measured points of friction over speed."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy.optimize import nnls

from fitting.fit import fit
from fitting.residuals.residual import AbstractResidual
from fitting.result import FitResult
from twin._checks import InputError, as_array, finite, positive
from twin.laws import AbstractStaticFriction, StribeckFriction, smooth_sign, stribeck_level
from twin.parameters import Parameter, ParameterSpace

# Stribeck velocities that are tried for a start.
_STARTS = 40
# Speeds at which a law is looked at, and the share of the torque by which it falls at least from one to the next.
_GRID, _LEAST_FALL = 400, 1e-9
# Standard errors are at least this share of the largest torque, so that points without noise can be fitted.
_LEAST_ERROR = 1e-9


class FrictionCurveResidual(AbstractResidual):
    """Friction of a law minus measured, over its standard error, at each speed. The model is the law itself."""

    speeds: Float[Array, "points"] = eqx.field(converter=as_array)
    """Speeds [rad/s or m/s]."""
    torques: Float[Array, "points"] = eqx.field(converter=as_array)
    """Measured friction, positive against positive motion [Nm or N]."""
    deviations: Float[Array, "points"] = eqx.field(converter=as_array)
    """Standard errors of the friction [Nm or N]."""

    def __check_init__(self):
        finite("speeds", self.speeds, "rad/s")
        finite("torques", self.torques, "N m")
        positive("deviations", self.deviations, "N m")

    def __call__(self, model: AbstractStaticFriction) -> Float[Array, "residuals"]:
        return (model(self.speeds) - self.torques) / self.deviations


def fit_stribeck(
    speeds: Float[ArrayLike, "points"],
    torques: Float[ArrayLike, "points"],
    deviations: Float[ArrayLike, "points"],
    *,
    width: float | None = None,
    exponent: float = 2.0,
    variance: str = "estimated",
) -> FitResult:
    """Coulomb and breakaway torque, Stribeck velocity and viscous coefficient from friction at several speeds.

    The start is the best of a row of Stribeck velocities, for each of which the other three follow from linear least
    squares without negative values.

    Args:
        speeds: speeds, none of them zero [rad/s].
        torques: friction [Nm].
        deviations: standard errors [Nm].
        width: speed over which the law turns at zero [rad/s]; a twentieth of the lowest speed if not given.
        exponent: shape δ of the fall [-], held.
        variance: as in `fit`.

    Returns:
        The fit; its model is a `StribeckFriction`. Where the points show no fall, breakaway and Coulomb torque are
        fitted as one, and a warning says so.

    Raises:
        InputError: fewer than four speeds, a speed of zero, a width or exponent that is not positive.
    """
    v, torque = np.asarray(speeds, dtype=float), np.asarray(torques, dtype=float)
    sizes = np.abs(v)
    if v.size < 4 or np.any(sizes == 0):
        raise InputError(
            f"A Stribeck law has four parameters, but there are {v.size} speeds, {np.count_nonzero(sizes == 0)} of "
            "them zero. Give at least four speeds other than zero."
        )
    error = np.maximum(np.asarray(deviations, dtype=float), _LEAST_ERROR * np.max(np.abs(torque)))
    turn = float(sizes.min()) / 20 if width is None else width
    positive("width", turn, "rad/s")
    positive("exponent", exponent)
    start = _start(v, torque, error, turn, exponent)
    size = float(np.max(np.abs(torque)))
    falling = ParameterSpace(
        [
            Parameter("coulomb", "N m", lower=0.0, size=size),
            Parameter("static", "N m", lower=0.0, size=size),
            Parameter(
                "stribeck_velocity",
                "rad/s",
                lower=float(sizes.min()) / 100,
                upper=100 * float(sizes.max()),
                scale="log",
            ),
            Parameter("viscous", "N m s/rad", lower=0.0, size=size / float(sizes.max())),
        ]
    )
    evidence = FrictionCurveResidual(v, torque, error)
    if _falls(start, sizes):
        found = fit(evidence, start, falling, variance=variance)
        if _falls(found.model, sizes):
            return found
    flat = ParameterSpace(
        [
            Parameter("coulomb", "N m", lower=0.0, size=size, tied=("static",)),
            Parameter("viscous", "N m s/rad", lower=0.0, size=size / float(sizes.max())),
        ]
    )
    level = start.coulomb
    level_start = StribeckFriction(level, level, start.stribeck_velocity, start.viscous, turn, exponent)
    found = fit(evidence, level_start, flat, variance=variance)
    remark = "The points show no fall from a breakaway torque: it was fitted as one with the Coulomb torque."
    return dataclasses.replace(found, warning=remark)


def _falls(law: StribeckFriction, sizes: np.ndarray) -> bool:
    """Whether a law falls anywhere between the slowest and the fastest speed."""
    torque = np.asarray(law(np.geomspace(float(sizes.min()), float(sizes.max()), _GRID)))
    return bool(np.min(np.diff(torque)) < -_LEAST_FALL * np.max(np.abs(torque)))


def _start(v: np.ndarray, torque: np.ndarray, error: np.ndarray, width: float, exponent: float) -> StribeckFriction:
    slowest, fastest = float(np.abs(v).min()), float(np.abs(v).max())
    tried = np.geomspace(slowest / 3, 3 * fastest, _STARTS)
    sign, surplus = (np.asarray(part) for part in _shapes(v, jnp.asarray(tried), width, exponent))
    fits = [nnls(np.stack([sign, row, v], axis=1) / error[:, None], torque / error) for row in surplus]
    best = int(np.argmin([cost for _, cost in fits]))
    coulomb, rest, viscous = fits[best][0]
    return StribeckFriction(coulomb, coulomb + rest, tried[best], viscous, width, exponent)


@jax.jit
def _shapes(v: Array, stribeck: Array, width: Array, exponent: Array) -> tuple[Array, Array]:
    """Unit Coulomb torque at the speeds, and unit surplus for each Stribeck velocity."""
    sign = smooth_sign(v, width)
    return sign, jax.vmap(lambda s: stribeck_level(v, 0.0, 1.0, s, exponent, width))(stribeck) * sign
