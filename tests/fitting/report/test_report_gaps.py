"""Lines are not drawn across samples that were left out."""

import numpy as np

from fitting.report.thinning import extremes, with_gaps


def test_a_gap_breaks_the_line_also_in_a_thinned_record():
    times = np.concatenate([np.arange(5000), np.arange(6000, 9000)]) * 1e-3
    values = np.sin(times)
    for pixels in (100_000, 50):
        kept = extremes((values,), pixels)
        drawn, shown = with_gaps(times, kept, values)
        (gap,) = np.flatnonzero(np.isnan(shown))
        assert 4.999 <= drawn[gap] <= 6.0
        assert np.all(np.diff(drawn) >= 0)
        np.testing.assert_array_equal(shown[~np.isnan(shown)], values[kept])


def test_an_even_record_is_left_alone():
    times = np.arange(100) * 1e-3
    kept = np.arange(100)
    np.testing.assert_array_equal(with_gaps(times, kept, times)[1], times)
