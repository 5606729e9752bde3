"""Modal evidence and priors as data."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.identification.machine_measurement import measured_modes
from fitting.identification.machine_unknowns import unknown_space
from fitting.residuals.modes import ModesResidual
from fitting.residuals.prior import GaussianPrior
from twin._checks import InputError
from twin.modal import ReferenceModes
from twin.structure.reference_machine import reference_machine

MACHINE = reference_machine()
POSITIONS = (-0.06, 0.33)
REFERENCES = measured_modes(MACHINE, POSITIONS, count=6, outputs=("N6 x", "N6 y", "N6 z", "N16 x", "N12 y", "N8b z"))


def test_its_own_modes_leave_nothing():
    residual = ModesResidual.of(REFERENCES, POSITIONS)
    assert np.abs(np.asarray(residual(MACHINE))).max() < 1e-6
    assert residual(MACHINE).shape == (2 * (6 + 6 * 6 + 6),)
    only = ModesResidual.of(REFERENCES, POSITIONS, kinds=("frequency",))
    assert only(MACHINE).shape == (12,)


def test_sign_and_order_of_the_reference_do_not_matter():
    first = REFERENCES[0]
    order = np.array([3, 0, 5, 1, 2, 4])
    signs = np.array([1.0, -1.0, 1.0, -1.0, -1.0, 1.0])
    mixed = ReferenceModes(
        first.frequency[order], first.damping_ratio[order], first.output_shapes[:, order] * signs, first.outputs
    )
    residual = ModesResidual.of([mixed, REFERENCES[1]], POSITIONS)
    assert np.abs(np.asarray(residual(MACHINE))).max() < 1e-6


def test_a_missing_mode_counts_for_nothing_and_takes_none_away():
    first = REFERENCES[0]
    fewer = ReferenceModes(first.frequency[1:], first.damping_ratio[1:], first.output_shapes[:, 1:], first.outputs)
    residual = ModesResidual.of([fewer, REFERENCES[1]], POSITIONS)
    np.testing.assert_array_equal(residual.weight, [[1, 1, 1, 1, 1, 0], [1] * 6])
    assert np.abs(np.asarray(residual(MACHINE))).max() < 1e-6


@pytest.mark.slow
def test_derivatives_agree_with_central_differences():
    space = unknown_space(MACHINE, scale="log")
    residual = ModesResidual.of(REFERENCES, POSITIONS)
    start = space.pack(MACHINE) + 0.05 * np.random.default_rng(0).standard_normal(len(space))

    @jax.jit
    def values(vector):
        return residual(space.with_values(MACHINE, space.unscaled(vector)))

    found = np.asarray(jax.jacfwd(values)(start))
    step = 1e-4
    offsets = step * np.eye(len(space))
    expected = np.stack(
        [
            (8 * (values(start + h) - values(start - h)) - (values(start + 2 * h) - values(start - 2 * h)))
            / (12 * step)
            for h in offsets
        ],
        axis=1,
    )
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


def test_bad_evidence():
    with pytest.raises(InputError, match="1 sets of reference modes for 2 positions"):
        ModesResidual.of(REFERENCES[:1], POSITIONS)
    other = measured_modes(MACHINE, POSITIONS[1:], count=6, outputs=("N6 x",))
    with pytest.raises(InputError, match="other outputs"):
        ModesResidual.of([REFERENCES[0], *other], POSITIONS)
    with pytest.raises(InputError, match="phase"):
        ModesResidual.of([REFERENCES[0]], [0.0], kinds=("phase",))
    with pytest.raises(InputError, match="shape_deviation"):
        ModesResidual.of([REFERENCES[0]], [0.0], shape_deviation=0.0)
    first = REFERENCES[0]
    turned = ReferenceModes(first.frequency, first.damping_ratio, first.output_shapes * 1j, first.outputs)
    with pytest.raises(InputError, match="complex"):
        ModesResidual.of([turned], [0.0])


def test_prior():
    path = "joints.guide.stiffness.x"
    value = float(MACHINE.joints["guide"].stiffness.x)
    prior = GaussianPrior(jnp.asarray([value * 0.9]), jnp.asarray([value * 0.05]), (path,))
    np.testing.assert_allclose(prior(MACHINE), [2.0], rtol=1e-12)
    with pytest.raises(InputError, match="deviation"):
        GaussianPrior(jnp.ones(1), jnp.zeros(1), (path,))
    with pytest.raises(InputError, match="2 paths"):
        GaussianPrior(jnp.ones(1), jnp.ones(1), (path, "x"))
