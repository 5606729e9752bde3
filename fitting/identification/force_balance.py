"""Stiffnesses from measured modes by balance of forces: no pairing of modes, no start near the solution.

In a mode, elastic and inertia forces balance: (K(p) - ω²M)·q = 0. Were q known in all degrees of freedom, this
would be linear in the stiffnesses. It is measured at some of them; the rest is what balances the forces best. So each
measured mode asks for the least of

    ‖W·(K(p) - ω²M)·q‖²/σ_e² + ‖P·q - φ‖²/σ_φ²

over its shape q, and the sum of all modes for the least over p. As no mode of the model is looked for, nothing can be
mistaken for a neighbour, which is what makes the fit of frequencies and shapes rough.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from twin._checks import InputError
from twin.modal import ReferenceModes, modes
from twin.parameters import ParameterSpace
from twin.structure import Machine

_AFFINE = 1e-9


class ForceBalance(NamedTuple):
    """Stiffnesses at which the forces of all measured modes balance best."""

    machine: Machine
    """The machine with these stiffnesses."""
    values: np.ndarray
    """The stiffnesses in the order of the space, SI."""
    cost: float
    """Half the sum of squares."""
    evaluations: int
    """Evaluations of all modes."""
    success: bool
    """Whether it converged."""


class _Position(NamedTuple):
    """One axis position in the modes of the machine at its start."""

    fixed: np.ndarray  # stiffness without the searched springs (n, n)
    springs: np.ndarray  # stiffness of each searched spring at its start (parameters, n, n)
    outputs: np.ndarray  # shapes at the outputs (outputs, n)
    own: np.ndarray  # eigenvalues (n,)
    squares: np.ndarray  # ω² of the reference (modes,)
    shapes: np.ndarray  # shapes of the reference (outputs, modes)


def force_balance(
    machine: Machine,
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    space: ParameterSpace,
    *,
    force_deviation: float = 0.1,
    shape_deviation: float = 1e-2,
    max_evaluations: int = 60,
) -> ForceBalance:
    """Identify stiffnesses of a machine from measured modes, from wherever it stands.

    Forces are weighed in the machine's own modes j by 1/(ω_j² + ω²): the relative error of a stiffness counts, whatever
    the mode. Solved by variable projection: the shapes are eliminated, and their reaction is part of the derivative as
    in Kaufman's form.

    Args:
        machine: start; what is not in the space stays as it is.
        references: measured modes at each position; frequencies and mass-normalised real shapes are used.
        positions: axis positions [m].
        space: stiffnesses of joints, on a logarithmic scale, with bounds.
        force_deviation: σ_e, standard deviation of the weighed forces of a shape of unit modal mass [-]. Without noise
            the result does not depend on it; large ones trust the measured shapes, small ones the model.
        shape_deviation: σ_φ, standard deviation of the shapes' entries, as a share of the shape's rms [-].
        max_evaluations: evaluations after which to give up.

    Returns:
        The stiffnesses.

    Raises:
        InputError: a parameter that the stiffness matrix is not proportional to, a parameter on a linear scale, an
            output that the machine does not have.

    Source: P. Ladevèze, D. Nedjar, M. Reynier, "Updating of finite element models using vibration tests", AIAA Journal
    32 (1994) 1485-1491, for the idea; L. Kaufman, BIT 15 (1975) 49-57, for the derivative.
    """
    if any(parameter.scale != "log" for parameter in space.parameters):
        name = next(parameter.path for parameter in space.parameters if parameter.scale != "log")
        raise InputError(
            f"{name!r} is on a linear scale, but the balance of forces needs stiffnesses on a logarithmic one: "
            "Parameter(..., scale='log')."
        )
    start = np.asarray(space.pack(machine))
    data = [_position(machine, r, z, space) for r, z in zip(references, positions, strict=True)]
    kept: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def balance(vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        key = vector.tobytes()
        if key not in kept:
            kept.clear()
            shares = np.exp(vector - start)
            parts = [_unbalanced(at, shares, force_deviation, shape_deviation) for at in data]
            kept[key] = np.concatenate([r for r, _ in parts]), np.concatenate([j for _, j in parts])
        return kept[key]

    def slopes(vector: np.ndarray) -> np.ndarray:
        return balance(vector)[1]

    jacobian: Any = slopes  # SciPy's annotations know names of rules only
    # On all cores the small factorisations wait for each other where the cores are busy: seen were 2.4 s for 12 ms.
    with threadpool_limits(1, user_api="blas"):
        found = least_squares(
            lambda x: balance(x)[0],
            np.clip(start, np.asarray(space.lower), np.asarray(space.upper)),
            jac=jacobian,
            bounds=(np.asarray(space.lower), np.asarray(space.upper)),
            x_scale="jac",
            max_nfev=max_evaluations,
            xtol=1e-10,
        )
    values = np.asarray(space.unscaled(jnp.asarray(found.x)))
    solved = space.with_values(machine, jnp.asarray(values))
    return ForceBalance(solved, values, float(found.cost), int(found.nfev), bool(found.success))


def _unbalanced(at: _Position, shares: np.ndarray, force: float, shape: float) -> tuple[np.ndarray, np.ndarray]:
    """Residual and Jacobian of all modes at one position, their unmeasured shapes eliminated."""
    stiffness = at.fixed + np.tensordot(shares, at.springs, 1)
    size, number = len(at.own), len(shares)
    phi = at.shapes.T
    weight = 1 / ((at.own + at.squares[:, None]) * force)
    scale = shape * np.sqrt(np.mean(phi**2, axis=1))[:, None]
    dynamic = stiffness - at.squares[:, None, None] * np.eye(size)
    left = np.concatenate([dynamic * weight[..., None], at.outputs / scale[..., None]], axis=1)
    right = np.concatenate([np.zeros_like(weight), phi / scale], axis=1)
    q, r = np.linalg.qr(left)
    whole = np.linalg.solve(r, np.einsum("mij,mi->mj", q, right)[..., None])[..., 0]
    moved = np.zeros((*right.shape, number))
    moved[:, :size] = np.einsum("pij,mj->mip", at.springs, whole) * shares * weight[..., None]
    residual = np.einsum("mij,mj->mi", left, whole) - right
    projected = moved - q @ (np.swapaxes(q, 1, 2) @ moved)
    return residual.ravel(), projected.reshape(-1, number)


def _position(machine: Machine, reference: ReferenceModes, position: float, space: ParameterSpace) -> _Position:
    """The machine at one position in its own modes, its stiffness split into what is searched and what is not."""
    here = jnp.asarray(float(position))
    basis, own, outputs, stiffness, springs, doubled = jax.tree.map(
        np.asarray, _matrices(space.values(machine), machine, here, reference.outputs, space)
    )
    if not np.allclose(doubled, stiffness + springs.sum(axis=0), rtol=0, atol=_AFFINE * np.abs(doubled).max()):
        raise InputError(
            "force_balance needs parameters that the stiffness matrix is linear in, but doubling all of "
            f"{', '.join(space.paths)} does not add what their derivatives say. Leave all but joint stiffnesses out."
        )
    turned = basis.T @ springs @ basis
    whole = basis.T @ stiffness @ basis
    squares = (2 * np.pi * np.asarray(reference.frequency)) ** 2
    shapes = np.asarray(reference.output_shapes)
    known = np.isfinite(squares) & np.all(np.isfinite(shapes), axis=0)
    return _Position(whole - turned.sum(axis=0), turned, outputs @ basis, own, squares[known], shapes[:, known])


@eqx.filter_jit
def _matrices(
    values: Float[Array, "parameters"],
    machine: Machine,
    position: Array,
    outputs: tuple[str, ...],
    space: ParameterSpace,
) -> tuple[Array, ...]:
    def stiffness(shares: Array) -> Array:
        moved = space.with_values(machine, values * shares)
        return moved.second_order(position, inputs=(), outputs=outputs).stiffness

    ones = jnp.ones(len(space))
    system = machine.second_order(position, inputs=(), outputs=outputs)
    own = modes(system)
    springs = jnp.moveaxis(jax.jacfwd(stiffness)(ones), -1, 0)
    return own.shapes, own.eigenvalues, system.output_map, system.stiffness, springs, stiffness(2 * ones)
