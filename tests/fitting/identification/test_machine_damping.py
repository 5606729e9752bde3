"""Dampings from damping ratios: exact where the stiffnesses are, bounded, and honest about what they see."""

import jax.numpy as jnp
import numpy as np
import pytest
from machine_cases import (
    FEW,
    PLACES,
    measured,
    nominal,
    small_study,
    space,
    true_values,
    truth,
)

from fitting.identification.machine_damping import damping_least_squares, least_disturbed
from fitting.identification.machine_unknowns import unknowns
from twin._checks import InputError

MANY = 20


def true_dampings():
    return true_values()[unknowns(space()).damping]


def machine_with_true_stiffness():
    values = np.array(space().values(nominal()))
    stiff = unknowns(space()).stiffness
    values[stiff] = true_values()[stiff]
    return space().with_values(nominal(), jnp.asarray(values))


def test_dampings_are_exact_where_stiffnesses_are_true():
    found = damping_least_squares(machine_with_true_stiffness(), measured(MANY), PLACES, space())
    np.testing.assert_allclose(found.value, true_dampings(), rtol=1e-8)
    assert found.rank == 11 and len(found.problems) == 2 * MANY and not found.on_bound.any()
    np.testing.assert_allclose(found.factors @ found.value, found.residual_damping, rtol=1e-8)
    made = found.machine(machine_with_true_stiffness())
    np.testing.assert_allclose(space().values(made), true_values(), rtol=1e-8)
    assert "rank 11" in repr(found)


def test_chosen_rows_and_weights_count():
    rows = np.arange(2 * MANY) % 2 == 0
    weights = np.where(np.arange(2 * MANY) < 30, 1.0, 0.0)
    found = damping_least_squares(truth(), measured(MANY), PLACES, space(), rows=rows, weights=weights)
    assert len(found.problems) == 15
    np.testing.assert_allclose(found.value, true_dampings(), rtol=1e-6)


def test_rows_of_little_residual_damping_are_dropped():
    everything = damping_least_squares(truth(), measured(MANY), PLACES, space())
    least = float(np.median(everything.residual_damping))
    found = damping_least_squares(truth(), measured(MANY), PLACES, space(), least=least)
    assert len(found.problems) == MANY and found.residual_damping.min() >= least


def test_wrong_stiffnesses_leave_dampings_within_their_bounds():
    found = damping_least_squares(nominal(), measured(MANY), PLACES, space())
    bounds = np.asarray([(p.lower, p.upper) for p in found.space.parameters])
    assert np.all((found.value >= bounds[:, 0]) & (found.value <= bounds[:, 1]))


def test_too_few_rows_show_in_the_rank():
    rows = np.arange(2 * FEW) < 4
    found = damping_least_squares(truth(), measured(), PLACES, space(), rows=rows)
    assert found.rank <= 4


def test_the_least_disturbed_rows_are_those_that_stiffnesses_move_least():
    study = small_study()
    chosen = least_disturbed(study, 5)
    total = study.total("NDD²")[:, unknowns(space()).stiffness].sum(axis=1)
    assert chosen.sum() == 5 and total[chosen].max() <= total[~chosen].min()
    with pytest.raises(InputError, match="count must be"):
        least_disturbed(study, 13)


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="weights has shape"):
        damping_least_squares(truth(), measured(), PLACES, space(), weights=np.ones(3))
    with pytest.raises(InputError, match="not negative"):
        damping_least_squares(truth(), measured(), PLACES, space(), weights=-np.ones(2 * FEW))
    with pytest.raises(InputError, match="No equation is left"):
        damping_least_squares(truth(), measured(), PLACES, space(), least=0.9)
    stiff = [space().paths[i] for i in unknowns(space()).stiffness]
    with pytest.raises(InputError, match="no damping"):
        damping_least_squares(truth(), measured(), PLACES, space().subset(stiff))
