"""Sensitivity of modal evidence to quantities, and the order of the reference machine's quantities by it."""

import numpy as np
import pytest

from fitting.identification.evidence_sensitivity import evidence_sensitivity
from fitting.identification.machine_measurement import measured_modes
from fitting.identification.machine_study import DISTURBED
from fitting.residuals.modes import ModesResidual
from twin._checks import InputError
from twin.paths import get_leaf, set_leaves
from twin.structure.reference_machine import POSITIONS, reference_machine
from twin.structure.reference_quantities import DISTURBABLE, Quantity

MACHINE = reference_machine()


@pytest.fixture(scope="module")
def sensitivity():
    return evidence_sensitivity(MACHINE, DISTURBABLE, POSITIONS)


def test_the_disturbed_quantities_are_the_44_least_sensitive(sensitivity):
    least = np.argsort(sensitivity)[:44]
    assert {q.path for q in DISTURBED} == {DISTURBABLE[i].path for i in least}
    # All quantities are in this order, and none is without effect.
    assert np.all(np.diff(sensitivity) > 0)
    assert sensitivity[0] > 1e-4 * sensitivity[-1]
    np.testing.assert_allclose(sensitivity[[0, 43, 59, 74]], [0.26, 6.9, 16, 219], rtol=0.03)


def test_it_is_the_change_of_the_evidence_for_a_small_change(sensitivity):
    data = ModesResidual.of(measured_modes(MACHINE, POSITIONS), POSITIONS)
    step = 1e-4
    for number in (0, 40, 74):
        path = DISTURBABLE[number].path
        value = get_leaf(MACHINE, path)
        above, below = (np.asarray(data(set_leaves(MACHINE, {path: value * (1 + h)}))) for h in (step, -step))
        secant = np.sqrt(np.mean((above - below) ** 2)) / (2 * step)
        np.testing.assert_allclose(sensitivity[number], secant, rtol=1e-3)


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="rail"):
        evidence_sensitivity(MACHINE, DISTURBABLE[:1], [2.0])
    with pytest.raises(InputError, match="cover"):
        evidence_sensitivity(MACHINE, [Quantity("none", "masses.cover.volume", "m³", "none")], POSITIONS)
