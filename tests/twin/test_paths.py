"""Dotted paths name the same number for reading and for writing, and say what there is when they name nothing."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.drives import ServoAxis
from twin.laws import CoulombFriction, PolynomialForce, SumFriction, ViscousFriction
from twin.paths import get_leaf, leaf_paths, set_leaves

AXIS = ServoAxis(
    mass=95.0,
    friction=SumFriction((ViscousFriction(200.0), CoulombFriction(20.0, 1e-3))),
    position_force=PolynomialForce(jnp.array([3.0, 4.0]), centre=0.1, span=0.5),
)
PATHS = (
    "mass",
    "friction.terms.0.viscous",
    "friction.terms.1.coulomb",
    "friction.terms.1.width",
    "gain",
    "offset",
    "position_force.coefficients.0",
    "position_force.coefficients.1",
    "position_force.centre",
    "position_force.span",
    "initial_position",
    "initial_velocity",
)


def test_lists_every_number():
    assert leaf_paths(AXIS) == PATHS


def test_reads_attributes_tuple_items_and_vector_entries():
    values = [float(get_leaf(AXIS, path)) for path in PATHS]
    assert values == [95.0, 200.0, 20.0, 1e-3, 1.0, 0.0, 3.0, 4.0, 0.1, 0.5, 0.0, 0.0]
    assert float(get_leaf(AXIS, "position_force.coefficients.-1")) == 4.0


@pytest.mark.parametrize("path", PATHS)
def test_writes_only_what_is_named(path):
    changed = set_leaves(AXIS, {path: 7.5})
    for other in PATHS:
        expected = 7.5 if other == path else float(get_leaf(AXIS, other))
        assert float(get_leaf(changed, other)) == expected
    assert jax.tree.structure(changed) == jax.tree.structure(AXIS)
    assert all(leaf.dtype == jnp.float64 for leaf in jax.tree.leaves(changed))


def test_writes_several_at_once_also_into_one_vector():
    changed = set_leaves(
        AXIS, {"position_force.coefficients.1": -1.0, "mass": 3.0, "position_force.coefficients.0": -2.0}
    )
    np.testing.assert_array_equal(changed.position_force.coefficients, [-2.0, -1.0])
    assert float(changed.mass) == 3.0


def test_a_path_and_an_attribute_name_the_same_leaf():
    assert set_leaves(AXIS, {"friction.terms.1.coulomb": 5.0}).friction.terms[1].coulomb == 5.0


def test_reads_and_writes_under_jit():
    doubled = jax.jit(lambda axis: set_leaves(axis, {"mass": 2 * get_leaf(axis, "mass")}))(AXIS)
    assert float(doubled.mass) == 190.0


def test_lists_and_dictionaries():
    model = {"drives": [AXIS, AXIS]}
    changed = set_leaves(model, {"drives.1.mass": 1.0})
    assert [float(axis.mass) for axis in changed["drives"]] == [95.0, 1.0]
    assert "drives.1.friction.terms.0.viscous" in leaf_paths(model)


@pytest.mark.parametrize("path", ["mas", "friction.coulomb", "friction.terms.2.viscous", "", "friction.terms.x"])
@pytest.mark.parametrize("use", [get_leaf, lambda model, path: set_leaves(model, {path: 1.0})])
def test_an_unknown_path_names_those_there_are(path, use):
    with pytest.raises(InputError) as caught:
        use(AXIS, path)
    message = str(caught.value)
    assert repr(path) in message
    for known in PATHS:
        assert known in message


def test_a_path_to_a_vector_asks_for_an_index():
    with pytest.raises(InputError, match=r"Add an index, as in 'position_force\.coefficients\.0'"):
        get_leaf(AXIS, "position_force.coefficients")


def test_an_index_beyond_the_vector():
    for use in (get_leaf, lambda model, path: set_leaves(model, {path: 1.0})):
        for index in ("2", "-3"):
            with pytest.raises(InputError, match=rf"index {index} is outside the array of shape \(2,\)"):
                use(AXIS, f"position_force.coefficients.{index}")


def test_a_number_has_no_index():
    with pytest.raises(InputError, match=r"'mass\.0': index 0 is outside the array of shape \(\)"):
        get_leaf(AXIS, "mass.0")


def test_a_path_to_a_module_is_no_number():
    with pytest.raises(InputError, match="names a SumFriction, not a number"):
        get_leaf(AXIS, "friction")


def test_a_long_list_is_cut_short():
    with pytest.raises(InputError, match=r"\.\.\. \(120 in all\)"):
        get_leaf([AXIS] * 10, "nothing")
