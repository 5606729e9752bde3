"""The stabilisation diagram: poles that stay where they are while the order grows belong to the structure."""

import dataclasses
from collections.abc import Iterable

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from fitting.identification.modal_basis import ModalKind, modal_basis, shapes_of, solve_linear
from fitting.identification.modal_lscf import Poles

STATES = ("new", "frequency", "damping", "stable")
"""New; stable in frequency; in frequency and damping; in frequency, damping and shape."""
LARGEST_DAMPING = 0.2
"""Poles with more damping are taken for the noise's or the background's [-]."""
FREQUENCY_TOLERANCE, DAMPING_TOLERANCE, LEAST_MAC = 0.01, 0.05, 0.98
"""How far a stable pole may move from order to order [-, -, -]."""
# Orders that a pole may be missing before its track ends.
_GAP = 2


@dataclasses.dataclass(frozen=True)
class StabilisationDiagram:
    """Poles of all orders, in the band and with up to 20 % of damping, and which belong to one track."""

    order: Int[np.ndarray, "poles"]
    """Order of the model that each pole is of."""
    poles: Complex[np.ndarray, "poles"]
    """λ [rad/s]."""
    participation: Complex[np.ndarray, "poles inputs"]
    """Modal participations L [-]."""
    shapes: Complex[np.ndarray, "outputs poles"]
    """Shapes ψ."""
    state: Int[np.ndarray, "poles"]
    """Place in `STATES`: how much of the pole agrees with that of a lower order."""
    track: Int[np.ndarray, "poles"]
    """Number of the track that each pole is on, from 0."""
    orders: int
    """Highest order."""

    @property
    def frequency(self) -> Float[np.ndarray, "poles"]:
        """Natural frequencies [Hz]."""
        return np.abs(self.poles) / (2 * np.pi)

    @property
    def damping_ratio(self) -> Float[np.ndarray, "poles"]:
        """Damping ratios [-]."""
        return -np.real(self.poles) / np.abs(self.poles)

    @property
    def stable(self) -> Bool[np.ndarray, "poles"]:
        """Which poles are stable in frequency, damping and shape."""
        return self.state == len(STATES) - 1


def stabilisation_diagram(
    orders: Iterable[Poles],
    frequency: Float[np.ndarray, "frequencies"],
    values: Complex[np.ndarray, "outputs inputs frequencies"],
    weight: Float[np.ndarray, "frequencies"],
    kind: ModalKind,
) -> StabilisationDiagram:
    """Follow poles from order to order.

    Args:
        orders: poles of every order, from 1 on.
        frequency: lines [Hz].
        values: responses.
        weight: of each line, for the shapes.
        kind: what the responses are.
    """
    outputs, inputs = values.shape[:2]
    found, shapes, states, tracks, numbers = [], [], [], [], []
    last: dict[int, tuple[int, complex, np.ndarray]] = {}  # of each track: order, pole, shape
    count = 0
    n = 0
    for n, everything in enumerate(orders, start=1):
        inside = (everything.frequency >= frequency[0]) & (everything.frequency <= frequency[-1])
        poles = everything.take(inside & (everything.damping_ratio <= LARGEST_DAMPING))
        size = poles.poles.size
        if size:
            basis = modal_basis(frequency, poles.poles, poles.participation, kind)
            own = shapes_of(solve_linear(basis, values, weight)[0], size)
        else:
            own = np.zeros((outputs, 0), dtype=complex)
        alive = {track: entry for track, entry in last.items() if entry[0] >= n - 1 - _GAP}
        state, track = _linked(poles, own, alive)
        fresh = track < 0
        track[fresh] = count + np.arange(fresh.sum())
        count += int(fresh.sum())
        for i in range(size):
            last[int(track[i])] = (n, poles.poles[i], own[:, i])
        found.append(poles)
        shapes.append(own)
        states.append(state)
        tracks.append(track)
        numbers.append(np.full(size, n))
    return StabilisationDiagram(
        np.concatenate(numbers),
        np.concatenate([one.poles for one in found]),
        np.concatenate([one.participation for one in found]).reshape(-1, inputs),
        np.concatenate(shapes, axis=1),
        np.concatenate(states),
        np.concatenate(tracks),
        n,
    )


def _linked(
    poles: Poles, shapes: np.ndarray, tracks: dict[int, tuple[int, complex, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """State and track of each pole; -1 for one that is on no track yet."""
    from scipy.optimize import linear_sum_assignment

    size = poles.poles.size
    state, track = np.zeros(size, dtype=int), np.full(size, -1)
    if not (size and tracks):
        return state, track
    names = list(tracks)
    earlier = np.array([tracks[name][1] for name in names])
    old = np.stack([tracks[name][2] for name in names], axis=1)
    apart = np.abs(np.abs(poles.poles)[:, None] / np.abs(earlier) - 1)
    near = apart <= FREQUENCY_TOLERANCE
    alike = _mac(shapes, old)
    # Which of two near poles is which: by the distance of the poles, and by their shapes.
    distance = np.abs(poles.poles[:, None] - earlier) / np.abs(earlier) / FREQUENCY_TOLERANCE
    rows, columns = linear_sum_assignment(np.where(near, distance + 1 - alike, 1e6))
    ratio = -np.real(earlier) / np.abs(earlier)
    for i, j in zip(rows, columns, strict=True):
        if not near[i, j]:
            continue
        track[i] = names[j]
        damped = abs(poles.damping_ratio[i] - ratio[j]) <= DAMPING_TOLERANCE * ratio[j]
        # Shapes of a repeated pole are any of a plane: the plane is compared.
        shaped = alike[i, j] >= LEAST_MAC or _in_span(shapes[:, i], old[:, near[i]]) >= LEAST_MAC
        state[i] = 1 if not damped else 3 if shaped else 2
    return state, track


def _mac(shapes: np.ndarray, others: np.ndarray) -> np.ndarray:
    one, other = (x / np.maximum(np.linalg.norm(x, axis=0), 1e-300) for x in (shapes, others))
    return np.abs(one.conj().T @ other) ** 2


def _in_span(shape: np.ndarray, others: np.ndarray) -> float:
    """Share of a shape that is a combination of others; 0 where they would span everything."""
    if others.shape[1] < 2 or others.shape[1] >= others.shape[0]:
        return 0.0
    basis = np.linalg.svd(others / np.maximum(np.linalg.norm(others, axis=0), 1e-300), full_matrices=False)[0]
    return float(np.sum(np.abs(basis.conj().T @ shape) ** 2) / max(np.sum(np.abs(shape) ** 2), 1e-300))
