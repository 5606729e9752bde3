"""Standard errors of measured modes hold what they say, and derivatives of the fit are right."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from modal_systems import FREQUENCY, LINES, RATIO, response, shapes_for

from fitting.identification.modal_analysis import modal_analysis
from fitting.identification.modal_basis import ModalKind
from fitting.identification.modal_noise import noise_deviation
from fitting.identification.modal_poles import ModalPoles
from fitting.identification.modal_refinement import ModalProblem

SEEDS = 60


@pytest.mark.slow
@pytest.mark.parametrize("known", [False, True])
def test_intervals_hold_the_truth_as_often_as_they_say(known):
    shapes = shapes_for(6)
    scores, shape_scores = [], []
    for seed in range(SEEDS):
        frf, size = response(
            FREQUENCY, RATIO, shapes, LINES[::2], inputs=(0, 1), form="accelerance", noise=0.02, seed=100 + seed
        )
        frf = frf.with_variance(jnp.full(frf.values.shape, 2 * size**2)) if known else frf
        analysis = modal_analysis(frf, order=16)
        assert analysis.frequency.size == 6
        scores.append((analysis.frequency - FREQUENCY) / analysis.frequency_error)
        scores.append((analysis.damping_ratio - RATIO) / analysis.damping_error)
        sign = np.sign(np.sum(np.real(analysis.shapes) * shapes, axis=0))
        shape_scores.append(np.abs(analysis.shapes * sign - shapes) / analysis.shape_errors)
    inside = np.mean(np.abs(scores) < 1.96)
    # 720 intervals: 95 % ± 3 standard deviations.
    assert 0.925 < inside < 0.975
    assert np.sqrt(np.mean(np.square(scores))) == pytest.approx(1.0, abs=0.1)
    # Those of the scale and of the driving points' own rows hang together, which is not counted: on the safe side.
    assert 0.75 < np.sqrt(np.mean(np.square(shape_scores))) < 1.1


@pytest.mark.slow
def test_intervals_hold_the_truth_where_noise_grows_with_the_response():
    shapes, scores = shapes_for(6), []
    for seed in range(SEEDS):
        frf, _ = response(
            FREQUENCY, RATIO, shapes, LINES[::2], inputs=(0, 1), form="accelerance", noise=0.002, seed=100 + seed
        )
        random = np.random.default_rng(seed)
        scatter = random.standard_normal((2, *frf.values.shape)) * 0.02
        analysis = modal_analysis(eqx.tree_at(lambda f: f.values, frf, frf.values * (1 + scatter[0] + 1j * scatter[1])))
        assert analysis.frequency.size == 6
        scores.append((analysis.frequency - FREQUENCY) / analysis.frequency_error)
        scores.append((analysis.damping_ratio - RATIO) / analysis.damping_error)
    assert 0.925 < np.mean(np.abs(scores) < 1.96) < 0.975
    assert np.sqrt(np.mean(np.square(scores))) == pytest.approx(1.0, abs=0.1)


def test_noise_of_both_kinds_is_told():
    random = np.random.default_rng(3)
    true, _ = response(FREQUENCY, RATIO, shapes_for(6))
    true = np.asarray(true.values)
    for even, growing in ((0.1, 0.0), (0.05, 0.03), (0.001, 0.02)):
        size = np.sqrt(np.mean(np.abs(true) ** 2, axis=2, keepdims=True))
        deviation = np.sqrt((even * size) ** 2 + (growing * np.abs(true)) ** 2)
        noise = deviation * (random.standard_normal(true.shape) + 1j * random.standard_normal(true.shape))
        found = noise_deviation(noise, true) / deviation
        assert np.median(found) == pytest.approx(1.0, abs=0.05)
        assert np.all((found > 0.5) & (found < 2.0))
    np.testing.assert_allclose(np.ptp(noise_deviation(np.ones_like(true), true), axis=2), 0.0)
    np.testing.assert_array_equal(noise_deviation(np.zeros_like(true), true), 0.0)


def test_shapes_of_equal_noise_have_errors_of_equal_size():
    frf, _ = response(FREQUENCY, RATIO, shapes_for(6), noise=0.01)
    analysis = modal_analysis(frf)
    assert analysis.shape_errors.shape == (8, 6)
    assert np.all(analysis.shape_errors > 0)


def test_a_variance_that_is_too_small_is_found_out():
    frf, size = response(FREQUENCY, RATIO, shapes_for(6), noise=0.01)
    honest = modal_analysis(frf.with_variance(jnp.full(frf.values.shape, 2 * size**2)))
    bold = modal_analysis(frf.with_variance(jnp.full(frf.values.shape, 0.02 * size**2)))
    np.testing.assert_allclose(bold.frequency_error, honest.frequency_error, rtol=0.1)


@pytest.mark.parametrize("damping", ["viscous", "hysteretic"])
@pytest.mark.parametrize("uneven", [False, True])
def test_gradient_is_that_of_finite_differences(damping, uneven):
    frf, size = response(
        FREQUENCY[:3], RATIO[:3], shapes_for(3), LINES[::4], inputs=(0, 1), form="mobility", noise=0.05
    )
    values = np.asarray(frf.values)
    deviation = np.full(values.shape, size)
    if uneven:
        deviation *= np.random.default_rng(0).uniform(0.5, 2.0, values.shape)
    problem = ModalProblem.of(LINES[::4], values, deviation, ModalKind("mobility", damping))
    poles = 2 * np.pi * FREQUENCY[:3] * (-1.3 * RATIO[:3] + 1.003j)
    model = ModalPoles.of(poles, np.array([[1.0, 0.4 + 0.2j], [0.3j, 1.0], [1.0, -0.8]]))
    start = np.concatenate([np.asarray(x) for x in (model.frequency, model.damping_ratio, model.participation)])
    found = problem.linearised(model)
    for i in range(start.size):
        step = 1e-6 * max(abs(start[i]), 1e-2)
        ends = [problem.linearised(model.moved(start + side * step * np.eye(start.size)[i])).cost for side in (-1, 1)]
        assert (ends[1] - ends[0]) / (2 * step) == pytest.approx(found.gradient[i], rel=1e-5, abs=1e-4 * found.cost)
    assert np.linalg.eigvalsh(found.curvature).min() > 0


def test_curvature_is_the_gradients_slope_without_noise():
    frf, _ = response(FREQUENCY[:3], RATIO[:3], shapes_for(3), LINES[::4], inputs=(0, 1))
    values = np.asarray(frf.values)
    problem = ModalProblem.of(
        LINES[::4], values, np.full(values.shape, 1e-3 * np.abs(values).max()), ModalKind("receptance")
    )
    omega = 2 * np.pi * FREQUENCY[:3]
    model = ModalPoles.of(omega * (-RATIO[:3] + 1j * np.sqrt(1 - RATIO[:3] ** 2)), shapes_for(3)[:2].T + 0j)
    start = np.concatenate([np.asarray(x) for x in (model.frequency, model.damping_ratio, model.participation)])
    found = problem.linearised(model)
    for i in range(start.size):
        step = 1e-5 * max(abs(start[i]), 1e-2)
        ends = [problem.linearised(model.moved(start + s * step * np.eye(start.size)[i])).gradient for s in (-1, 1)]
        slope = (ends[1] - ends[0]) / (2 * step)
        scale = np.sqrt(np.diag(found.curvature) * found.curvature[i, i])
        np.testing.assert_allclose(slope / scale, found.curvature[i] / scale, atol=1e-4)
