"""Bad input to machines, components and joints: one clear error each."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from structure_systems import LENGTH, beam_matrices, rigid_body, small_machine

from twin._checks import InputError
from twin.structure import (
    Attachment,
    Component,
    Directions,
    Joint,
    LumpedMass,
    Machine,
    Rail,
    component_from_modes,
    component_modes,
)

BODY = rigid_body(("A", "B"), np.zeros((2, 3)), np.ones(6))
FLAT = component_from_modes([0.0], np.ones((1, 3, 1)), ["F"], [[0.0, 0, 0]], directions=("x", "y", "z"))


def machine(first="a", node="A", *, components=None, **more):
    joint = Joint([(Attachment(first, node), None)], Directions(x=1.0), **more)
    return Machine(components or {"a": BODY}, {"j": joint})


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: machine("c"), "Joint 'j', pair 0: there is no component 'c'; the machine has a"),
        (lambda: machine(node="C"), "component 'a' has no node 'C'; it has A, B"),
        (
            lambda: Machine({"a": BODY}, {"j": Joint([(Attachment("a", rail="left"), None)])}),
            "component 'a' has no rail 'left'; it has none",
        ),
        (lambda: Machine({"a": BODY}, {}, {"m": LumpedMass(1.0, "a", "C")}), "Lumped mass 'm': .* no node 'C'"),
        (lambda: Machine({"a": BODY, "b": BODY}), "node name 'A' occurs twice"),
        (lambda: Machine({"a.b": BODY}), "'a.b' must be text without a dot"),
        (lambda: Machine({}), "components is empty"),
        (lambda: machine(components={"a": FLAT}, node="F"), "acts in rx, ry, rz, but .* known in x, y, z only"),
        (
            lambda: Machine(
                {"a": BODY, "b": FLAT},
                {"s": Joint([(Attachment("a", "A"), Attachment("b", "F"))], lead=0.01, directions=("z",))},
            ),
            "has a lead, but the shapes of component 'b' are not known in rz",
        ),
        (lambda: Joint([(Attachment("a", "A"), None)], Directions(x=-1.0)), "stiffness.x must not be negative.*-1"),
        (lambda: Joint([(Attachment("a", "A"), None)], viscous=Directions(rz=np.nan)), "viscous.rz must be finite"),
        (lambda: Joint([]), "at least one pair"),
        (lambda: Joint([(Attachment("a", "A"), None)], directions=("x", "u")), "one is 'u'"),
        (lambda: Joint([(Attachment("a", "A"), None)], Directions(y=2.0), directions=("x",)), "stiffness.y is 2"),
        (lambda: Joint([(Attachment("a", "A"), None)], lead=0.01), "ends on the ground"),
        (lambda: Attachment("a"), "takes a node or a rail"),
        (lambda: Attachment("a", "A", "left"), "takes a node or a rail"),
        (lambda: LumpedMass(-1.0, "a", "A"), "mass must not be negative"),
        (lambda: Component([0.0], np.zeros((2, 6, 1)), np.zeros((1, 3)), ("A",)), r"shapes must have .*\(1, 6, 1\)"),
        (lambda: Component([0.0], np.zeros((1, 6, 1)), np.zeros((2, 3)), ("A",)), "positions must have"),
        (lambda: Component([-1.0], np.zeros((1, 6, 1)), np.zeros((1, 3)), ("A",)), "eigenvalues must not be neg"),
        (lambda: Component([1.0], np.zeros((2, 6, 1)), np.zeros((2, 3)), ("A", "A")), "A occurs twice"),
        (
            lambda: Component(
                [1.0],
                np.zeros((1, 6, 1)),
                np.zeros((1, 3)),
                ("A",),
                rails={"r": Rail(np.arange(4.0), np.zeros((4, 6, 2)))},
            ),
            "shapes of rail 'r' must have",
        ),
        (lambda: component_from_modes([1.0], np.zeros((1, 6, 1)), ["A"], np.zeros((1, 3)), modes=2), "modes is 2"),
        (
            lambda: component_from_modes([1.0], np.zeros((1, 6, 2)), ["A"], np.zeros((1, 3))),
            r"shapes must have the shape \(1, 6, 1\)",
        ),
        (
            lambda: component_from_modes([1.0], np.zeros((1, 6, 1)), ["A"], np.zeros((1, 3)), modal_mass=[0.0]),
            "modal_mass must be positive",
        ),
    ],
)
def test_bad_parts(build, message):
    with pytest.raises(InputError, match=message):
        build()


def test_bad_requests():
    one = small_machine()
    with pytest.raises(InputError, match=r"off rail '(left|right|shaft)' of component '(bed|screw)'.*-0.5 to 0.5"):
        one.second_order(0.6)
    with pytest.raises(InputError, match="position must be finite"):
        one.second_order(np.nan)
    with pytest.raises(InputError, match="no node and direction 'X x'"):
        one.second_order(0.0, outputs=("X x",))
    with pytest.raises(InputError, match="no node and direction 'B0'"):
        one.second_order(0.0, inputs=("B0",))


def test_a_traced_position_off_the_rail_is_marked():
    one = small_machine()
    stiffness = jax.jit(jax.vmap(lambda p: one.second_order(p).stiffness))(jnp.asarray([0.1, 0.7]))
    assert np.all(np.isfinite(stiffness[0]))
    assert np.any(np.isnan(stiffness[1]))


def test_bad_matrices():
    mass, stiffness = beam_matrices(4, LENGTH)
    rows, places = np.array([[0, 1]]), np.zeros((1, 3))

    def made(m=mass, k=stiffness, dofs=rows, below=1e3):
        return component_modes(m, k, ["A"], places, dofs, below=below, directions=("y", "rz"))

    assert made().eigenvalues[0] == made().eigenvalues[1] == 0.0
    for bad, message in (
        (dict(m=mass[:4, :4]), "of one size"),
        (dict(m=np.diag([0.0] + [1.0] * 9)), "not positive definite"),
        (dict(k=stiffness + np.eye(10, k=1) * 1e6), "stiffness must be symmetric"),
        (dict(k=-stiffness), "lowest eigenvalue is -"),
        (dict(k=stiffness + 1e9 * np.eye(10), below=2.0), "no mode below 2 Hz"),
        (dict(dofs=np.array([[0, 10]])), "integers from 0 to 9"),
        (dict(dofs=np.array([[0.0, 1.0]])), "integers from 0 to 9"),
        (dict(below=0.0), "below must be positive"),
    ):
        with pytest.raises(InputError, match=message):
            made(**bad)


def test_modes_below_a_frequency_are_kept():
    mass, stiffness = beam_matrices(6, LENGTH)
    values = scipy.linalg.eigh(stiffness, mass, eigvals_only=True)
    below = (values[5] * values[6]) ** 0.25 / (2 * np.pi)
    part = component_modes(mass, stiffness, ["A"], np.zeros((1, 3)), [[0, 1]], below=below, directions=("y", "rz"))
    assert part.eigenvalues.size == 6
    assert np.allclose(part.eigenvalues[2:], values[2:6], rtol=1e-9)
