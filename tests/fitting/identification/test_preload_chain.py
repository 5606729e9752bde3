"""From sweeps of a linear table at several preloads back to its laws, and what a sweep refuses."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from preload_records import DRIVE, RATE, START, TIMES, UNITS, sweep, totals

from fitting.identification.peak_picking import pick_peak
from fitting.identification.preload_chain import identify_preload_chain
from fitting.identification.preload_sweep import PreloadSweep
from twin._checks import InputError
from twin.drives.leipe import DAMPING, STIFFNESS
from twin.frf import FRF
from twin.record import Record

PRELOADS = (3.0, 8.0, 20.0, 50.0, 100.0)
SWEEPS = [sweep(preload, noise=1e-9) for preload in PRELOADS]


@pytest.fixture(scope="module")
def responses():
    return [one.response(band=(30.0, 200.0)) for one in SWEEPS]


@pytest.fixture(scope="module")
def chain(responses):
    return identify_preload_chain(SWEEPS, DRIVE, responses=responses)


def silent(response):
    """A response without a resonance: the table simply follows."""
    values = np.ones_like(response.values)
    return FRF(response.frequency, jnp.asarray(values), response.outputs, response.inputs)


def test_totals_are_those_of_the_true_laws(chain):
    for point in chain.points:
        stiffness, damping, forces = totals(point.preload_percent)
        assert point.peak.stiffness == pytest.approx(stiffness, rel=2e-3)
        assert point.peak.damping == pytest.approx(damping, rel=1e-2)
        np.testing.assert_allclose(point.forces, forces, atol=0.1)


def test_the_laws_come_back(chain):
    stiffness, damping = chain.stiffness.law, chain.damping.law
    np.testing.assert_allclose([stiffness.k1, stiffness.k2], STIFFNESS, rtol=1e-2)
    forces = np.geomspace(300.0, 4700.0, 20)
    truth = DRIVE.train_1.mesh
    np.testing.assert_allclose(stiffness(forces), truth.stiffness(forces), rtol=2e-3)
    np.testing.assert_allclose(damping(forces), truth.damping(forces), rtol=1e-2)
    assert damping.d3 == pytest.approx(DAMPING[2], rel=1e-2)
    assert chain.stiffness.error_percent < 0.2
    assert chain.damping.error_percent < 1.0


def test_as_printed_reads_the_stiffness_too_high(responses, chain):
    paper = identify_preload_chain(SWEEPS, DRIVE, responses=responses, estimator="paper")
    assert (paper.estimator, chain.estimator) == ("paper", "exact")
    ratio = np.array([p.peak.stiffness / e.peak.stiffness for p, e in zip(paper.points, chain.points, strict=True)])
    assert np.all((ratio > 1.026) & (ratio < 1.08))
    assert np.all(np.diff(ratio) < 0)
    force = 1000.0
    assert 1.026 < float(paper.stiffness.law(force) / chain.stiffness.law(force)) < 1.05


def test_responses_are_estimated_where_none_are_given(chain):
    again = identify_preload_chain(SWEEPS, DRIVE)
    assert again.to_dataframe().equals(chain.to_dataframe())


def test_the_damping_of_the_guides_is_taken_out():
    guides = 2500.0
    swept = [sweep(preload, guides=guides) for preload in PRELOADS[2:]]
    found = identify_preload_chain(swept, DRIVE, guide_damping=guides)
    for point in found.points:
        stiffness, damping, _ = totals(point.preload_percent)
        assert point.peak.stiffness == pytest.approx(stiffness, rel=2e-3)
        assert point.peak.damping == pytest.approx(damping, rel=1e-2)


def test_low_preloads_are_shown_but_not_fitted(responses, chain):
    assert [point.used for point in chain.points] == [False, True, True, True, True]
    higher = identify_preload_chain(SWEEPS, DRIVE, responses=responses, leave_out_up_to=8.0)
    assert [point.used for point in higher.points] == [False, False, True, True, True]
    assert chain.stiffness.result.residual.size == 4
    assert higher.stiffness.result.residual.size == 3
    spoilt = [dataclasses.replace(SWEEPS[0], preload_percent=2.0), *SWEEPS[1:]]
    other = identify_preload_chain(spoilt, DRIVE, responses=[responses[4], *responses[1:]])
    assert float(other.stiffness.law.k1) == float(chain.stiffness.law.k1)


def test_a_left_out_sweep_may_have_no_crossing(responses, chain):
    found = identify_preload_chain(SWEEPS, DRIVE, responses=[silent(responses[0]), *responses[1:]])
    assert found.points[0].peak is None
    table = found.to_dataframe()
    assert np.isnan(table.loc[3.0, "k [N/m]"])
    assert np.isfinite(table.loc[3.0, "F1 [N]"])
    assert float(found.stiffness.law.k1) == float(chain.stiffness.law.k1)


def test_a_fitted_sweep_without_a_crossing_is_named_by_its_preload(responses):
    broken = [*responses[:2], silent(responses[2]), *responses[3:]]
    with pytest.raises(InputError, match="At 20 % preload: The phase"):
        identify_preload_chain(SWEEPS, DRIVE, responses=broken)


def test_too_few_sweeps_above_the_limit(responses):
    with pytest.raises(InputError, match="2 of 5 sweeps have a preload above 20 %"):
        identify_preload_chain(SWEEPS, DRIVE, responses=responses, leave_out_up_to=20.0)
    with pytest.raises(InputError, match="0 of 0"):
        identify_preload_chain([], DRIVE)


def test_one_response_for_each_sweep(responses):
    with pytest.raises(InputError, match="5 sweeps and 4 responses"):
        identify_preload_chain(SWEEPS, DRIVE, responses=responses[:4])


def test_the_table_has_a_row_for_each_sweep(chain):
    table = chain.to_dataframe()
    assert table.index.name == "preload [%]"
    assert list(table.index) == list(PRELOADS)
    peak = chain.points[2].peak
    row = table.loc[20.0]
    assert (row["f0 [Hz]"], row["|G| [-]"], row["D [-]"]) == (peak.frequency, peak.magnitude, peak.damping_ratio)
    assert row["d [N s/m]"] == peak.damping
    assert bool(row["used"])


def test_velocities_are_differences_at_the_lower_rate():
    found = SWEEPS[1].velocities(1000.0)
    position = np.asarray(SWEEPS[1].record.channel("table_position"))[round(START * RATE) :: 2]
    np.testing.assert_array_equal(found.channel("table_velocity"), np.diff(position) * 1000.0)
    assert float(found.times[0]) == pytest.approx(START + 1e-3)
    assert float(found.sample_rate) == pytest.approx(1000.0)
    assert set(found.channels) == {"velocity_1", "velocity_2", "table_velocity"}


def test_torques_are_averaged_over_the_sweep_alone():
    record = SWEEPS[1].record
    before = np.asarray(record.times) < START
    loud = record.with_channel("torque_1", np.where(before, 100.0, record.channel("torque_1")), "N m")
    np.testing.assert_allclose(PreloadSweep(8.0, loud, START).motor_torques(), SWEEPS[1].motor_torques(), rtol=1e-12)


def test_the_response_is_the_transfer_function(responses):
    stiffness, damping, _ = totals(PRELOADS[3])
    s = 2j * np.pi * np.asarray(responses[3].frequency)
    truth = (damping * s + stiffness) / (float(DRIVE.table_mass) * s**2 + damping * s + stiffness)
    found = np.asarray(responses[3].values[0, 0])
    np.testing.assert_allclose(found, truth, atol=0.02 * np.max(np.abs(truth)))
    near = pick_peak(responses[3].frequency, found, float(DRIVE.table_mass)).frequency
    assert near == pytest.approx(pick_peak(responses[3].frequency, truth, float(DRIVE.table_mass)).frequency, rel=1e-3)


def _without(name):
    record = SWEEPS[1].record
    channels = {key: values for key, values in record.channels.items() if key != name}
    return Record.create(TIMES, channels, {key: UNITS[key] for key in channels}, name="a sweep")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PreloadSweep(8.0, _without("torque_2"), START), "no channel 'torque_2'"),
        (lambda: PreloadSweep(8.0, _without("table_position"), START), "no channel 'table_position'"),
        (lambda: PreloadSweep(8.0, SWEEPS[1].record, 31.0), "starts at 31 s, but a sweep ends at"),
        (lambda: PreloadSweep(8.0, SWEEPS[1].record, float("nan")), "starts at nan s"),
        (lambda: SWEEPS[1].velocities(900.0), "900 Hz, but a sweep was sampled at 2000 Hz"),
        (lambda: SWEEPS[1].velocities(4000.0), "Give a sample_rate that divides it"),
        (lambda: SWEEPS[1].velocities(0.0), "sample_rate must be positive"),
        (lambda: PreloadSweep(8.0, SWEEPS[1].record.slice(0.0, 1.0), START).response(), "499 samples"),
        (lambda: SWEEPS[1].response(estimator="H4"), "estimator must be one of"),
        (lambda: SWEEPS[1].response(band=(30.0, 900.0)), "half the sample rate"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_a_sweep_with_an_end_leaves_the_rest_out():
    whole = SWEEPS[1]
    half = 0.5 * (whole.start + float(whole.record.times[-1]))
    part = dataclasses.replace(whole, end=half)
    assert float(part.during().times[-1]) < half
    assert part.velocities(1000.0).times.size < 0.6 * whole.velocities(1000.0).times.size
    with pytest.raises(InputError, match="Correct the end"):
        dataclasses.replace(whole, end=whole.start)
