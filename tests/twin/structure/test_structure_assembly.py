"""Assembly of a machine: against hand-made matrices, closed forms and the whole that was cut in two."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from structure_systems import (
    LENGTH,
    LINE_MASS,
    STIFFNESS,
    beam,
    beam_matrices,
    rigid_body,
    rigid_motion,
    small_machine,
)

from twin.linear import frequency_response
from twin.modal import modes
from twin.paths import set_leaves
from twin.structure import Attachment, Component, Directions, Joint, LumpedMass, Machine


def test_two_rigid_bodies_against_hand_made_matrices():
    """δ = (u₁ + θ₁ × r₁) - (u₂ + θ₂ × r₂) at two places, K = Gᵀ·diag(k)·G in the bodies' own coordinates."""
    first = np.array([[0.3, 0.1, -0.2], [-0.4, 0.2, 0.1]])
    second = first - np.array([1.0, 0.2, -0.5])
    inertias = np.array([3.0, 3.0, 3.0, 0.2, 0.3, 0.4]), np.array([7.0, 7.0, 7.0, 0.9, 0.8, 0.5])
    k, c, d = np.array([1e5, 2e5, 3e5, 4e3, 5e3, 6e3]), np.arange(1.0, 7.0), np.arange(2.0, 8.0)
    machine = Machine(
        {"b": rigid_body(("B1", "B2"), second, inertias[1]), "a": rigid_body(("A1", "A2"), first, inertias[0])},
        {
            "j": Joint(
                [(Attachment("a", f"A{i}"), Attachment("b", f"B{i}")) for i in (1, 2)],
                Directions(*k),
                Directions(*c),
                Directions(*d),
            )
        },
    )
    system = machine.second_order(0.0)
    g = np.concatenate([np.concatenate([rigid_motion(first), -rigid_motion(second)], axis=2)[i] for i in (0, 1)])
    root = np.sqrt(np.concatenate(inertias))
    for found, values in ((system.stiffness, k), (system.viscous, c), (system.hysteretic, d)):
        expected = (g.T * np.tile(values, 2)) @ g / np.outer(root, root)
        assert np.allclose(found, expected, rtol=1e-13, atol=1e-12 * np.abs(expected).max())
    assert np.array_equal(system.mass, np.eye(12))
    mass = np.diag(root**2)
    exact = np.sqrt(np.maximum(scipy.linalg.eigh((g.T * np.tile(k, 2)) @ g, mass, eigvals_only=True), 0))
    found = modes(system).frequency
    assert np.all(found[:6] == 0.0), "a free machine has six rigid-body modes"
    assert np.allclose(found[6:], exact[6:] / (2 * np.pi), rtol=1e-10)


def test_stiffness_is_exact_in_the_joints_parameters():
    machine = small_machine()
    joined, system = machine.connections(0.1), machine.second_order(0.1)
    own = np.concatenate([machine.components[n].own_eigenvalues for n in ("bed", "screw", "table")])
    b = np.asarray(joined.vectors)
    assert np.allclose(system.stiffness, np.diag(own) + b @ np.diag(joined.stiffness) @ b.T, rtol=1e-13, atol=1e-8)
    assert np.allclose(system.viscous, b @ np.diag(joined.viscous) @ b.T, rtol=1e-13, atol=1e-10)
    assert np.allclose(system.hysteretic, np.diag(0.004 * own) + b @ np.diag(joined.hysteretic) @ b.T, atol=1e-8)
    assert len(joined.names) == b.shape[1] == 3 + 6 + 16 + 3 + 3 + 1
    assert joined.names[:4] == ("bearing 0 x", "bearing 0 y", "bearing 0 z", "coupling 0 rz")
    assert "guide 3 ry" in joined.names


