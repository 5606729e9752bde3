"""Gains that scatter from response to response do not make the search of participations run away."""

import jax.numpy as jnp
import numpy as np
import pytest
from modal_systems import FREQUENCY, LINES, RATIO, response, shapes_for

from fitting.identification.modal_analysis import modal_analysis
from twin.frf import FRF


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_pole_beside_another_is_searched_without_overflow():
    """Two poles are made of one mode whose shape differs between the excitations, by their gains."""
    frf, _ = response(
        FREQUENCY, RATIO, shapes_for(6), LINES[::2], inputs=(0, 1), form="accelerance", noise=0.002, seed=103
    )
    gains = 1 + 0.01 * np.random.default_rng(3).normal(size=frf.values.shape[:2])
    values = frf.values * jnp.asarray(gains)[..., None]
    analysis = modal_analysis(FRF(frf.frequency, values, frf.outputs, frf.inputs, frf.form), order=16)
    nearest = np.min(np.abs(analysis.frequency[:, None] - FREQUENCY), axis=0)
    assert np.all(nearest < 1e-3 * FREQUENCY)
    assert np.all(np.isfinite(analysis.frequency_error)) and np.all(np.isfinite(analysis.shape_errors))
