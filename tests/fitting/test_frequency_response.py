"""Fits to frequency responses: weights, recovery with honest intervals, batches, errors that name the cause."""

from operator import itemgetter

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.fit import result_of
from fitting.identification.two_mass import (
    identify_two_mass,
    modes_of,
    two_mass_residual,
    two_mass_response,
    two_mass_space,
)
from fitting.identification.two_mass_start import read_two_mass
from fitting.residuals.frequency_response import FrequencyResponseResidual
from fitting.solve import solve_raw
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from twin._checks import InputError
from twin.control import DelayedPlant
from twin.drives import TwoMass, two_mass_modes
from twin.frf import FRF
from twin.laws import ViscousFriction
from twin.linear import frequency_response

FREQUENCY = np.linspace(11.0, 250.0, 60)


def drive(damping=0.02):
    plant = TwoMass(4.8e-3, 4.7e-3, 548.0, damping, ViscousFriction(0.046), ViscousFriction(0.08))
    return DelayedPlant(plant, 1.1e-4)


def measured(relative=0.02, seed=None, frequency=FREQUENCY, model=None):
    """The drive's response, with or without noise of a known relative size."""
    exact = two_mass_response(drive() if model is None else model, frequency)
    deviation = relative * np.abs(np.asarray(exact.values))
    values = np.asarray(exact.values)
    if seed is not None:
        draw = np.random.default_rng(seed).standard_normal((2, *values.shape))
        values = values + deviation * (draw[0] + 1j * draw[1]) / np.sqrt(2)
    return FRF(exact.frequency, jnp.asarray(values), exact.outputs, exact.inputs, exact.form, jnp.asarray(deviation**2))


@eqx.filter_jit
def evaluate(residual, model):
    return residual(model)


@pytest.fixture(scope="module")
def batch():
    """100 noisy measurements fitted as one batch."""
    start = drive(0.03)
    space = two_mass_space(start)
    draws = [measured(seed=100 + seed) for seed in range(100)]

    @eqx.filter_jit
    @eqx.filter_vmap
    def fits(values):
        noisy = eqx.tree_at(lambda frf: frf.values, draws[0], values)
        return solve_raw(two_mass_residual(noisy, kind="complex"), start, space, BoundedLevenbergMarquardt(), 50)

    solved = jax.tree.map(np.asarray, fits(jnp.stack([draw.values for draw in draws])))
    singles = (jax.tree.map(itemgetter(i), solved) for i in range(len(draws)))
    return [result_of(jax.tree.map(jnp.asarray, single), start, space) for single in singles]


@pytest.mark.parametrize("kind", ["complex", "log"])
def test_residual_is_zero_at_the_truth_and_of_unit_variance_under_noise(kind):
    truth = drive()
    assert np.abs(evaluate(two_mass_residual(measured(), kind=kind), truth)).max() < 1e-10
    parts = [evaluate(two_mass_residual(measured(seed=seed), kind=kind), truth) for seed in range(10)]
    assert np.mean(np.square(parts)) == pytest.approx(1.0, abs=0.1)


def test_kinds_agree_for_small_errors():
    noisy = measured(1e-5, seed=3)
    first, second = (evaluate(two_mass_residual(noisy, kind=kind), drive()) for kind in ("complex", "log"))
    turned = np.asarray(first[:120] + 1j * first[120:])
    phase = np.exp(1j * np.angle(np.asarray(noisy.values).ravel()))
    np.testing.assert_allclose(turned / phase, second[:120] + 1j * second[120:], atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["complex", "log"])
def test_jacobian_of_the_residual_agrees_with_central_differences(kind):
    model = drive()
    space = two_mass_space(model)
    modes = two_mass_modes(model.plant)
    # Lines on the resonance and on the antiresonance are the awkward ones.
    lines = np.array([20.0, float(modes.antiresonance), float(modes.resonance), 200.0])
    residual = two_mass_residual(measured(seed=4, frequency=lines), kind=kind)

    @jax.jit
    def weighted(vector):
        return residual(space.unpack(model, vector))

    at = space.pack(model)
    exact = np.asarray(jax.jit(jax.jacfwd(weighted))(at))
    for i in range(len(space)):
        step = jnp.zeros(len(space)).at[i].set(1e-6)
        numeric = np.asarray((weighted(at + step) - weighted(at - step)) / 2e-6)
        np.testing.assert_allclose(exact[:, i], numeric, rtol=1e-4, atol=1e-5 * np.abs(exact[:, i]).max())


def test_undamped_model_has_a_finite_residual_and_jacobian():
    model = DelayedPlant(TwoMass(4.8e-3, 4.7e-3, 548.0, 0.0, ViscousFriction(0.0), ViscousFriction(0.0)), 0.0)
    space = two_mass_space(model)
    residual = two_mass_residual(measured())
    jacobian = jax.jit(jax.jacfwd(lambda v: residual(space.with_values(model, v))))(space.values(model))
    assert np.all(np.isfinite(evaluate(residual, model)))
    assert np.all(np.isfinite(jacobian))


