"""The control by data held back: passes for a model that is right, and fails for those that are not."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.controls import held_back, held_back_share, hold_back
from fitting.controls.held_back import rms_of
from fitting.controls.relative_error import relative_errors
from fitting.fit import fit
from fitting.residuals.losses import HuberLoss
from fitting.residuals.prior import GaussianPrior
from fitting.residuals.residual import JointResidual
from fitting.residuals.robust import RobustResidual
from fitting.residuals.set_leaves import WithLeaves
from fitting.residuals.weighted import Weighted
from tests.fitting.controls.control_systems import (
    MODE_SPACE,
    SPACE,
    START,
    TIMES,
    AnyCurve,
    Lag,
    Resonance,
    Wave,
    record_of,
    response_of,
)
from tests.fitting.curves import LineResidual
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace
from twin.paths import set_leaves

TRUTH = Lag(2.0, 0.08)


@pytest.fixture(scope="module")
def evidence():
    return record_of(TRUTH)[1]


def test_a_right_model_predicts_the_end_of_its_record(evidence):
    control = held_back_share(evidence, START, SPACE, share=0.25)
    assert control.passed
    assert control.fitted_rms == pytest.approx(1.0, abs=0.15)
    assert control.rms == pytest.approx(1.0, abs=0.25)
    assert control.errors["speed"] < 0.1
    assert "about as well" in control.sentence


def test_a_model_that_lacks_something_fails_where_that_matters():
    """The bend shows in the large commands at the end only, which a model without it was not fitted to."""
    bent = record_of(Lag(2.0, 0.08, 0.03), Wave(growth=1.0))[1]
    control = held_back_share(bent, START, SPACE, share=0.5)
    assert not control.passed
    assert control.ratio > 2
    assert "predicted" in control.sentence and "Free fewer" in control.sentence
    # With the bend free the same data pass.
    free = ParameterSpace([*SPACE.parameters, Parameter("bend", "s²/m²", 0.0, 1.0)])
    assert held_back_share(bent, START, free, share=0.5).passed


def test_a_curve_through_everything_predicts_nothing(evidence):
    curve = AnyCurve(np.zeros(60))
    space = ParameterSpace([Parameter(f"heights.{i}", "m/s", -20.0, 20.0) for i in range(60)])
    control = held_back_share(evidence, curve, space, share=0.25)
    assert not control.passed
    assert control.ratio > 5


def test_another_record_held_back(evidence):
    result = fit(evidence, START, SPACE)
    assert held_back(evidence, record_of(TRUTH, Wave(growth=0.5), seed=7)[1], result.model).passed
    other = held_back(evidence, record_of(Lag(2.0, 0.2), seed=7)[1], result.model)
    assert not other.passed
    with pytest.raises(InputError, match="limit must be above 1"):
        held_back(evidence, evidence, result.model, limit=1.0)


def test_split_of_a_record_is_disjoint_and_whole(evidence):
    parts = hold_back(evidence, share=0.25)
    assert parts.fitted.times.size == 300
    whole = np.asarray(evidence(TRUTH))
    np.testing.assert_allclose(parts.fitted(TRUTH), whole[:300], rtol=1e-12)
    kept = np.asarray(parts.kept(TRUTH))
    np.testing.assert_array_equal(kept[:300], 0.0)
    np.testing.assert_allclose(kept[300:], whole[300:], rtol=1e-12)
    assert rms_of(parts.kept, TRUTH) == pytest.approx(np.sqrt(np.mean(whole[300:] ** 2)))


def test_split_of_a_response_interleaves_lines():
    model = Resonance(40.0, 0.05)
    measured, residual = response_of(model)
    parts = hold_back(residual, share=0.25)
    fitted, kept = (np.asarray(part.measured.frequency) for part in parts)
    np.testing.assert_array_equal(np.sort(np.concatenate([fitted, kept])), measured.frequency)
    assert kept.size == 22
    control = held_back_share(residual, Resonance(30.0, 0.2), MODE_SPACE)
    assert control.passed
    assert control.errors["deflection / force"] == pytest.approx(0.02, abs=0.01)


def test_relative_error_of_logarithmic_evidence():
    import dataclasses

    model = Resonance(40.0, 0.05)
    plain = response_of(model)[1]
    logarithmic = dataclasses.replace(plain, kind="log")
    controls = [held_back(one, one, model) for one in (plain, logarithmic)]
    assert controls[0].errors["deflection / force"] == pytest.approx(controls[1].errors["deflection / force"], rel=1e-9)


def test_evidence_within_evidence(evidence):
    prior = GaussianPrior(jnp.asarray([2.0]), jnp.asarray([1.0]), ("gain",))
    joint = JointResidual((RobustResidual(Weighted(evidence, 2.0), HuberLoss()), prior), names=("run", "prior"))
    parts = hold_back(joint)
    result = fit(parts.fitted, START, SPACE)
    control = held_back(parts.fitted, parts.kept, result.model)
    assert control.passed
    assert list(control.errors) == ["run: speed"]
    # The prior is fitted, and does not count as something to predict.
    assert rms_of(parts.kept, TRUTH) == pytest.approx(0.5, abs=0.1)


def test_bad_shares_and_evidence(evidence):
    with pytest.raises(InputError, match="share must be above 0"):
        hold_back(evidence, share=0.7)
    with pytest.raises(InputError, match="each part needs at least 8"):
        hold_back(evidence, share=0.01)
    with pytest.raises(InputError, match="neither a record nor a frequency response"):
        hold_back(LineResidual(TIMES, TIMES))


def test_relative_errors_see_the_beginning_of_a_record(evidence):
    started = WithLeaves(evidence, (jnp.asarray(1.3),), ("gain",))
    assert relative_errors(started, START) == relative_errors(evidence, set_leaves(START, {"gain": 1.3}))
    assert relative_errors(started, START) != relative_errors(evidence, START)
