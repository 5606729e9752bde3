"""Resonances of many variants of a two-mass drive, against NumPy's loop over eigenproblems."""

import jax
import numpy as np
from jaxtyping import Array

from tests.benchmarks.sections import Options, Section
from tests.benchmarks.summary import compared
from twin.drives import TwoMass, two_mass_modes
from twin.laws import ViscousFriction

STIFFNESS = np.linspace(50.0, 200.0, 1000)


def section(options: Options) -> Section:
    """One table with one ratio; the peer is timed only if its answers agree."""
    batch = jax.jit(jax.vmap(resonance))
    row = compared(
        "1000 resonances",
        "NumPy",
        lambda: np.array([peer_resonance(k) for k in STIFFNESS]),
        lambda: np.asarray(batch(STIFFNESS)),
        limit=1e-6,
        rounds=options.rounds,
    )
    return Section(f"## Modes in a batch\n\nNumPy takes {row.ratio} times as long.\n", {"ratio": row.ratio}, [row])


def resonance(stiffness: Array) -> Array:
    """Of one variant [Hz]."""
    still = ViscousFriction(0.0)
    return two_mass_modes(TwoMass(2e-3, 3e-3, stiffness, 0.0, still, still, gain=0.5)).resonance


def peer_resonance(stiffness: float) -> float:
    """Of one variant, by NumPy [Hz]."""
    matrix = stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    squares = np.linalg.eigvals(np.diag([1 / 2e-3, 1 / 3e-3]) @ matrix)
    return float(np.sqrt(squares.real.max()) / (2 * np.pi))
