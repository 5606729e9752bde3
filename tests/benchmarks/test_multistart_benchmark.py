"""The sections on many starts and on swarms, at sizes too small for any time to mean something."""

import numpy as np
import pytest

from tests.benchmarks.drive_case import Case, drive_case
from tests.benchmarks.multistart import (
    BATCH,
    LOOP,
    THROUGHOUT,
    Price,
    Speed,
    as_dictionary,
    as_markdown,
    multistart_speeds,
    one_bad_start,
    summary_rows,
)
from tests.benchmarks.swarm import Ledger
from tests.benchmarks.swarm import summary_rows as swarm_rows

pytestmark = pytest.mark.slow
SIZES = {"counts": (1, 4), "loop": 2, "throughout": 1, "rounds": 1}


@pytest.fixture(scope="module")
def case() -> Case:
    return drive_case(60)


@pytest.fixture(scope="module")
def found(case: Case) -> dict[str, tuple[list[Speed], Price]]:
    return {"tiny": (multistart_speeds(case, **SIZES), one_bad_start(case, starts=4, rounds=1))}


def test_rows_of_the_summary(found: dict[str, tuple[list[Speed], Price]]):
    loop, throughout, bad = summary_rows(found)
    assert (loop.peer, loop.least) == (LOOP, 10.0) and (throughout.peer, throughout.least) == (THROUGHOUT, 100.0)
    assert bad.most == 1.5 and bad.agreement.endswith("yes")
    assert all(row.ratio is not None and row.ratio > 0 for row in (loop, throughout, bad))


def test_the_section_can_be_written_down(found: dict[str, tuple[list[Speed], Price]]):
    text = as_markdown(found)
    assert all(name in text for name in (BATCH, LOOP, THROUGHOUT, "tiny"))
    assert as_dictionary(found)["tiny"]["one_bad_start"]["unchanged"]


def test_a_model_with_another_residual_is_refused(case: Case):
    other = case._replace(throughout=lambda vector: 1.01 * np.asarray(case.throughout(vector)))
    speeds = multistart_speeds(other, **SIZES)
    rows = summary_rows({"tiny": (speeds, Price([1.0], [1.0], True))})
    assert [row.met for row in rows if row.peer == THROUGHOUT] == ["refused"]


def test_a_swarm_that_does_not_get_there_gives_a_lower_bound():
    ledger = [
        Ledger("p", "first", 10, 1.0, True),
        Ledger("p", "second", 5, 2.0, False),
        Ledger("p", "swarm of 40", 1000, 3.0, False),
    ]
    evaluations, seconds = swarm_rows(ledger)
    assert (evaluations.ratio, seconds.ratio) == (100.0, 3.0)
    assert "lower bound" in evaluations.agreement and "first" in evaluations.what
