"""Moré, Garbow and Hillstrom's test problems (ACM TOMS 7(1), 1981): all 35, as least-squares problems.

Least sums of squares are the published ones, refined where they are not zero; other stationary points, all with a
positive semi-definite Hessian or at infinity, are listed too, as a solver that ends there has not failed.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from problems import more_garbow_hillstrom_fixed as fixed
from problems import more_garbow_hillstrom_scalable as scalable


@dataclass(frozen=True)
class Problem:
    """One problem."""

    name: str
    """Name and dimension."""
    residual: Callable
    """Residual as a function of x."""
    start: np.ndarray
    """Standard start."""
    squares: float
    """Least sum of squares."""
    local: tuple[float, ...] = ()
    """Sums of squares at other stationary points, or their infimum where they lie at infinity."""

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.start.size

    @property
    def rows(self) -> int:
        """Number of residuals."""
        return int(np.asarray(self.residual(jnp.asarray(self.start))).size)

    def solved(self, squares: ArrayLike) -> bool:
        """Whether a sum of squares is the least one."""
        return bool(np.asarray(squares) <= self.squares * (1 + 1e-6) + 1e-18)

    def stationary(self, squares: ArrayLike) -> bool:
        """Whether a sum of squares is the least one or a known other one."""
        return self.solved(squares) or any(abs(float(squares) - other) <= 1e-4 * other for other in self.local)


def _problem(name, residual, start, squares, *local):
    return Problem(name, residual, np.asarray(start, dtype=float), squares, local)


def _index(n):
    return np.arange(1.0, n + 1)


def _boundary_start(n):
    t = _index(n) / (n + 1)
    return t * (t - 1)


_FIXED = (
    _problem("Rosenbrock", fixed.rosenbrock, [-1.2, 1], 0.0),
    _problem("Freudenstein and Roth", fixed.freudenstein_roth, [0.5, -2], 0.0, 48.98425367924),
    _problem("Powell badly scaled", fixed.powell_badly_scaled, [0, 1], 0.0),
    _problem("Brown badly scaled", fixed.brown_badly_scaled, [1, 1], 0.0),
    _problem("Beale", fixed.beale, [1, 1], 0.0, 0.452008929),
    _problem("Jennrich and Sampson", fixed.jennrich_sampson, [0.3, 0.4], 124.3621823556, 259.580190134),
    _problem("helical valley", fixed.helical_valley, [-1, 0, 0], 0.0),
    _problem("Bard", fixed.bard, [1, 1, 1], 8.214877306579e-3, 17.42869333),
    _problem("Gaussian", fixed.gaussian, [0.4, 1, 0], 1.127932769619e-8),
    _problem("Meyer", fixed.meyer, [0.02, 4000, 250], 87.94585517008),
    _problem("Gulf", fixed.gulf, [5, 2.5, 0.15], 0.0),
    _problem("Box", fixed.box, [0, 10, 20], 0.0),
    _problem("Powell singular", fixed.powell_singular, [3, -1, 0, 1], 0.0),
    _problem("Wood", fixed.wood, [-3, -1, -3, -1], 0.0),
    _problem("Kowalik and Osborne", fixed.kowalik_osborne, [0.25, 0.39, 0.415, 0.39], 3.075056038492e-4, 1.02734e-3),
    _problem("Brown and Dennis", fixed.brown_dennis, [25, 5, -5, -1], 85822.20162636),
    _problem("Osborne 1", fixed.osborne_1, [0.5, 1.5, -1, 0.01, 0.02], 5.464894697483e-5),
    _problem("Biggs", fixed.biggs, [1, 2, 1, 1, 1, 1], 0.0, 5.655649925e-3),
    _problem(
        "Osborne 2",
        fixed.osborne_2,
        [1.3, 0.65, 0.65, 0.7, 0.6, 3, 5, 7, 2, 4.5, 5.5],
        4.013773629355e-2,
        1.789813586881,
    ),
)
_SCALABLE = (
    _problem("Watson 6", scalable.watson, np.zeros(6), 2.287670053552e-3),
    _problem("Watson 9", scalable.watson, np.zeros(9), 1.399760138098e-6),
    _problem("Watson 12", scalable.watson, np.zeros(12), 4.722381105e-10),
    _problem("extended Rosenbrock 8", scalable.extended_rosenbrock, np.tile([-1.2, 1], 4), 0.0),
    _problem("extended Powell singular 8", scalable.extended_powell_singular, np.tile([3, -1, 0, 1], 2), 0.0),
    _problem("penalty I 4", scalable.penalty_1, _index(4), 2.249977500900e-5),
    _problem("penalty I 10", scalable.penalty_1, _index(10), 7.087651467090e-5),
    _problem("penalty II 4", scalable.penalty_2, np.full(4, 0.5), 9.376293007355e-6),
    _problem("penalty II 10", scalable.penalty_2, np.full(10, 0.5), 2.936605374567e-4),
    _problem("variably dimensioned 10", scalable.variably_dimensioned, 1 - _index(10) / 10, 0.0),
    _problem("trigonometric 10", scalable.trigonometric, np.full(10, 0.1), 0.0, 2.795056e-5, 4.218634e-5, 8.788225e-4),
    _problem("Brown almost linear 10", scalable.brown_almost_linear, np.full(10, 0.5), 0.0, 1.0),
    _problem("discrete boundary value 10", scalable.discrete_boundary_value, _boundary_start(10), 0.0),
    _problem("discrete integral equation 10", scalable.discrete_integral_equation, _boundary_start(10), 0.0),
    _problem("Broyden tridiagonal 10", scalable.broyden_tridiagonal, -np.ones(10), 0.0),
    _problem("Broyden banded 10", scalable.broyden_banded, -np.ones(10), 0.0),
    _problem("linear, full rank", scalable.linear_full_rank, np.ones(5), 15.0),
    _problem("linear, rank 1", scalable.linear_rank_1, np.ones(5), 20 * 19 / (2 * 41)),
    _problem("linear, rank 1, zeros", scalable.linear_rank_1_zeros, np.ones(5), (400 + 60 - 6) / (2 * 37)),
    _problem("Chebyquad 8", scalable.chebyquad, _index(8) / 9, 3.516873725678e-3),
    _problem("Chebyquad 9", scalable.chebyquad, _index(9) / 10, 0.0),
    _problem("Chebyquad 10", scalable.chebyquad, _index(10) / 11, 4.772713696e-3, 6.503954801e-3, 9.500628850e-3),
)
PROBLEMS = {problem.name: problem for problem in _FIXED + _SCALABLE}
