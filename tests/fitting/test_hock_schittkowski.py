"""SLSQP against the collection of Hock and Schittkowski, and against SciPy's SLSQP on the same functions."""

import numpy as np
import pytest

from tests.problems.hock_schittkowski import PROBLEMS
from tests.problems.programme_runs import Run, SlsqpRunner, functions_of, run_scipy, stationarity

# Problem 13's minimum is a cusp of the feasible region: no multipliers exist there.
WITHOUT_MULTIPLIERS = ("HS13",)
# SciPy's default tolerance, and one that gives it as many digits as ours.
SCIPY_TOLERANCES = (1e-6, 1e-10)
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def ours() -> dict[str, Run]:
    runner = SlsqpRunner()
    return {problem.name: runner(problem) for problem in PROBLEMS}


@pytest.fixture(scope="module")
def theirs() -> dict[float, dict[str, Run]]:
    return {ftol: {problem.name: run_scipy(problem, ftol) for problem in PROBLEMS} for ftol in SCIPY_TOLERANCES}


def test_more_than_85_percent_are_solved(ours: dict[str, Run]):
    assert sum(run.solved for run in ours.values()) >= 0.85 * len(PROBLEMS)


def test_every_claimed_success_is_feasible_and_stationary(ours: dict[str, Run]):
    claims = {name: run for name, run in ours.items() if run.success and name not in WITHOUT_MULTIPLIERS}
    assert len(claims) >= 0.85 * len(PROBLEMS)
    assert {name: run.violation for name, run in claims.items() if run.violation > 1e-7} == {}
    assert {name: run.residual for name, run in claims.items() if run.residual > 1e-4} == {}


def test_what_is_solved_is_claimed(ours: dict[str, Run]):
    assert [name for name, run in ours.items() if run.solved and not run.success] == []


def test_no_evaluation_leaves_the_bounds(ours: dict[str, Run]):
    assert {name: run.outside for name, run in ours.items() if run.outside} == {}


@pytest.mark.parametrize("ftol", SCIPY_TOLERANCES)
def test_as_many_are_solved_as_by_scipy(ours: dict[str, Run], theirs: dict[float, dict[str, Run]], ftol: float):
    assert sum(run.solved for run in ours.values()) >= sum(run.solved for run in theirs[ftol].values())


@pytest.mark.parametrize("ftol", SCIPY_TOLERANCES)
def test_evaluations_are_no_more_than_scipys_in_the_median(
    ours: dict[str, Run], theirs: dict[float, dict[str, Run]], ftol: float
):
    both = [name for name in ours if ours[name].solved and theirs[ftol][name].solved]
    mine, other = (np.median([runs[name].evaluations for name in both]) for runs in (ours, theirs[ftol]))
    assert mine <= other


def test_padding_does_not_change_the_iterates(ours: dict[str, Run]):
    chosen = [problem for problem in PROBLEMS if problem.name in ("HS1", "HS6", "HS29", "HS35", "HS43", "HS71")]
    runner = SlsqpRunner(classes=((16, 8, 29),))
    for problem in chosen:
        assert runner(problem).evaluations == ours[problem.name].evaluations


def test_stationarity_is_that_of_the_stored_answer_and_not_of_the_start():
    problem = next(problem for problem in PROBLEMS if problem.name == "HS43")
    assert stationarity(problem, problem.solution) < 1e-6
    assert stationarity(problem, problem.start) > 1e-2
    assert functions_of(problem).inequalities == 3
