"""Machines with known answers: rigid bodies, a beam cut in two, a small machine with everything in it."""

import numpy as np

from twin.structure import (
    Attachment,
    Component,
    Directions,
    Joint,
    LumpedMass,
    Machine,
    component_from_modes,
    component_modes,
)

LENGTH, STIFFNESS, LINE_MASS = 2.0, 4.0e4, 15.0
"""Length of the beam [m], its bending stiffness EI [N m²], its mass per length [kg/m]."""


def skew(r):
    """The matrix of r × ."""
    x, y, z = r
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def rigid_motion(points):
    """Motion of points in six directions per motion of the reference point, (points, 6, 6)."""
    return np.stack([np.block([[np.eye(3), -skew(r)], [np.zeros((3, 3)), np.eye(3)]]) for r in points])


def rigid_body(names, points, inertia, **more):
    """A rigid body with its centre of mass at the origin; `inertia` is (m, m, m, Jx, Jy, Jz)."""
    shapes = rigid_motion(points) / np.sqrt(inertia)
    return Component(np.zeros(6), shapes, points, names, **more)


def beam_matrices(elements, length, *, stiffness=STIFFNESS, line_mass=LINE_MASS):
    """M and K of a free Euler-Bernoulli beam along x in (y, rz) of each node."""
    h, n = length / elements, 2 * (elements + 1)
    m_element = (
        line_mass
        * h
        / 420
        * np.array(
            [
                [156, 22 * h, 54, -13 * h],
                [22 * h, 4 * h**2, 13 * h, -3 * h**2],
                [54, 13 * h, 156, -22 * h],
                [-13 * h, -3 * h**2, -22 * h, 4 * h**2],
            ]
        )
    )
    k_element = (
        stiffness
        / h**3
        * np.array(
            [
                [12, 6 * h, -12, 6 * h],
                [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                [-12, -6 * h, 12, -6 * h],
                [6 * h, 2 * h**2, -6 * h, 4 * h**2],
            ]
        )
    )
    mass, stiff = np.zeros((n, n)), np.zeros((n, n))
    for e in range(elements):
        own = slice(2 * e, 2 * e + 4)
        mass[own, own] += m_element
        stiff[own, own] += k_element
    return mass, stiff


def beam(names, elements, length, *, start=0.0, below=1e9, interfaces=None, **more):
    """A free beam with nodes at its two ends and a rail along all of it."""
    x = np.linspace(0, length, elements + 1)
    rows = np.arange(2 * (elements + 1)).reshape(-1, 2)
    ends = [[start, 0, 0], [start + length, 0, 0]]
    return component_modes(
        *beam_matrices(elements, length),
        names,
        ends,
        rows[[0, -1]],
        below=below,
        interfaces=None if interfaces is None else rows[interfaces],
        directions=("y", "rz"),
        rails={"line": (x, rows)},
        **more,
    )


def small_machine(seed=0, modes=(9, 8, 8)):
    """Bed on the ground, table on four shoes, screw with a nut: every kind of part, numbers at random."""
    rng = np.random.default_rng(seed)
    line = np.linspace(-0.5, 0.5, 11)
    bend = np.stack([np.ones_like(line), line, np.cos(3 * line), np.sin(4 * line)])

    def body(names, count, rails=()):
        def smooth():
            return np.einsum("kp,dmk->pdm", bend, rng.normal(size=(6, count, 4)))

        return component_from_modes(
            np.r_[np.zeros(6), rng.uniform(40, 300, count - 6)],
            rng.normal(size=(len(names), 6, count)),
            names,
            rng.normal(size=(len(names), 3)),
            loss_factor=0.004,
            rails={rail: (line, smooth()) for rail in rails},
        )

    def numbers(directions, size):
        return Directions(**{d: size * rng.uniform(0.5, 2.0) for d in directions})

    def joint(pairs, directions, **more):
        laws = [numbers(directions, size) for size in (3e5, 40.0, 2e3)]
        return Joint(pairs, *laws, directions=directions, **more)

    shoes = [
        (Attachment("table", f"T{i}"), Attachment("bed", rail=side, offset=shift, name=f"R{i}"))
        for i, (side, shift) in enumerate([("left", -0.1), ("left", 0.12), ("right", -0.11), ("right", 0.1)])
    ]
    return Machine(
        {
            "table": body(("T0", "T1", "T2", "T3", "T4"), modes[1]),
            "bed": body(("B0", "B1", "B2", "B3"), modes[0], ("left", "right")),
            "screw": body(("S0", "S1"), modes[2], ("shaft",)),
        },
        {
            "mounting_1": joint([(Attachment("bed", "B0"), None)], ("x", "y", "z")),
            "mounting_2": joint([(Attachment("bed", "B1"), None)], ("x", "y", "z", "rx", "ry", "rz")),
            "guide": joint(shoes, ("x", "y", "rx", "ry")),
            "bearing": joint([(Attachment("bed", "B2"), Attachment("screw", "S0"))], ("x", "y", "z")),
            "nut": joint(
                [(Attachment("table", "T4"), Attachment("screw", rail="shaft", offset=0.02, name="N"))],
                ("x", "y", "z"),
                lead=0.3,
            ),
            "coupling": joint([(Attachment("screw", "S1"), None)], ("rz",)),
        },
        {"motor": LumpedMass(2.0, "bed", "B3", 0.02, 0.03, 0.04)},
    )