def test_outputs_are_the_shapes_at_nodes_and_on_rails():
    machine = small_machine()
    system = machine.second_order(0.1)
    assert system.outputs == system.inputs == machine.outputs
    assert np.array_equal(system.input_map, system.output_map.T)
    row = dict(zip(system.outputs, np.asarray(system.output_map), strict=True))
    assert np.array_equal(row["B3 ry"][:9], machine.components["bed"].shapes[3, 4])
    assert np.all(row["B3 ry"][9:] == 0)
    assert np.array_equal(row["T2 x"][17:], machine.components["table"].shapes[2, 0])
    assert np.allclose(row["R1 y"][:9], machine.components["bed"].rails["left"].at(0.22)[1], rtol=1e-14)
    assert np.allclose(row["N rz"][9:17], machine.components["screw"].rails["shaft"].at(0.12)[5], rtol=1e-14)
    chosen = machine.second_order(0.1, inputs=("T0 z",), outputs=("R1 y", "B3 ry"))
    assert chosen.outputs == ("R1 y", "B3 ry") and chosen.inputs == ("T0 z",)
    assert np.array_equal(chosen.output_map, np.stack([row["R1 y"], row["B3 ry"]]))
    assert np.array_equal(chosen.input_map[:, 0], row["T0 z"])


def test_order_of_parts_does_not_depend_on_tree_operations():
    machine = small_machine()
    again = jax.tree.map(lambda x: x, machine)
    assert machine.outputs == again.outputs
    assert np.array_equal(machine.second_order(0.0).stiffness, again.second_order(0.0).stiffness)


def test_screw_and_nut():
    """A table's mass m and a screw's inertia J joined by z₁ - h/(2π)·rz₂: ω² = k·(1/m + (h/2π)²/J)."""
    m, inertia, k, lead = 300.0, 2e-3, 8e7, 0.02
    table = Component([0.0], np.eye(6)[None, :, 2:3] / np.sqrt(m), np.zeros((1, 3)), ("nut",))
    screw = Component([0.0], np.eye(6)[None, :, 5:6] / np.sqrt(inertia), np.zeros((1, 3)), ("shaft",))
    pair = (Attachment("table", "nut"), Attachment("screw", "shaft"))
    machine = Machine({"table": table, "screw": screw}, {"n": Joint([pair], Directions(z=k), lead=lead)})
    found = modes(machine.second_order(0.0))
    assert np.isclose(found.eigenvalues[1], k * (1 / m + (lead / (2 * np.pi)) ** 2 / inertia), rtol=1e-13)
    free = dict(zip(found.outputs, np.asarray(found.output_shapes[:, 0]), strict=True))
    assert np.isclose(free["nut z"], lead / (2 * np.pi) * free["shaft rz"], rtol=1e-10)


def test_lumped_mass_on_a_rigid_body():
    inertia = np.array([3.0, 3.0, 3.0, 0.2, 0.3, 0.4])
    r = np.array([0.4, -0.1, 0.3])
    machine = Machine(
        {"a": rigid_body(("A",), r[None], inertia)}, {}, {"m": LumpedMass(2.0, "a", "A", 0.01, 0.02, 0.03)}
    )
    motion = rigid_motion([r])[0]
    expected = np.diag(inertia) + motion.T @ np.diag([2.0, 2.0, 2.0, 0.01, 0.02, 0.03]) @ motion
    root = np.sqrt(inertia)
    assert np.allclose(machine.second_order(0.0).mass * np.outer(root, root), expected, rtol=1e-14, atol=1e-15)


def test_density_and_modulus_in_closed_form():
    """A free body twice as dense has frequencies 1/√2 as high; its static flexibility does not change."""
    machine = Machine({"beam": beam(("L", "R"), 12, LENGTH)})
    whole = modes(machine.second_order(0.0))
    other = set_leaves(machine, {"components.beam.density": 2.0, "components.beam.modulus": 3.0})
    scaled = modes(other.second_order(0.0))
    assert np.allclose(scaled.frequency, whole.frequency * np.sqrt(3.0 / 2.0), rtol=1e-12, atol=1e-9)
    assert np.allclose(np.abs(scaled.output_shapes), np.abs(whole.output_shapes) / np.sqrt(2.0), rtol=1e-9, atol=1e-12)
    mass, stiffness = beam_matrices(12, LENGTH, stiffness=3.0 * STIFFNESS, line_mass=2.0 * LINE_MASS)
    exact = scipy.linalg.eigh(stiffness, mass, eigvals_only=True)
    assert np.allclose(scaled.eigenvalues[2:], exact[2:], rtol=1e-8)
    moved = set_leaves(machine, {"components.beam.frequency.4": 1.1})
    assert np.allclose(
        modes(moved.second_order(0.0)).frequency,
        np.sort(np.asarray(whole.frequency) * np.where(np.arange(26) == 4, 1.1, 1.0)),
        rtol=1e-9,
        atol=1e-9,
    )


