"""Modal analysis against structures whose modes are known."""

import numpy as np
import pytest
from modal_systems import FORMS, FREQUENCY, LINES, RATIO, response, shapes_for

from fitting.identification.modal_analysis import modal_analysis
from twin.correlation import mac, macxp_of_modes
from twin.frf import FRF
from twin.modal import reference_modes


def check_exact(analysis, frequency, ratio, tolerance=1e-6):
    assert analysis.success, analysis.message
    np.testing.assert_allclose(analysis.frequency, frequency, rtol=tolerance)
    np.testing.assert_allclose(analysis.damping_ratio, ratio, rtol=tolerance)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("inputs", [(0,), (0, 1)])
def test_modes_are_exact_without_noise(form, inputs):
    shapes = shapes_for(6)
    frf, _ = response(FREQUENCY, RATIO, shapes, inputs=inputs, form=form)
    analysis = modal_analysis(frf)
    check_exact(analysis, FREQUENCY, RATIO)
    assert analysis.mass_normalised and analysis.error < 1e-6
    sign = np.sign(np.sum(np.real(analysis.shapes) * shapes, axis=0))
    np.testing.assert_allclose(analysis.shapes * sign, shapes, atol=1e-6)
    np.testing.assert_allclose(analysis.phase_collinearity, 1.0, atol=1e-9)


def test_hysteretic_responses_have_exact_modes():
    shapes = shapes_for(6)
    frf, _ = response(FREQUENCY, RATIO, shapes, form="accelerance", hysteretic=True)
    analysis = modal_analysis(frf, damping="hysteretic")
    poles = 2j * np.pi * FREQUENCY * np.sqrt(1 + 2j * RATIO)
    np.testing.assert_allclose(analysis.poles, poles, rtol=1e-6)
    # The viscous model is wrong in the background only.
    viscous = modal_analysis(frf)
    np.testing.assert_allclose(viscous.poles, poles, rtol=1e-3)


def test_a_repeated_mode_needs_two_references():
    frequency, ratio = np.array([25.0, 50.0, 50.0, 70.0]), np.array([0.01, 0.012, 0.012, 0.02])
    shapes = shapes_for(4)
    one, _ = response(frequency, ratio, shapes, inputs=(0,))
    check_exact(modal_analysis(one), frequency[[0, 1, 3]], ratio[[0, 1, 3]])
    two, _ = response(frequency, ratio, shapes, inputs=(0, 1))
    analysis = modal_analysis(two)
    check_exact(analysis, frequency, ratio)
    # Any two shapes of the plane are right: the true ones are combinations of those found.
    plane = np.linalg.qr(analysis.shapes[:, 1:3])[0]
    for true in shapes[:, 1:3].T:
        assert np.linalg.norm(plane.conj().T @ true) / np.linalg.norm(true) == pytest.approx(1, abs=1e-6)


def test_close_modes_are_told_apart_in_noise():
    """A third of their bandwidth apart."""
    frequency, ratio = np.array([50.0, 50.3]), np.array([0.01, 0.01])
    shapes = shapes_for(2, seed=3)
    frf, _ = response(frequency, ratio, shapes, np.arange(35.0, 65.0, 0.1), inputs=(0, 1), noise=0.01)
    analysis = modal_analysis(frf)
    assert analysis.frequency.size == 2
    assert np.all(np.abs(analysis.frequency - frequency) < 4 * analysis.frequency_error)
    assert np.all(np.diag(np.asarray(mac(analysis.shapes, shapes))) > 0.999)
    assert all("close to another" in verdict for verdict in analysis.verdict)


def test_heavy_and_light_damping_side_by_side():
    frequency, ratio = np.array([30.0, 52.0, 75.0]), np.array([0.15, 0.0005, 0.08])
    frf, _ = response(frequency, ratio, shapes_for(3))
    analysis = modal_analysis(frf)
    check_exact(analysis, frequency, ratio)
    assert "heavily damped" in analysis.verdict[0] and "lines within its bandwidth" in analysis.verdict[1]


