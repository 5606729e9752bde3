"""Leipe et al., eq. 3 to 10: the two load laws from the totals of both drive trains."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from fitting.identification.load_surface import fit_hyperbolic_damping, fit_root_stiffness, remaining_error
from fitting.residuals.load_surface import total_over_contacts
from twin._checks import InputError
from twin.laws import HyperbolicDamping, RootStiffness

STIFFNESS = RootStiffness(1.8709e7, 5.6406)  # eq. 6
DAMPING = HyperbolicDamping(9.5376e5, 148.3813, 2.0734e4)  # eq. 10
PAPER = {RootStiffness: 4.01, HyperbolicDamping: 4.51}
CASES = pytest.mark.parametrize(
    ("truth", "identify", "paths"),
    [
        (STIFFNESS, fit_root_stiffness, ("k1", "k2")),
        (DAMPING, fit_hyperbolic_damping, ("d1", "d2", "d3")),
    ],
)


@cache
def forces(points=24):
    """Both motor forces near the angle bisector, as Fig. 6 shows them: 8 to 100 % of 12.5 Nm, at 2·16/0.08488 per m."""
    mean = np.linspace(0.08, 1.0, points) * 12.5 * 2 * 16 / 0.08488
    apart = 1 + 0.1 * np.random.default_rng(0).standard_normal((2, points))
    return apart * mean


@CASES
def test_printed_parameters_come_back_from_clean_points(truth, identify, paths):
    found = identify(forces(), total_over_contacts(truth, forces()))
    for path in paths:
        assert found.result[path].value == pytest.approx(float(getattr(truth, path)), rel=1e-6)
    assert found.error_percent < 1e-6


@CASES
def test_remaining_error_of_scattered_points_is_at_most_the_papers(truth, identify, paths):
    clean = np.asarray(total_over_contacts(truth, forces()))
    scatter = np.random.default_rng(1).standard_normal(clean.size)
    # Scatter whose root mean square is 4 % of that of the totals, exactly.
    measured = clean + 0.04 * scatter * np.linalg.norm(clean) / np.linalg.norm(scatter)
    found = identify(forces(), measured)
    assert found.error_percent <= PAPER[type(truth)]
    assert found.error_percent <= remaining_error(truth, forces(), measured)


@pytest.mark.slow
@CASES
def test_intervals_of_the_curve_cover(truth, identify, paths):
    """95 % intervals of the law itself at two forces, over 100 repeats of 1 % scatter."""
    clean = np.asarray(total_over_contacts(truth, forces()))
    rng = np.random.default_rng(2)
    inside, count = 0, 0
    curve = jax.jit(lambda law: law(jnp.asarray([600.0, 3000.0])))
    slopes = jax.jit(jax.jacfwd(lambda x, law: law.__class__(*x)(jnp.asarray([600.0, 3000.0]))))
    for _ in range(100):
        found = identify(forces(), clean * (1 + 0.01 * rng.standard_normal(clean.size)))
        along = np.asarray(slopes(jnp.asarray(found.result.values), found.law))
        deviation = np.sqrt(np.diag(along @ found.result.covariance @ along.T))
        reach = stats.t.ppf(0.975, found.result.degrees_of_freedom)
        inside += int(np.sum(np.abs(curve(found.law) - curve(truth)) <= reach * deviation))
        count += 2
    assert 0.9 <= inside / count <= 0.99


def test_the_law_of_one_train_is_the_surface_where_the_other_carries_nothing():
    found = fit_root_stiffness(forces(), total_over_contacts(STIFFNESS, forces()))
    force = jnp.linspace(100.0, 4000.0, 7)
    split = found.surface(jnp.stack([force, jnp.zeros(7)])) - found.law(0.0)
    np.testing.assert_allclose(split, found.law(force), rtol=1e-12)


def test_bad_input_is_named():
    with pytest.raises(InputError, match="one row of"):
        fit_root_stiffness(np.ones((2, 5)), np.ones(4))
    with pytest.raises(InputError, match="not positive"):
        fit_root_stiffness(forces(), -np.ones(24))
    with pytest.raises(InputError, match="2 parameters"):
        fit_root_stiffness(np.ones((2, 1)), np.ones(1))
    with pytest.raises(InputError, match="finite"):
        fit_hyperbolic_damping(forces(), np.full(24, np.nan))
    with pytest.raises(InputError, match="All measured totals are zero"):
        remaining_error(STIFFNESS, forces(), np.zeros(24))