def halves(below, stiffness=1e11, static=False):
    """The beam cut in two and joined by springs in y and rz."""
    parts = {
        "left": beam(("L0", "L1"), 8, LENGTH / 2, below=below, interfaces=[-1] if static else None),
        "right": beam(("R0", "R1"), 8, LENGTH / 2, start=LENGTH / 2, below=below, interfaces=[0] if static else None),
    }
    pair = (Attachment("left", "L1"), Attachment("right", "R0"))
    return Machine(parts, {"cut": Joint([pair], Directions(y=stiffness, rz=stiffness), directions=("y", "rz"))})


def eigenvalues(machine):
    system = machine.second_order(0.0, inputs=(), outputs=())
    return scipy.linalg.eigh(np.asarray(system.stiffness), np.asarray(system.mass), eigvals_only=True)


def test_beam_cut_in_two_and_rejoined_is_the_whole():
    whole = scipy.linalg.eigh(*beam_matrices(16, LENGTH)[::-1], eigvals_only=True)
    values = eigenvalues(halves(1e9))
    assert np.allclose(values[2:12], whole[2:12], rtol=2e-4)
    roots = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671])
    exact = (roots / LENGTH) ** 2 * np.sqrt(STIFFNESS / LINE_MASS) / (2 * np.pi)
    assert np.allclose(np.sqrt(values[2:5]) / (2 * np.pi), exact, rtol=2e-4)


def test_truncated_halves_converge_to_the_whole_from_above():
    exact = eigenvalues(halves(1e9, 1e5))[2:6]
    errors = [eigenvalues(halves(below, 1e5))[2:6] / exact - 1 for below in (200.0, 1000.0, 5000.0)]
    assert np.all(np.asarray(errors) > -1e-9), "modes left out only stiffen"
    assert np.all(errors[1] < 0.5 * errors[0]) and np.all(errors[2] < 0.5 * errors[1])
    assert errors[2].max() < 0.1


def test_static_deflections_replace_modes_left_out():
    """With them, the modes below 200 Hz do better than those below 5 kHz alone."""
    exact = eigenvalues(halves(1e9, 1e5))[2:6]
    errors = [eigenvalues(halves(below, 1e5, static=True))[2:6] / exact - 1 for below in (200.0, 1000.0)]
    assert np.all(np.asarray(errors) > -1e-9)
    assert errors[0].max() < 1e-2 and errors[1].max() < 1e-5


def test_frequency_response_of_the_joined_beam():
    """The receptance at the beam's end is that of the whole's matrices."""
    machine = halves(1e9)
    f = np.array([3.0, 20.0, 55.0])
    found = frequency_response(machine.second_order(0.0, inputs=("L0 y",), outputs=("L0 y", "R1 y")), f)
    mass, stiffness = beam_matrices(16, LENGTH)
    for i, omega in enumerate(2 * np.pi * f):
        exact = np.linalg.solve(stiffness - omega**2 * mass, np.eye(34)[0])
        assert np.allclose(found.values[:, 0, i].real, exact[[0, 32]], rtol=1e-4)


def test_vmap_over_position_and_compiled_agree_with_one_by_one():
    machine = small_machine()
    positions = jnp.asarray([-0.2, 0.0, 0.15])
    batch = jax.jit(jax.vmap(lambda p: machine.second_order(p)))(positions)
    for i, position in enumerate(positions):
        one = machine.second_order(float(position))
        for name in ("mass", "viscous", "hysteretic", "stiffness", "input_map", "output_map"):
            assert np.allclose(getattr(batch, name)[i], getattr(one, name), rtol=1e-12, atol=1e-8), name


@pytest.mark.parametrize("text", [repr(small_machine()), repr(small_machine().components["bed"])])
def test_representation_is_short(text):
    assert len(text) < 120 and "\n" not in text
