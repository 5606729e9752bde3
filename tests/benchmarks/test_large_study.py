"""A tiny form of the large study: bad samples are marked, kills change nothing, the report says both."""

import numpy as np
import pytest

from tests.benchmarks import variant_case
from tests.benchmarks.large_study import as_markdown, large_study, rates


def test_bad_samples_are_marked_and_the_others_unchanged(tmp_path):
    values = variant_case.samples(24)
    spoiled, numbers = variant_case.with_bad_samples(values)
    clean = variant_case.compute(values, tmp_path / "clean", chunk_size=8, progress=False)
    marked = variant_case.compute(spoiled, tmp_path / "marked", chunk_size=8, progress=False)
    assert clean.success.all()
    assert np.max(np.abs(clean["final_error"])) < 1e-5
    status = marked.to_dataframe()["status"]
    assert {name: status[number] for name, number in numbers.items()} == {
        "nan": "sample_is_nan",
        "stiff": "done",
        "raises": "raised",
    }
    assert "the preload is beyond" in marked.messages[numbers["raises"]]
    others = np.setdiff1d(np.arange(24), list(numbers.values()))
    for name in clean.outputs:
        np.testing.assert_array_equal(clean[name][others], marked[name][others])
    assert len(rates(tmp_path / "clean")) == 1


@pytest.mark.slow
def test_tiny_study_with_kills(tmp_path):
    found = large_study(tmp_path, 40, 2, 32)
    assert found["digests_equal"]
    assert found["bad_samples"]["others_bitwise_equal"]
    assert "equal to that of the run let alone: yes" in as_markdown(found)
