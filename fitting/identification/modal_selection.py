"""Which poles of a stabilisation diagram are modes of the structure."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fitting.identification.modal_stabilisation import StabilisationDiagram
from twin._checks import InputError

# A pole of the structure is stable at this share of the orders, and at no fewer orders than that.
_SHARE, _LEAST = 0.25, 3
# Poles nearer to each other than this share of their half-width, with one participation, are one.
_SAME, _ALIKE = 0.2, 0.9
# How far from a frequency named by the user a pole may be.
_NEAR = 0.05


class Candidate(NamedTuple):
    """A pole that is stable over many orders."""

    pole: complex
    """λ [rad/s]."""
    participation: np.ndarray
    """Participations (inputs,)."""
    stable: int
    """At how many orders it is stable."""
    near: int
    """At how many orders it is stable in frequency at least."""


def candidates(diagram: StabilisationDiagram) -> list[Candidate]:
    """Every track that is ever stable, ascending in frequency.

    Args:
        diagram: the diagram.
    """
    found = []
    for track in np.unique(diagram.track[diagram.stable]):
        here = np.flatnonzero((diagram.track == track) & diagram.stable)
        # Poles settle with the order: of the upper half the one in the middle.
        late = here[here.size // 2 :]
        middle = np.median(np.real(diagram.poles[late])) + 1j * np.median(np.imag(diagram.poles[late]))
        one = late[np.argmin(np.abs(diagram.poles[late] - middle))]
        found.append(
            Candidate(
                complex(diagram.poles[one]),
                diagram.participation[one],
                here.size,
                int(np.count_nonzero((diagram.track == track) & (diagram.state > 0))),
            )
        )
    return sorted(_distinct(found), key=lambda one: abs(one.pole))


def chosen(
    found: list[Candidate], modes: int | Sequence[float] | None, orders: int, band: tuple[float, float]
) -> tuple[list[Candidate], list[str]]:
    """The candidates that are taken for modes, and what is to be said about it.

    Args:
        found: candidates.
        modes: how many are wanted, or about which frequencies [Hz]; None takes all that are stable at enough orders.
        orders: highest order of the diagram.
        band: lowest and highest frequency looked at [Hz].

    Raises:
        InputError: no stable pole, fewer than wanted, or none near a frequency wanted.
    """
    where = f"{band[0]:.6g} to {band[1]:.6g} Hz"
    if not found:
        raise InputError(
            f"No pole is stable in {where}: there seems to be no mode. Look where resonances stand out, by the band; "
            "where one does here, raise order, or measure with less noise."
        )
    listed = ", ".join(f"{abs(one.pole) / (2 * np.pi):.4g}" for one in found)
    if modes is None:
        needed = max(_LEAST, int(np.ceil(_SHARE * orders)))
        # Noise shakes the damping of a weak mode from order to order, but not its frequency.
        taken = [one for one in found if one.stable >= _LEAST and one.near >= needed]
        if not taken:
            raise InputError(
                f"No pole is stable in {where} at {needed} of {orders} orders: there seems to be no mode. The "
                f"candidates are at {listed} Hz. Raise order, narrow the band, or name the frequencies wanted by modes."
            )
        return taken, [
            f"Not taken: {abs(one.pole) / (2 * np.pi):.4g} Hz, found at {one.near} of {orders} orders only (at least "
            f"{needed} are asked for; name it in modes to take it)."
            for one in found
            if one.stable >= _LEAST and one.near < needed
        ]
    if isinstance(modes, int | np.integer):
        if not 1 <= modes <= len(found):
            raise InputError(
                f"modes is {modes}, but {len(found)} poles are stable ({listed} Hz). Ask for as many or fewer, or "
                "raise order."
            )
        ranked = sorted(found, key=lambda one: (-one.stable, -one.near))
        return sorted(ranked[: int(modes)], key=lambda one: abs(one.pole)), []
    return _named(found, [float(one) for one in modes], listed), []


def _named(found: list[Candidate], wanted: list[float], listed: str) -> list[Candidate]:
    taken: list[Candidate] = []
    for frequency in sorted(wanted):
        free = [one for one in found if not any(one is other for other in taken)]
        if not (np.isfinite(frequency) and frequency > 0):
            raise InputError(f"modes names {frequency:g} Hz, but a frequency must be positive and finite.")
        best = min(free, key=lambda one: abs(abs(one.pole) / (2 * np.pi) - frequency), default=None)
        if best is None or abs(abs(best.pole) / (2 * np.pi) / frequency - 1) > _NEAR:
            raise InputError(
                f"No stable pole lies within {100 * _NEAR:g} % of {frequency:g} Hz; they are at {listed} Hz. Name one "
                "of these, or raise order."
            )
        taken.append(best)
    return sorted(taken, key=lambda one: abs(one.pole))


def _distinct(found: list[Candidate]) -> list[Candidate]:
    kept: list[Candidate] = []
    for one in sorted(found, key=lambda one: -one.stable):
        twin = any(
            abs(one.pole - other.pole) < _SAME * min(-one.pole.real, -other.pole.real)
            and abs(np.vdot(one.participation, other.participation)) ** 2 > _ALIKE
            for other in kept
        )
        if not twin:
            kept.append(one)
    return kept
