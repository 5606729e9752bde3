"""The control by shuffled data: passes for a model of its data, and fails for one that explains any data, or none."""

import numpy as np
import pytest

from fitting.controls import permuted_control, shuffled
from fitting.fit import fit
from fitting.residuals.residual import JointResidual
from tests.fitting.controls.control_systems import (
    MODE_SPACE,
    SPACE,
    START,
    AnyCurve,
    Lag,
    Resonance,
    record_of,
    response_of,
)
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

TRUTH = Lag(2.0, 0.08)


@pytest.fixture(scope="module")
def evidence():
    return record_of(TRUTH)[1]


def test_a_model_of_its_data_cannot_explain_shuffled_ones(evidence):
    result = fit(evidence, START, SPACE)
    control = permuted_control(evidence, START, SPACE, result.model)
    assert control.passed
    assert control.ratio > 10
    assert "as it should be" in control.sentence


@pytest.mark.slow
def test_a_curve_through_everything_explains_shuffled_data_too():
    """The noise hides the jumps between blocks; a model of these data would still be told apart."""
    noisy = record_of(TRUTH, noise=0.5)[1]
    space = ParameterSpace([Parameter(f"heights.{i}", "m/s", -20.0, 20.0) for i in range(60)])
    curve = AnyCurve(np.zeros(60))
    result = fit(noisy, curve, space)
    assert result.success
    control = permuted_control(noisy, curve, space, result.model)
    assert not control.passed
    assert permuted_control(noisy, START, SPACE, TRUTH).passed
    assert "do not trust its parameters" in control.sentence


def test_a_model_that_explains_nothing_fails():
    """Data of noise alone: the fit is no better than to any other noise."""
    silent = record_of(Lag(1e-3, 0.08), noise=0.05)[1]
    space = ParameterSpace([Parameter("gain", "1", -10.0, 10.0)])
    result = fit(silent, START, space)
    assert result.success
    assert not permuted_control(silent, START, space, result.model).passed


def test_responses_are_shuffled_along_the_frequency():
    measured, residual = response_of(Resonance(40.0, 0.05))
    start = Resonance(30.0, 0.2)
    result = fit(residual, start, MODE_SPACE)
    control = permuted_control(residual, start, MODE_SPACE, result.model, block=6)
    assert control.passed
    mixed = shuffled(residual, block=6).measured
    np.testing.assert_array_equal(mixed.frequency, measured.frequency)
    order = np.argsort(np.abs(mixed.values[0, 0]))
    np.testing.assert_array_equal(
        mixed.values[0, 0][order], measured.values[0, 0][np.argsort(np.abs(measured.values[0, 0]))]
    )
    np.testing.assert_allclose(mixed.variance, 0.02**2 * np.abs(np.asarray(mixed.values)) ** 2, rtol=0.3)


@pytest.mark.parametrize("block", [1, 7, 40, 200, None])
def test_no_block_stays_and_no_sample_is_lost(evidence, block):
    mixed = shuffled(evidence, block=block, seed=3)
    before, after = np.asarray(evidence.measured[0]), np.asarray(mixed.measured[0])
    np.testing.assert_array_equal(np.sort(before), np.sort(after))
    assert not np.any(before == after)
    np.testing.assert_array_equal(mixed.times, evidence.times)
    np.testing.assert_array_equal(after, shuffled(evidence, block=block, seed=3).measured[0])
    if block == 7:
        places = np.argsort(before)[np.argsort(np.argsort(after))]
        assert np.mean(np.diff(places) == 1) == pytest.approx(1 - 1 / 7, abs=0.01)


def test_channels_stay_together(evidence):
    joint = shuffled(JointResidual((evidence,), names=("a",)), block=10, seed=4)
    np.testing.assert_array_equal(joint.parts[0].measured[0], shuffled(evidence, block=10, seed=4).measured[0])


def test_bad_blocks(evidence):
    for block in (0, 201):
        with pytest.raises(InputError, match="block is"):
            shuffled(evidence, block=block)
    with pytest.raises(InputError, match="limit must be above 1"):
        permuted_control(evidence, START, SPACE, START, limit=0.5)
