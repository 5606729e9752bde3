"""The section on first use, once through; no time means anything here."""

import json

import pytest

from tests.benchmarks.first_use import (
    ALONE,
    CACHES,
    IMPORTS,
    FirstUse,
    as_dictionary,
    as_markdown,
    first_use,
    summary_rows,
)

pytestmark = pytest.mark.slow
LIGHT = "drivetwin --help"


@pytest.fixture(scope="module")
def found() -> FirstUse:
    return first_use(1, {name: IMPORTS[name] for name in (ALONE, LIGHT)}, ["simulation"])


def test_programs_are_taken_from_a_filled_cache_only(found: FirstUse):
    taken = {(row.task, row.cache): row.taken for row in found.results}
    assert set(taken) == {("simulation", cache) for cache in CACHES}
    for (_, cache), programs in taken.items():
        assert (programs > 0) == (cache == "filled")


def test_the_cache_leaves_the_results_as_they_are(found: FirstUse):
    assert max(row.difference for row in found.results) < 1e-9


def test_the_parts_make_up_the_whole(found: FirstUse):
    for row in found.results:
        assert row.imports > 0 and row.compile > 0 and row.run > 0
        assert row.imports + row.trace + row.compile <= row.total.max * 1.001


def test_the_section_can_be_written_down(found: FirstUse):
    assert {row.name: row.ratio for row in found.imports}[ALONE] == 1.0
    text = as_markdown(found)
    assert all(name in text for name in [ALONE, LIGHT, "simulation", *CACHES])
    assert json.loads(json.dumps(as_dictionary(found))) == as_dictionary(found)


def test_rows_of_the_summary(found: FirstUse):
    imports, first = summary_rows(found)
    assert LIGHT in imports.what and imports.most == 2.0
    assert "simulation" in first.what and first.ratio > 0 and not first.goal
