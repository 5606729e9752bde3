"""Scaling curves, streams, odd samples and single modes, at sizes too small for any time to mean something."""

import json
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from tests.benchmarks import scaling_report
from tests.benchmarks.scaling import (
    Curve,
    Sizes,
    all_curves,
    as_dictionary,
    chain,
    crossover,
    gradient_of,
    jacobian_of,
    move,
)
from twin.modal import modes

TINY = Sizes(moves=(), responses=(1, 3), parameters=(), masses=(2, 4), starts=(1, 2), rounds=2)


def doubling(name: str, seconds: list[float]) -> Curve:
    sizes = tuple(2**i for i in range(len(seconds)))
    return Curve("made", name, "things", sizes, tuple((s, s, 3 * s) for s in seconds))


def test_exponents_of_a_power_law():
    curve = doubling("cubic", [1.0, 8.0, 64.0])
    assert curve.exponent == pytest.approx(3.0) and curve.last_exponent == pytest.approx(3.0)


def test_crossover_lies_where_the_lines_meet():
    here, there = doubling("here", [4.0, 4.0, 4.0, 4.0]), doubling("here", [1.0, 2.0, 4.0 * np.sqrt(2), 8.0])
    (other,) = as_dictionary([there])
    # In logarithms the other one gains 1.5 octaves from size 2 to 4, of which it lacks one.
    assert crossover(here, other) == pytest.approx(2 * 2 ** (1 / 1.5))
    assert crossover(doubling("here", [9.0] * 4), other) is None
    assert crossover(doubling("here", [0.5] * 4), other) == 1.0


def test_curves_are_measured_and_written(tmp_path: Path):
    curves = all_curves(TINY)
    assert [curve.group for curve in curves] == ["variants", "masses", "masses", "starts"]
    assert all(len(times) == 2 and min(times) > 0 for curve in curves for times in curve.seconds)
    pictures = scaling_report.write_pictures(curves, tmp_path)
    assert all((tmp_path / name).stat().st_size > 5000 for name in pictures) and len(pictures) == 3
    written = as_dictionary(curves)
    assert json.loads(json.dumps(written)) == written
    text = scaling_report.as_markdown(curves, pictures, written)
    assert all(curve.name in text for curve in curves)
    # A run is as fast as itself from its smallest size on.
    assert text.count("Ahead of the run compared with from") == len(curves) and "from 2 masses on" in text


def test_frequencies_of_the_chain():
    n = 5
    right = np.sqrt(1e6) * 2 * np.sin((2 * np.arange(n) + 1) * np.pi / (4 * n + 2)) / (2 * np.pi)
    np.testing.assert_allclose(modes(chain(jnp.full(n, 1e6))).frequency, right, rtol=1e-10)
    lowest, slope = gradient_of(n)()
    # All stiffnesses together scale the square of a frequency.
    np.testing.assert_allclose([lowest, np.sum(slope) * 1e6], [right[0], right[0] / 2], rtol=1e-9)


@pytest.mark.slow
def test_jacobian_is_along_relative_changes():
    slope, one = np.asarray(jacobian_of(1)()), move()
    from tests.benchmarks.rack_case import nominal

    call, step = eqx.filter_jit(one), 1e-5
    up, down = (np.asarray(call(jnp.asarray(nominal()).at[0].multiply(1 + s))) for s in (step, -step))
    difference = (up - down) / (2 * step)
    np.testing.assert_allclose(slope[..., 0], difference, atol=1e-4 * np.max(np.abs(difference)))


@pytest.mark.slow
def test_streams_give_the_same_results():
    from tests.benchmarks.scaling_streams import ONE, PROCESSES, TWO, streams, summary_rows

    found = streams(8, rounds=1)
    assert set(found.difference) == {ONE, TWO, PROCESSES} and max(found.difference.values()) <= 1e-12
    assert all(row.ratio is not None for row in summary_rows(found))


@pytest.mark.slow
def test_odd_samples_leave_the_others_as_they_are():
    from tests.benchmarks.odd_samples import odd_samples

    rows = odd_samples(64, rounds=1)
    assert len(rows) == 3 and all(row.ratio is not None for row in rows)


@pytest.mark.slow
def test_a_single_mode_is_the_one_of_all_modes():
    from tests.benchmarks.modal_update import modal_update

    rows = modal_update(16, rounds=1, differenced=2)
    assert len(rows) == 2 and all(row.ratio is not None for row in rows)


@pytest.mark.slow
def test_the_swarm_pays_more_for_the_curves():
    from tests.benchmarks.swarm_price import as_dictionary as plain
    from tests.benchmarks.swarm_price import as_markdown, curve_fits, summary_rows

    prices = curve_fits()
    assert all(row.met == "yes" for row in summary_rows(prices))
    assert all(str(price["swarm"]) in as_markdown(prices) for price in plain(prices))
