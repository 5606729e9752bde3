"""The reference machine: what is published of it holds, and each unknown shows in its modes."""

import importlib.util
from importlib.resources import files

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin.modal import modes
from twin.paths import get_leaf, set_leaves
from twin.structure.reference_machine import DISTURBABLE, MODES, POSITIONS, UNKNOWN, reference_machine

NODES = {f"N{i}{side}" for i in (1, 2, 3, 4, 5, 8, 9, 10, 19, 20, 21) for side in "ab"} | {
    f"N{i}" for i in (6, 7, 11, 12, 13, 14, 15, 16, 17, 18)
}
MEASURED = tuple(f"{node} {direction}" for node in sorted(NODES) for direction in "xyz")


@eqx.filter_jit
def modes_at(machine, position):
    """Frequencies, damping ratios and shapes, two modes more than are identified."""
    found = modes(machine.second_order(position, inputs=(), outputs=MEASURED))
    kept = slice(0, MODES + 2)
    return found.frequency[kept], found.damping_ratio[kept], found.output_shapes[:, kept]


def with_values(machine, paths, values):
    return set_leaves(machine, dict(zip(paths, values, strict=True)))


@pytest.fixture(scope="module")
def machine():
    return reference_machine()


@pytest.fixture(scope="module")
def nominal(machine):
    return {z: modes_at(machine, jnp.asarray(z)) for z in POSITIONS}


def test_nodes_of_table_1(machine):
    assert len(NODES) == 32
    assert {name.split()[0] for name in machine.outputs} == NODES
    assert len(machine.outputs) == 32 * 6


def test_unknowns_of_section_3(machine):
    assert len(UNKNOWN) == 27 and len({q.path for q in UNKNOWN}) == 27
    assert sum(q.kind == "stiffness" for q in UNKNOWN) == 16
    assert sum(q.kind in ("viscous", "hysteretic") for q in UNKNOWN) == 11
    assert all(float(get_leaf(machine, q.path)) > 0 for q in UNKNOWN)


def test_disturbable_quantities_are_others(machine):
    paths = [q.path for q in DISTURBABLE]
    assert len(set(paths)) == len(paths) >= 44
    assert not set(paths) & {q.path for q in UNKNOWN}
    assert all(float(get_leaf(machine, path)) != 0 for path in paths)
    kinds = {q.kind for q in DISTURBABLE}
    assert {"lumped mass", "frequency", "stiffness", "geometry", "density", "modulus"} <= kinds


def test_twenty_modes_to_311_hertz(nominal):
    frequency = np.array([nominal[z][0] for z in POSITIONS])
    assert abs(frequency[:, MODES - 1].mean() - 311) < 2
    assert np.all(np.abs(frequency[:, MODES - 1] - 311) < 6)
    assert np.all(frequency[:, MODES] > 1.03 * frequency[:, MODES - 1])
    assert np.all(np.diff(frequency[:, :MODES], axis=1) > 0.01 * frequency[:, : MODES - 1])


def test_nothing_is_unconstrained_and_all_is_lightly_damped(nominal):
    for z in POSITIONS:
        frequency, damping, _ = nominal[z]
        assert frequency[0] > 5
        assert np.all((damping[:MODES] > 0.003) & (damping[:MODES] < 0.065))
        assert np.sum((frequency > 14) & (frequency < 70)) == 6  # the bed on its mounting elements


def test_each_unknown_shows_in_the_modes(machine):
    """Standard errors with 0.1 % noise on frequencies, 1 % on shapes, 5 % on damping at positions 2 to 4."""
    paths = tuple(q.path for q in UNKNOWN)
    truth = np.array([get_leaf(machine, path) for path in paths])

    def evidence(logarithm, z):
        frequency, damping, shapes = modes_at(with_values(machine, paths, jnp.exp(logarithm)), z)
        scale = jax.lax.stop_gradient(jnp.sqrt(jnp.mean(shapes**2, axis=0)))
        parts = jnp.log(frequency) / 1e-3, jnp.log(damping) / 0.05, shapes / scale / 0.01
        return jnp.concatenate([part[..., :MODES].ravel() for part in parts])

    slopes = eqx.filter_jit(jax.jacfwd(evidence))
    jacobian = np.concatenate([slopes(jnp.log(truth), jnp.asarray(z)) for z in POSITIONS[1:]])
    errors = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    stiffness = np.array([q.kind == "stiffness" for q in UNKNOWN])
    assert errors[stiffness].max() < 0.01
    assert errors[~stiffness].max() < 0.3


def test_weak_quantities_are_weak(machine, nominal):
    """All of the 44 least sensitive changed by 1 to 5 % move no frequency by a percent but the first.

    There the whole feed drive stretches, and half of the springs in its chain are among the 44: they move next to
    nothing but this one frequency, by less than half of their change.
    """
    paths = tuple(q.path for q in DISTURBABLE[:44])
    values = np.array([get_leaf(machine, path) for path in paths])
    random = np.random.default_rng(1)
    for _ in range(3):
        change = random.uniform(0.01, 0.05, 44) * random.choice([-1, 1], 44)
        changed = with_values(machine, paths, values * (1 + change))
        for z in POSITIONS:
            frequency, _, _ = modes_at(changed, jnp.asarray(z))
            moved = np.abs(np.asarray(frequency / nominal[z][0]) - 1)[:MODES]
            assert 0 < moved[1:].max() < 0.01
            assert moved[0] < 0.025


def test_modes_are_smooth_in_the_position(machine):
    """Central differences at two steps agree with the derivative, on a stored point of the rails and off it."""
    for z in (POSITIONS[1], 0.11, POSITIONS[3]):
        at = jnp.asarray(z)
        _, slope = jax.jvp(lambda p: jnp.log(modes_at(machine, p)[0]), (at,), (jnp.ones(()),))
        for h in (1e-3, 5e-4):
            secant = (jnp.log(modes_at(machine, at + h)[0]) - jnp.log(modes_at(machine, at - h)[0])) / (2 * h)
            np.testing.assert_allclose(secant[:MODES], slope[:MODES], atol=2e3 * h**2)


def test_stored_arrays_are_small_and_plain():
    path = files("twin.structure") / "reference_machine.npz"
    assert len(path.read_bytes()) < 300_000
    with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
        assert all(stored[name].dtype == np.float64 for name in stored.files)


def test_free_components_have_six_rigid_body_modes(machine):
    for component in machine.components.values():
        eigenvalues = np.asarray(component.eigenvalues)
        assert np.all(eigenvalues[:6] == 0)
        assert np.all(eigenvalues[6:] > (2 * np.pi * 40) ** 2)


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("skfem") is None, reason="needs the extra finite-elements")
def test_rebuild_gives_the_same_arrays():
    from twin.structure.build_reference_machine import reference_arrays

    rebuilt = reference_arrays()
    with (files("twin.structure") / "reference_machine.npz").open("rb") as file, np.load(file) as stored:
        assert set(rebuilt) == set(stored.files)
        for name, values in rebuilt.items():
            np.testing.assert_allclose(values, stored[name], rtol=1e-6, atol=1e-8 * np.abs(stored[name]).max())
