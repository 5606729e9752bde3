"""Derivatives of a machine's matrices, and of its modes, against central differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from structure_systems import small_machine

from twin.modal import modes
from twin.paths import get_leaf, set_leaves

PATHS = (
    "joints.mounting_1.stiffness.x",
    "joints.guide.stiffness.rx",
    "joints.guide.viscous.y",
    "joints.nut.hysteretic.z",
    "joints.nut.lead",
    "joints.guide.pairs.1.1.offset",
    "masses.motor.mass",
    "masses.motor.inertia_y",
    "components.bed.density",
    "components.table.modulus",
    "components.screw.frequency.7",
    "components.bed.loss_factor",
)
"""One of each kind."""
MACHINE = small_machine()
START = np.asarray([get_leaf(MACHINE, path) for path in PATHS] + [0.05])


def with_values(values):
    return set_leaves(MACHINE, {path: values[i] for i, path in enumerate(PATHS)}).second_order(values[-1])


def matrices(values):
    system = with_values(values)
    return {n: getattr(system, n) for n in ("mass", "viscous", "hysteretic", "stiffness", "output_map")}


def modal(values):
    found = modes(with_values(values))
    return {n: getattr(found, n) for n in ("frequency", "damping_ratio", "eigenvalues", "output_shapes")}


@pytest.mark.parametrize("function", [matrices, modal])
def test_against_central_differences(function):
    scales = np.where(START == 0, 1.0, np.abs(START))
    batch = jax.jit(jax.vmap(function))
    exact = jax.jit(jax.jacfwd(function))(jnp.asarray(START))
    steps = 1e-5 * np.diag(scales)
    rows = np.concatenate([START + steps, START - steps, START + 2 * steps, START - 2 * steps])
    found = {name: np.asarray(value).reshape(4, START.size, *value.shape[1:]) for name, value in batch(rows).items()}
    for name, value in found.items():
        near, far = value[0] - value[1], value[2] - value[3]
        differences = np.moveaxis((8 * near - far) / 12 / 1e-5, 0, -1)
        derivative = np.asarray(exact[name]) * scales
        tolerance = 1e-7 * np.max(np.abs(derivative)) + 1e-9 * np.max(np.abs(value[0]))
        assert np.all(np.isfinite(derivative)), name
        assert np.allclose(derivative, differences, rtol=1e-6, atol=tolerance), name
        used = np.max(np.abs(derivative.reshape(-1, START.size)), axis=0) > 0
        if name == "stiffness":
            assert list(used) == [True, True, False, False, True, True, False, False, True, True, True, False, True]


def test_reverse_mode_agrees():
    def cost(values):
        return jnp.sum(jnp.log(modes(with_values(values)).frequency[:10]))

    backward, forward = jax.jit(lambda v: (jax.grad(cost)(v), jax.jacfwd(cost)(v)))(jnp.asarray(START))
    assert np.allclose(backward, forward, rtol=1e-9, atol=1e-12 * np.max(np.abs(forward)))
