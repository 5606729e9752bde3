"""NIST's certified nonlinear regressions: all 38 fits to six digits, plain, batched, bounded and rescaled."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from problems.nist_strd import NAMES, CertifiedFit, Coefficients, certified_fits

from fitting.fit import fit
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.solvers.stop import Stop
from twin.io.data import DataNotFound

QUICK = ("Misra1a", "Chwirut2", "MGH17")


@pytest.fixture(scope="module")
def fits() -> dict[str, CertifiedFit]:
    try:
        return certified_fits()
    except DataNotFound as missing:
        pytest.skip(str(missing))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in NAMES]
)
def test_certified_values_and_errors_from_both_starts(fits, name):
    certified = fits[name]
    for start in certified.starts:
        result = fit(certified.curve(), Coefficients(jnp.asarray(start)), certified.space(), max_steps=300)
        assert result.success, result.message
        assert certified.digits(result.values) >= 6
        # Rounding is a thousandth of Lanczos1's residual: judge its standard errors by a more exact sum of squares.
        exact = np.sqrt(_squares(certified, result.values) / (2 * result.cost)) if name == "Lanczos1" else 1.0
        assert certified.error_digits(exact * result.standard_errors) >= 4
        if name != "Lanczos1":
            assert 2 * result.cost == pytest.approx(certified.squares, rel=1e-9)


def _squares(certified: CertifiedFit, values: np.ndarray) -> float:
    """Lanczos1's least sum of squares around some values, in extended precision and from the decimals of the data."""
    x, y = ([np.longdouble(repr(float(v))) for v in data] for data in (certified.x, certified.y))
    b, x, y = (np.asarray(v, dtype=np.longdouble) for v in (values, x, y))
    r = b[0] * np.exp(-b[1] * x) + b[2] * np.exp(-b[3] * x) + b[4] * np.exp(-b[5] * x) - y
    jacobian = jax.jacfwd(certified.predictor)(jnp.asarray(values), jnp.asarray(certified.x))
    basis = np.linalg.qr(np.asarray(jacobian))[0]
    r = r.astype(float)
    return float(np.sum((r - basis @ (basis.T @ r)) ** 2))


class Lane(NamedTuple):
    """One run: padded to the most coefficients, of which the rest is held at zero."""

    number: np.ndarray
    start: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    units: np.ndarray


WIDTH = 9


def _lane(number: int, start: np.ndarray, reach: np.ndarray | None = None, units: np.ndarray | None = None) -> Lane:
    units = np.ones(start.size) if units is None else units
    bounds = (-np.inf, np.inf) if reach is None else reach
    pad = (0, WIDTH - start.size)
    lower, upper = (np.pad(np.broadcast_to(b, start.shape) / units, pad) for b in bounds)
    return Lane(np.asarray(number), np.pad(start / units, pad), lower, upper, np.pad(units, pad, constant_values=1.0))


def _stack(lanes: list[Lane]) -> Lane:
    return Lane(*(np.stack(leaves) for leaves in zip(*lanes, strict=True)))


@pytest.fixture(scope="module")
def batch(fits):
    """All data sets in one program: lanes in, values in certified units and reasons out."""
    certified = list(fits.values())
    rows = max(c.y.size for c in certified)

    def branch(c: CertifiedFit):
        def residual(b):
            r = c.predictor(b[: c.values.size], jnp.asarray(c.x)) - jnp.asarray(c.y)
            return jnp.concatenate([r, jnp.zeros(rows - r.size)])

        return residual

    branches = [branch(c) for c in certified]

    def objective(b, lane):
        return jax.lax.switch(lane.number, branches, b * lane.units)

    @eqx.filter_jit
    @eqx.filter_vmap
    def run(lane):
        options = {"lower": lane.lower, "upper": lane.upper}
        solution = optx.least_squares(
            objective, BoundedLevenbergMarquardt(), lane.start, lane, options=options, max_steps=301, throw=False
        )
        return solution.value * lane.units, solution.stats["reason"]

    def checked(lanes: list[Lane]):
        values, reasons = run(_stack(lanes))
        success = np.asarray((reasons == Stop.converged) | (reasons == Stop.at_precision))
        numbers = [int(lane.number) for lane in lanes]
        digits = [certified[k].digits(v[: certified[k].values.size]) for k, v in zip(numbers, values, strict=True)]
        return np.asarray(digits), success

    return checked


def _runs(fits):
    return [(k, certified, start) for k, certified in enumerate(fits.values()) for start in certified.starts]


@pytest.mark.slow
def test_all_in_one_batch(fits, batch):
    digits, success = batch([_lane(k, start) for k, _, start in _runs(fits)])
    assert np.sum((digits >= 6) & success) == 38


def test_trap_24_coefficients_in_units_fourteen_decades_apart(fits, batch):
    """No typical size is given: the scaling is the solver's."""
    for sign in (1.0, -1.0):
        units = [10.0 ** (7 * sign * (-1.0) ** np.arange(c.values.size)) for c in fits.values()]
        digits, success = batch([_lane(k, start, units=units[k]) for k, _, start in _runs(fits)])
        assert np.sum((digits >= 6) & success) == 38


def test_bounded_to_ten_times_the_certified_values(fits, batch):
    """Starts outside are moved to the bound."""
    lanes, moved = [], 0
    for k, certified, start in _runs(fits):
        reach = 10 * np.abs(certified.values)
        lower, upper = certified.values - reach, certified.values + reach
        inside = np.clip(start, lower, upper)
        moved += bool(np.any(inside != start))
        lanes.append(_lane(k, inside, (lower, upper)))
    digits, success = batch(lanes)
    assert moved == 6
    assert np.sum((digits >= 6) & success) == 38


def test_no_false_success_from_starts_nearby(fits, batch):
    random = np.random.default_rng(0)
    lanes = [_lane(k, start * random.uniform(0.9, 1.1, start.size)) for k, _, start in _runs(fits)]
    digits, success = batch(lanes)
    assert np.all(digits[success] >= 4)
    assert np.sum(success) >= 36
