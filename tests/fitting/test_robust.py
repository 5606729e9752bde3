"""Robust losses: shape, derivatives at awkward points, efficiency, and residuals under them."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jaxtyping import Array, Float
from scipy import integrate, stats

from fitting.fit import fit
from fitting.residuals.losses import CauchyLoss, HuberLoss, SoftL1Loss, TukeyLoss
from fitting.residuals.residual import AbstractResidual, JointResidual, evaluate, pieces
from fitting.residuals.robust import RobustResidual, with_measured_scale, without_loss
from fitting.residuals.selected import SelectedResidual, across
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

LOSSES = (SoftL1Loss(), HuberLoss(), CauchyLoss(), TukeyLoss())
EVERY = pytest.mark.parametrize("loss", LOSSES, ids=lambda loss: type(loss).__name__)
AWKWARD = np.array([0.0, 1e-300, 1e-170, 1e-8, 0.03, 1.0, 1e3, 1e7, 1e9, 1e100, 1e200, 1e300])

transform = jax.jit(lambda loss, r: loss(r))
slope = jax.jit(lambda loss, r: jax.vmap(jax.grad(loss))(r))
forward = jax.jit(lambda loss, r: jax.jvp(loss, (r,), (jnp.ones_like(r),))[1])
second = jax.jit(lambda loss, r: jax.vmap(jax.grad(jax.grad(loss)))(r))
measures = jax.jit(lambda loss, r: (loss.cost(r), loss.score(r), loss.score_slope(r), loss.curvature(r)))

sizes = st.floats(0.0, 1e6)


def defined_cost(loss, r):
    """c²·ρ((r/c)²) as in the textbooks."""
    c = float(loss.threshold)
    s = (r / c) ** 2
    if isinstance(loss, SoftL1Loss):
        return c**2 * 2 * (np.sqrt(1 + s) - 1)
    if isinstance(loss, HuberLoss):
        return np.where(s <= 1, r**2, 2 * c * np.abs(r) - c**2)
    if isinstance(loss, CauchyLoss):
        return c**2 * np.log1p(s)
    return c**2 / 3 * np.where(s <= 1, 1 - (1 - np.minimum(s, 1)) ** 3, 1.0)


@EVERY
def test_the_square_of_the_transform_is_the_loss(loss):
    r = np.linspace(-20.0, 20.0, 401)
    np.testing.assert_allclose(np.asarray(transform(loss, r)) ** 2, defined_cost(loss, r), rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(measures(loss, r)[0], defined_cost(loss, r), rtol=1e-11, atol=1e-13)


@EVERY
@given(st.tuples(sizes, sizes))
@settings(max_examples=30, deadline=None)
def test_losses_are_odd_monotone_and_below_the_square(loss, pair):
    small, large = sorted(pair)
    a, b, mirrored = np.asarray(transform(loss, jnp.asarray([small, large, -large])))
    assert mirrored == -b
    assert a <= b * (1 + 1e-14)
    assert b <= large * (1 + 1e-14)


@EVERY
@given(st.lists(st.floats(-1e200, 1e200), min_size=4, max_size=4))
@settings(max_examples=30, deadline=None)
def test_influence_is_bounded(loss, residuals):
    score = np.asarray(measures(loss, jnp.asarray(residuals))[1])
    assert np.all(np.abs(score) <= 1.5 * float(loss.threshold))


@EVERY
def test_derivatives_are_exact_and_finite_everywhere(loss):
    c = float(loss.threshold)
    r = np.concatenate([-AWKWARD, AWKWARD, np.nextafter(c, [0.0, 10.0]), [c, -c], np.linspace(-10, 10, 41)])
    for derivative in (slope, forward):
        assert np.all(np.isfinite(np.asarray(derivative(loss, r))))
    assert np.all(np.isfinite(np.asarray(second(loss, r[np.abs(r) <= 1e100]))))
    np.testing.assert_allclose(slope(loss, r), forward(loss, r), rtol=1e-14)
    assert np.all(np.isfinite(np.stack([np.asarray(m) for m in measures(loss, r)[1:]])))
    smooth = np.linspace(-10, 10, 400)
    smooth = smooth[np.abs(np.abs(smooth) - c) > 1e-3]
    h = 1e-6
    numeric = (transform(loss, smooth + h) - transform(loss, smooth - h)) / (2 * h)
    np.testing.assert_allclose(slope(loss, smooth), numeric, atol=1e-9)
    scores = (measures(loss, smooth + h)[1] - measures(loss, smooth - h)[1]) / (2 * h)
    np.testing.assert_allclose(measures(loss, smooth)[2], scores, atol=1e-8)
    numeric = (slope(loss, smooth + h) - slope(loss, smooth - h)) / (2 * h)
    np.testing.assert_allclose(second(loss, smooth), numeric, atol=1e-8)


@EVERY
def test_score_and_curvature_belong_to_the_transform(loss):
    """ψ = φ·φ' and ψ' = curvature·φ'²."""
    r = np.linspace(-12.0, 12.0, 100)
    _, score, score_slope, curvature = measures(loss, r)
    np.testing.assert_allclose(score, transform(loss, r) * slope(loss, r), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(score_slope, curvature * slope(loss, r) ** 2, rtol=1e-10, atol=1e-14)
    assert float(measures(loss, jnp.zeros(1))[3][0]) == 1.0


@EVERY
def test_thresholds_cost_five_percent_on_normal_noise(loss):
    def mean(index, power):
        def weighted(r):
            return float(measures(loss, jnp.asarray([r]))[index][0]) ** power * stats.norm.pdf(r)

        c = float(loss.threshold)
        return 2 * sum(integrate.quad(weighted, *ends, epsabs=1e-7)[0] for ends in ((0, c), (c, 9)))

    assert mean(2, 1) ** 2 / mean(1, 2) == pytest.approx(0.95, abs=5e-4)


@EVERY
def test_what_is_not_finite_stays_so(loss):
    assert not np.any(np.isfinite(np.asarray(transform(loss, jnp.asarray([np.nan, np.inf, -np.inf])))))


def test_a_threshold_has_a_derivative():
    far, h = jnp.asarray(3.0), 1e-6
    found = jax.grad(lambda loss: loss(far))(HuberLoss(1.2)).threshold
    numeric = (transform(HuberLoss(1.2 + h), far) - transform(HuberLoss(1.2 - h), far)) / (2 * h)
    assert float(found) == pytest.approx(float(numeric), rel=1e-8)


class Level(eqx.Module):
    """One number."""

    value: Float[Array, ""]


class LevelResidual(AbstractResidual):
    """Samples against one number."""

    samples: Float[Array, " n"]

    def __call__(self, model):
        return model.value - self.samples


SAMPLES = jnp.asarray(np.append(np.random.default_rng(1).standard_normal(60), [20.0, 25.0, 30.0, 40.0]))
PLAIN = LevelResidual(SAMPLES)
START = Level(jnp.asarray(1.0))
SPACE = ParameterSpace([Parameter("value")])


@pytest.mark.slow
def test_outliers_do_not_decide_a_robust_fit():
    """Every loss fits its own number to the same samples, all in one fit."""
    names = [type(loss).__name__ for loss in LOSSES]
    parts = [SelectedResidual(RobustResidual(PLAIN, loss), name) for loss, name in zip(LOSSES, names, strict=True)]
    result = fit(JointResidual(tuple(parts)), dict.fromkeys(names, START), across(SPACE, names, free=["value"]))
    assert result.success
    assert np.mean(SAMPLES) > 1.5
    assert np.all(np.abs(result.values) < 0.3)
    for loss, value in zip(LOSSES, result.values, strict=True):
        assert abs(float(jnp.sum(measures(loss, value - SAMPLES)[1]))) < 1e-5


def test_a_robust_fit_has_the_standard_error_of_an_m_estimator():
    """For one number: Σψ² / (Σψ')², with the factor for few data and the leverage put back."""
    result = fit(RobustResidual(PLAIN, HuberLoss()), START, SPACE)
    assert np.std(SAMPLES) / 8 > 2 * result["value"].standard_error
    _, score, score_slope, _ = measures(HuberLoss(), result.values[0] - SAMPLES)
    textbook = np.sqrt(64 / 63 * np.sum(np.square(score))) / np.sum(score_slope)
    assert 1.0 <= result["value"].standard_error / textbook < 1.02


def test_scale_only_moves_the_threshold():
    scaled = RobustResidual(PLAIN, HuberLoss(1.5), scale=2.0)
    np.testing.assert_allclose(scaled(START), RobustResidual(PLAIN, HuberLoss(3.0))(START), rtol=1e-14)


def test_a_measured_scale_makes_the_weights_unit_free():
    """Fit, measure the scale, fit again: the answer no longer depends on the unit of the weights."""
    found = []
    for unit in (1.0, 1e3):
        evidence = RobustResidual(LevelResidual(SAMPLES * unit), TukeyLoss())
        model = Level(jnp.asarray(0.1 * unit))
        for _ in range(6):
            evidence = with_measured_scale(evidence, model)
            model = fit(evidence, model, SPACE).model
        found.append([float(model.value) / unit, float(evidence.scale) / unit])
    np.testing.assert_allclose(found[1], found[0], rtol=1e-7)
    assert 0.7 < found[0][1] < 1.5


def test_a_scale_that_cannot_be_measured_is_refused():
    constant = RobustResidual(LevelResidual(jnp.ones(9)), HuberLoss())
    with pytest.raises(InputError, match="median of the 9 residuals' magnitude is 0"):
        with_measured_scale(constant, START)


def test_losses_come_off_wherever_they_are():
    joint = JointResidual((RobustResidual(PLAIN, HuberLoss()), PLAIN, RobustResidual(PLAIN, TukeyLoss())))
    outer = SelectedResidual(joint, "set")
    bare = without_loss(outer)
    np.testing.assert_array_equal(bare({"set": START}), np.tile(PLAIN(START), 3))
    assert evaluate(bare, {"set": START})[1] is None
    values, curvature = evaluate(outer, {"set": START})
    np.testing.assert_array_equal(values, outer({"set": START}))
    np.testing.assert_array_equal(curvature[64:128], 1.0)
    np.testing.assert_allclose(curvature[60:64], 0.0, atol=1e-12)
    found = pieces(outer, {"set": START})
    assert [piece.name for piece in found] == ["0 (RobustResidual)", "1 (LevelResidual)", "2 (RobustResidual)"]
    for piece in found:
        np.testing.assert_array_equal(piece.plain, PLAIN(START))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: HuberLoss(0.0), "threshold must be positive"),
        (lambda: RobustResidual(PLAIN, HuberLoss(), scale=-1.0), "scale must be positive"),
        (
            lambda: RobustResidual(JointResidual((RobustResidual(PLAIN, HuberLoss()), PLAIN)), TukeyLoss()),
            "around evidence that has one already",
        ),
    ],
)
def test_bad_losses_are_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
