"""Evidence from the responses at several preloads: zero at the truth, right derivatives, clear refusals."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.identification.preload_direct import mesh_space
from fitting.residuals.preloaded_response import PreloadedResponseResidual
from fitting.residuals.residual import JointResidual
from fitting.residuals.weighted import Weighted
from twin._checks import InputError
from twin.drives import DrivenTable
from twin.drives.leipe import leipe_drive
from twin.drives.rack_pinion_operation import table_response

DRIVE = leipe_drive()
MODEL = DrivenTable(DRIVE)
FREQUENCY = jnp.linspace(40.0, 160.0, 25)
FORCES = jnp.array([[500.0, -400.0], [2000.0, -1900.0], [4700.0, -4600.0]])


def response(forces, velocity=0.005):
    return jnp.sum(table_response(DRIVE, forces, FREQUENCY, velocity=velocity), axis=0)


VALUES = jax.jit(jax.vmap(response))(FORCES)
VARIANCE = 0.02 * jnp.abs(VALUES) ** 2
EVIDENCE = PreloadedResponseResidual(FREQUENCY, VALUES, VARIANCE, FORCES, 0.005)
SPACE = mesh_space()
PACKED = jnp.asarray(SPACE.pack(MODEL))


@eqx.filter_jit
def residual(scaled, evidence=EVIDENCE):
    return evidence(SPACE.unpack(MODEL, scaled))


def test_nothing_is_left_at_the_truth():
    values = residual(PACKED)
    assert values.shape == (EVIDENCE.rows,)
    np.testing.assert_allclose(values, 0.0, atol=1e-9)


def test_rows_and_series_agree():
    """Real parts of all preloads, then imaginary ones; σ²/2 is the variance of each."""
    shifted = dataclasses.replace(EVIDENCE, values=VALUES.at[1, 3].add(0.1 - 0.2j))
    series = EVIDENCE.series(residual(PACKED, shifted))
    assert series.shape == (6, 25)
    assert series.size == EVIDENCE.rows
    deviation = float(jnp.sqrt(VARIANCE[1, 3] / 2))
    assert float(series[1, 3]) == pytest.approx(-0.1 / deviation, rel=1e-6)
    assert float(series[4, 3]) == pytest.approx(0.2 / deviation, rel=1e-6)
    assert np.count_nonzero(np.abs(np.asarray(series)) > 1e-6) == 2


def test_noise_of_that_variance_has_unit_rows():
    random = np.random.default_rng(2)
    parts = random.standard_normal((2, *VALUES.shape))
    noise = np.sqrt(np.asarray(VARIANCE) / 2) * (parts[0] + 1j * parts[1])
    values = residual(PACKED, dataclasses.replace(EVIDENCE, values=VALUES + noise))
    assert float(jnp.std(values)) == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
def test_derivatives_agree_with_differences():
    away = PACKED + 0.02
    exact = np.asarray(jax.jit(jax.jacfwd(residual))(away))
    for i in range(len(SPACE)):
        h = 1e-4 * jnp.eye(len(SPACE))[i]
        expected = np.asarray(residual(away + h) - residual(away - h)) / 2e-4
        np.testing.assert_allclose(exact[:, i], expected, atol=1e-5 * np.max(np.abs(expected)))


@pytest.mark.slow
def test_an_infinite_weight_leaves_evidence_out():
    values = residual(PACKED + 0.01)
    halved = residual(PACKED + 0.01, Weighted(EVIDENCE, 2.0))
    np.testing.assert_allclose(halved, values / 2, rtol=1e-12)
    silent = Weighted(EVIDENCE, np.inf)
    np.testing.assert_array_equal(residual(PACKED + 0.01, silent), 0.0)
    slopes = jax.jit(jax.jacfwd(lambda p: residual(p, silent)))(PACKED + 0.01)
    np.testing.assert_array_equal(slopes, 0.0)
    joint = residual(PACKED + 0.01, JointResidual((silent, Weighted(EVIDENCE, 1.0)), ("one", "two")))
    np.testing.assert_allclose(joint, np.concatenate([0 * values, values]), rtol=1e-12)


@pytest.mark.parametrize("deviation", [0.0, -1.0, float("nan")])
def test_a_weight_must_be_above_zero(deviation):
    with pytest.raises(InputError, match="deviation must be above zero"):
        Weighted(EVIDENCE, deviation)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"frequency": FREQUENCY[:-1]}, "one column for each frequency"),
        ({"variance": VARIANCE[:2]}, "Give one row of values"),
        ({"forces": FORCES[:2]}, "a pair of forces"),
        ({"forces": FORCES[:, :1]}, "a pair of forces"),
        ({"variance": VARIANCE.at[0, 0].set(0.0)}, "variance of the measured response must be positive"),
        ({"variance": -VARIANCE}, "variance of the measured response must be positive"),
        ({"values": VALUES.at[0, 0].set(jnp.nan)}, "measured response must be finite"),
        ({"forces": FORCES.at[0, 0].set(jnp.inf)}, "forces must be finite"),
    ],
)
def test_bad_input_is_named(change, message):
    names = ("frequency", "values", "variance", "forces", "velocity")
    fields = {**{name: getattr(EVIDENCE, name) for name in names}, **change}
    with pytest.raises(InputError, match=message):
        PreloadedResponseResidual(**fields)
