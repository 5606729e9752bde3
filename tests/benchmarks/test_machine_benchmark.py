"""The section on machines, at sizes too small for any time to mean something."""

import json

import numpy as np
import pytest

from fitting.identification.machine_study import IDENTIFICATION
from tests.benchmarks import machine_growth, machine_report
from tests.benchmarks.machine import MachineBenchmark, peers_of, problem_of, whole_study
from tests.benchmarks.machine_growth import Sizes, all_growth
from twin.structure.reference_machine import reference_machine

pytestmark = pytest.mark.slow

MODES = 6


@pytest.fixture(scope="module")
def found() -> MachineBenchmark:
    study = whole_study(problem_of(1, IDENTIFICATION[:1], MODES), seed=2, n=16, starts=3)
    sizes = Sizes(
        coordinates=(45, 62), parameters=(4, 5), starts=(2, 4), points=(8, 16), searched=4, runs=2, modes=2, rounds=1
    )
    return MachineBenchmark(study, peers_of(study, seed=2, starts=2, analyses=2), all_growth(1, sizes))


def test_the_peers_solve_the_same_problems(found: MachineBenchmark):
    assert found.peers.difference < 1e-7
    assert found.peers.as_good > 0.5
    assert found.peers.ours_as_good > 0.5


def test_every_step_is_timed(found: MachineBenchmark):
    assert np.isfinite(found.study.deviation)
    assert set(found.study.seconds) == set(found.study.first)
    assert all(seconds > 0 for seconds in found.study.seconds.values())


def test_the_section_can_be_written_down(found: MachineBenchmark):
    text = machine_report.as_markdown(found)
    assert all(step in text for step in (*found.study.seconds, *(row.name for row in found.growth)))
    written = json.loads(json.dumps(machine_report.as_dictionary(found)))
    assert written["solves"] == MODES * 3
    assert np.isfinite([row["exponent"] for row in written["growth"]]).all()


def test_a_machine_with_fewer_modes():
    machine = machine_growth.with_fewer_modes(reference_machine(), 45)
    assert sum(component.eigenvalues.size for component in machine.components.values()) == 45
    assert min(component.eigenvalues.size for component in machine.components.values()) >= 6


def test_rows_of_the_summary(found: MachineBenchmark):
    rows = {row.what: row for row in machine_report.summary_rows(found)}
    assert len(rows) == 5
    assert all(row.ratio is not None and row.ratio > 0 for row in rows.values())


def test_peers_that_solve_something_else_are_refused(found: MachineBenchmark):
    other = found._replace(peers=found.peers._replace(difference=1e-3))
    refused = [row for row in machine_report.summary_rows(other) if row.met == "refused"]
    assert len(refused) == 2
