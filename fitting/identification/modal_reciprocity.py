"""Tests with more excitations than responses, turned around: by reciprocity the points that were hit respond.

A passive structure answers at A to a force at B as it answers at B to one at A, H_AB = H_BA. So a roving hammer, whose
many points are excitations, gives shapes at all of them.

Source: D. J. Ewins, "Modal Testing: Theory, Practice and Application", 2nd ed., Research Studies Press 2000, ch. 3.
"""

import jax.numpy as jnp

from twin.frf import FRF


def turned_around(frf: FRF) -> FRF:
    """The responses with excitations and responses swapped.

    Args:
        frf: responses of motion to force, each along the direction that its name says.
    """
    variance = None if frf.variance is None else jnp.swapaxes(frf.variance, 0, 1)
    return FRF(frf.frequency, jnp.swapaxes(frf.values, 0, 1), frf.inputs, frf.outputs, frf.form, variance)


def by_reciprocity(frf: FRF, reciprocal: bool | None) -> tuple[FRF, bool]:
    """The responses as they are analysed, and whether they were turned around.

    Args:
        frf: measured responses.
        reciprocal: whether to turn them; None where there are more excitations than responses.
    """
    outputs, inputs = frf.values.shape[:2]
    turn = inputs > outputs if reciprocal is None else reciprocal
    return (turned_around(frf), True) if turn else (frf, False)


def same_direction(one: str, other: str) -> int:
    """Whether two names are of one point and axis, as "3 z" and "3 -z".

    Args:
        one: name of a response or excitation.
        other: another.

    Returns:
        1 for one direction, -1 for opposite ones, 0 for another point or axis.
    """
    if one == other:
        return 1
    (point, _, axis), (there, _, along) = one.rpartition(" "), other.rpartition(" ")
    opposite = axis.removeprefix("-") == along.removeprefix("-") and axis != along
    return -1 if point and point == there and opposite else 0