def test_rigid_body_motion_is_a_lower_term():
    frequency, ratio = np.array([0.0, 40.0, 70.0]), np.array([0.0, 0.01, 0.02])
    frf, _ = response(frequency, ratio, shapes_for(3), form="accelerance")
    check_exact(modal_analysis(frf), frequency[1:], ratio[1:])
    without = modal_analysis(frf, residual_terms=False)
    assert without.error > 1e-2


def test_modes_outside_of_the_band_are_residual_terms():
    frf, _ = response(FREQUENCY, RATIO, shapes_for(6), np.arange(0.0, 300.0, 0.25))
    analysis = modal_analysis(frf, band=(45.0, 70.0))
    assert analysis.frequency == pytest.approx([60.0], rel=5e-4)
    assert analysis.damping_ratio == pytest.approx([0.03], rel=2e-2)
    assert float(analysis.measured.frequency[0]) == 45.0


def test_one_response_alone():
    shapes = shapes_for(6)
    frf, _ = response(FREQUENCY, RATIO, shapes)
    one = FRF(frf.frequency, frf.values[2:3], frf.outputs[2:3], frf.inputs, frf.form)
    analysis = modal_analysis(one)
    check_exact(analysis, FREQUENCY, RATIO)
    assert not analysis.mass_normalised
    np.testing.assert_allclose(analysis.shapes, 1.0)
    assert "without a driving point" in analysis.message


def test_few_lines_are_enough_without_noise():
    frf, _ = response([40.0, 60.0], [0.05, 0.04], shapes_for(2), np.linspace(30.0, 70.0, 16))
    check_exact(modal_analysis(frf), [40.0, 60.0], [0.05, 0.04])


@pytest.mark.parametrize("seed", range(4))
def test_noise_makes_no_modes(seed):
    frf, _ = response(FREQUENCY, RATIO, shapes_for(6), inputs=(0, 1), noise=0.05, seed=seed)
    analysis = modal_analysis(frf)
    # Two weak modes may be lost in it, but none is made up.
    assert analysis.frequency.size >= 4
    nearest = FREQUENCY[np.argmin(np.abs(analysis.frequency[:, None] - FREQUENCY), axis=1)]
    assert np.unique(nearest).size == nearest.size
    assert analysis.frequency == pytest.approx(nearest, rel=2e-3)


def test_windowed_noise_widens_the_errors():
    frf, size = response(FREQUENCY, RATIO, shapes_for(6), noise=0.0)
    random = np.random.default_rng(2)
    shape = (*frf.values.shape[:2], LINES.size + 2)
    noise = random.standard_normal(shape) + 1j * random.standard_normal(shape)
    scale = 0.01 * np.sqrt(np.mean(np.abs(frf.values) ** 2))
    hann = scale * (noise[..., 1:-1] - 0.5 * noise[..., :-2] - 0.5 * noise[..., 2:]) / np.sqrt(1.5)
    plain = modal_analysis(FRF(frf.frequency, frf.values + scale * noise[..., 1:-1], frf.outputs, frf.inputs, frf.form))
    windowed = modal_analysis(FRF(frf.frequency, frf.values + hann, frf.outputs, frf.inputs, frf.form))
    assert size == 0
    # A Hann window correlates neighbouring lines by -2/3, errors that cancel: they are not narrowed.
    np.testing.assert_allclose(windowed.frequency_error, plain.frequency_error, rtol=0.2)


def test_modes_go_into_the_criteria_of_models():
    shapes = shapes_for(6)
    frf, _ = response(FREQUENCY, RATIO, shapes, noise=0.01)
    analysis = modal_analysis(frf)
    found = analysis.to_modes()
    assert not np.iscomplexobj(np.asarray(found.output_shapes))
    some = reference_modes(found, outputs=("3 x", "1 x"), indices=(0, 4))
    assert some.outputs == ("3 x", "1 x")
    alike = np.asarray(macxp_of_modes(found, analysis.to_modes(real=False)))
    assert np.all(np.diag(alike) > 0.98)
    table = analysis.to_dataframe()
    assert list(table.index) == [1, 2, 3, 4, 5, 6] and "verdict" in table
    assert "<table" in analysis._repr_html_() and "standard error [Hz]" in repr(analysis)
    assert analysis.shapes_dataframe().shape == (8, 6)
