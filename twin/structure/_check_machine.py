"""Checks of a machine's parts against each other."""

import numpy as np

from twin._checks import InputError, is_concrete
from twin.structure.component import Component
from twin.structure.joint import Attachment, Joint
from twin.structure.lumped_mass import LumpedMass


def check_machine(components: dict[str, Component], joints: dict[str, Joint], masses: dict[str, LumpedMass]) -> None:
    """Raise unless every place exists, every name is unique, and joints act in directions that are known.

    Args:
        components: components by name.
        joints: joints by name.
        masses: lumped masses by name.

    Raises:
        InputError: naming the part and what is wrong with it.
    """
    if not components:
        raise InputError("components is empty. A machine needs at least one component.")
    for kind, parts in (("component", components), ("joint", joints), ("lumped mass", masses)):
        for name in parts:
            if not name or "." in name:
                raise InputError(f"The {kind} name {name!r} must be text without a dot: dots part a parameter's path.")
    names = [node for component in components.values() for node in component.nodes]
    for joint_name, joint in joints.items():
        for number, pair in enumerate(joint.pairs):
            for place in pair:
                if place is not None:
                    what = f"Joint {joint_name!r}, pair {number}"
                    _check_place(what, place, components)
                    _check_directions(what, joint, components[place.component], place.component)
                    names += [place.name] if place.name else []
        if is_concrete(joint.lead) and np.any(np.asarray(joint.lead) != 0):
            _check_screw(joint_name, joint, components)
    for mass_name, mass in masses.items():
        place = Attachment(mass.component, mass.node)
        _check_place(f"Lumped mass {mass_name!r}", place, components)
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(
            f"The node name {twice[0]!r} occurs twice in the machine. Give each node, and each named point on a "
            "rail, a name of its own."
        )


def _check_place(what: str, place: Attachment, components: dict[str, Component]) -> None:
    if place.component not in components:
        raise InputError(
            f"{what}: there is no component {place.component!r}; the machine has {', '.join(sorted(components))}. "
            "Correct the name or add the component."
        )
    component = components[place.component]
    if place.node is not None and place.node not in component.nodes:
        raise InputError(
            f"{what}: component {place.component!r} has no node {place.node!r}; it has "
            f"{', '.join(component.nodes) or 'none'}. Correct the name or import the node."
        )
    if place.rail is not None and place.rail not in component.rails:
        raise InputError(
            f"{what}: component {place.component!r} has no rail {place.rail!r}; it has "
            f"{', '.join(sorted(component.rails)) or 'none'}. Correct the name or add the rail."
        )


def _check_directions(what: str, joint: Joint, component: Component, name: str) -> None:
    missing = [direction for direction in joint.directions if direction not in component.directions]
    if missing:
        raise InputError(
            f"{what} acts in {', '.join(missing)}, but the shapes of component {name!r} are known in "
            f"{', '.join(component.directions)} only. Import shapes with these directions, or leave them out of the "
            "joint's directions."
        )


def _check_screw(name: str, joint: Joint, components: dict[str, Component]) -> None:
    for _, shaft in joint.pairs:
        if shaft is not None and "rz" not in components[shaft.component].directions:
            raise InputError(
                f"Joint {name!r} has a lead, but the shapes of component {shaft.component!r} are not known in rz. "
                "Import its rotations."
            )
