"""The published procedure as one call: its steps are those made one by one."""

import numpy as np
import pytest
from machine_cases import PLACES, measured, nominal, small_study, space

from fitting.identification.machine_damping import damping_least_squares, least_disturbed
from fitting.identification.machine_parts import solve_parts
from fitting.identification.machine_procedure import choose, identify_by_parts
from fitting.identification.machine_selection import ROBUST, select_stiffness
from twin._checks import InputError

EQUATIONS = 11


@pytest.fixture(scope="module")
def guided():
    return identify_by_parts(
        nominal(), measured(), PLACES, space(), seed=1, n=16, starts=4, equations=EQUATIONS, least=0.0
    )


@pytest.mark.slow
def test_one_call_does_what_its_steps_do(guided):
    np.testing.assert_array_equal(guided.sensitivity.indices.ST, small_study().indices.ST)
    searched = small_study().searched(0.01)
    runs = solve_parts(nominal(), measured(), PLACES, space(), searched, seed=1, starts=4)
    np.testing.assert_array_equal(runs.value, guided.runs.value)
    selection = select_stiffness(runs)
    np.testing.assert_array_equal(selection.value, guided.chosen.selection.value)
    stiff = selection.machine(nominal())
    rows = least_disturbed(small_study(), EQUATIONS)
    damping = damping_least_squares(stiff, measured(), PLACES, space(), rows=rows)
    np.testing.assert_array_equal(damping.value, guided.chosen.damping.value)
    found = np.asarray(space().values(guided.machine))
    kinds = np.asarray([".stiffness." in path for path in space().paths])
    np.testing.assert_array_equal(found[~kinds], damping.value)
    assert min(guided.seconds) > 0


@pytest.mark.slow
def test_another_rule_takes_the_same_runs_and_all_equations(guided):
    robust = choose(
        nominal(), measured(), PLACES, guided.runs, guided.sensitivity, rule=ROBUST, equations=None, least=0.0
    )
    assert robust.selection.rule == ROBUST
    assert len(robust.damping.problems) == len(small_study().problems)
    with pytest.raises(InputError, match="rule"):
        choose(nominal(), measured(), PLACES, guided.runs, guided.sensitivity, rule="least")


WRONG = [
    ({"rule": "papr"}, "rule must be"),
    ({"threshold": 5.0}, "threshold must be between 0 and 1"),
    ({"starts": 1}, "starts must be at least 2"),
    ({"equations": 20}, "equations must be between 1 and the 12"),
]


@pytest.mark.parametrize(("wrong", "message"), WRONG)
def test_what_cannot_be_is_refused_before_the_study(wrong, message):
    with pytest.raises(InputError, match=message):
        identify_by_parts(nominal(), measured(), PLACES, space(), **{"seed": 1, "equations": EQUATIONS} | wrong)


@pytest.mark.parametrize(("kind", "missing"), [("stiffness", "damping"), ("viscous", "stiffness")])
def test_a_space_of_one_kind_is_refused(kind, missing):
    some = space().subset([path for path in space().paths if f".{kind}." in path])
    with pytest.raises(InputError, match=f"no {missing}"):
        identify_by_parts(nominal(), measured(), PLACES, some, seed=1, equations=EQUATIONS)