def test_closed_form_start_is_close_without_noise_and_with_it():
    for start, tolerance in ((read_two_mass(measured()), 0.03), (read_two_mass(measured(0.05, seed=5)), 0.1)):
        modes = two_mass_modes(drive().plant)
        assert start.resonance.value == pytest.approx(float(modes.resonance), rel=tolerance / 10)
        assert start.antiresonance.value == pytest.approx(float(modes.antiresonance), rel=tolerance / 10)
        assert float(start.model.plant.motor_inertia) == pytest.approx(4.8e-3, rel=tolerance)
        assert float(start.model.plant.load_inertia) == pytest.approx(4.7e-3, rel=tolerance)
        assert float(start.model.plant.stiffness) == pytest.approx(548.0, rel=tolerance)
        assert float(start.model.delay) == pytest.approx(1.1e-4, rel=10 * tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["complex", "log"])
def test_exact_data_give_the_exact_parameters(kind):
    found = identify_two_mass(measured(), kind=kind)
    assert found.result.success
    truth = found.result.space.values(drive())
    np.testing.assert_allclose(found.result.values, truth, rtol=1e-6)
    np.testing.assert_allclose([e.value for e in found.modes], two_mass_modes(drive().plant), rtol=1e-7)


def test_intervals_cover_the_truth_as_often_as_they_say(batch):
    assert all(result.success for result in batch)
    truth = np.asarray(batch[0].space.values(drive()))
    ends = np.array([result.intervals(0.95) for result in batch])
    inside = (ends[..., 0] <= truth) & (truth <= ends[..., 1])
    assert 0.91 <= inside.mean() <= 0.98
    assert np.all(inside.mean(axis=0) >= 0.86)


def test_standard_errors_of_the_modes_match_their_scatter(batch):
    found = np.array([[estimate[:2] for estimate in modes_of(result)] for result in batch])
    truth = np.asarray(two_mass_modes(drive().plant))
    scatter = np.sqrt(np.mean((found[..., 0] - truth) ** 2, axis=0))
    np.testing.assert_allclose(scatter / found[..., 1].mean(axis=0), 1.0, atol=0.25)


@pytest.mark.slow
def test_a_damping_on_its_bound_leaves_the_modes_with_standard_errors():
    found = identify_two_mass(measured(0.02, seed=6, model=drive(0.0)))
    assert found.result.success
    assert all(np.isfinite(estimate.standard_error) for estimate in found.modes)


def test_linear_systems_are_fitted_by_their_own_response():
    system = drive().plant.second_order()
    exact = frequency_response(system, jnp.asarray(FREQUENCY))
    data = exact.with_variance(np.ones(exact.values.shape))
    found = FrequencyResponseResidual(data, respond=frequency_response)(system)
    assert found.shape == (2 * exact.values.size,)
    assert np.all(np.asarray(found) == 0)


@pytest.mark.slow
def test_unusable_measurements_are_named():
    data = measured()
    bare = FRF(data.frequency, data.values, data.outputs, data.inputs)
    with pytest.raises(InputError, match="no variance to weight by"):
        FrequencyResponseResidual(bare)
    with pytest.raises(InputError, match="no variance to weight by"):
        identify_two_mass(bare)
    zero = data.with_variance(np.asarray(data.variance) * (np.arange(60) != 7))
    with pytest.raises(InputError, match=r"'motor_angle' to 'current' at .* variance is not positive .*2 such"):
        FrequencyResponseResidual(zero)
    hole = FRF(data.frequency, data.values.at[1, 0, 3].set(jnp.nan), data.outputs, data.inputs, "ratio", data.variance)
    with pytest.raises(InputError, match=r"'load_angle' to 'current' .* value is not finite"):
        FrequencyResponseResidual(hole)
    silent = FRF(data.frequency, data.values.at[1, 0, 3].set(0.0), data.outputs, data.inputs, "ratio", data.variance)
    FrequencyResponseResidual(silent)
    with pytest.raises(InputError, match="no logarithm"):
        FrequencyResponseResidual(silent, kind="log")
    with pytest.raises(InputError, match="kind must be"):
        FrequencyResponseResidual(data, kind="phase")
    with pytest.raises(InputError, match="outputs names 1 of the model"):
        FrequencyResponseResidual(data, outputs=("position",))
    with pytest.raises(InputError, match="The model has no output 'motor_angle'"):
        FrequencyResponseResidual(data)(drive())
    with pytest.raises(InputError, match="No response of 'angle'"):
        identify_two_mass(data, motor="angle")


def test_a_response_that_is_no_two_mass_drive_is_refused():
    data = measured()
    turned = FRF(data.frequency, data.values * jnp.array([1.0, -1.0])[:, None, None], data.outputs, data.inputs)
    with pytest.raises(InputError, match="signs of the two angles"):
        read_two_mass(turned)
    with pytest.raises(InputError, match=r"(?i)resonance"):
        read_two_mass(data, motor="load_angle", load="motor_angle")
    with pytest.raises(InputError, match="lines lie around"):
        read_two_mass(measured(frequency=np.array([11.0, 40.0, 76.0, 180.0, 200.0, 220.0])))
