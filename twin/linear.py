"""Linear systems: state space and second order, linearisation, frequency response."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, ArrayLike, Complex, Float, PyTree

from twin._checks import InputError, as_array, as_scalar, require_x64
from twin._small_systems import solve_many
from twin._tree_names import leaf_name
from twin.frf import FRF
from twin.plant import AbstractPlant


class StateSpace(eqx.Module):
    """ẋ = A·x + B·u(t - delay),  y = C·x + D·u(t - delay), around an operating point."""

    a: Float[Array, "states states"] = eqx.field(converter=as_array)
    """System matrix A."""
    b: Float[Array, "states inputs"] = eqx.field(converter=as_array)
    """Input matrix B."""
    c: Float[Array, "outputs states"] = eqx.field(converter=as_array)
    """Output matrix C."""
    d: Float[Array, "outputs inputs"] = eqx.field(converter=as_array)
    """Feed-through matrix D."""
    inputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the inputs."""
    outputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the outputs."""
    delay: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Dead time between input and system [s]."""

    def response(self, frequency: Float[Array, "frequencies"]) -> Complex[Array, "outputs inputs frequencies"]:
        """Complex response C(jωI - A)⁻¹B + D, times e^(-jω·delay), at frequencies [Hz]."""
        s = 2j * jnp.pi * frequency
        states = solve_many(jnp.eye(self.a.shape[0])[..., None] * s - self.a[..., None], _at_all(self.b, frequency))
        return (jnp.einsum("ij,jkf->ikf", self.c + 0j, states) + self.d[..., None]) * jnp.exp(-s * self.delay)


class SecondOrder(eqx.Module):
    """M·ẍ + C·ẋ + (K + jD)·x = B·u,  y = P·x: mass, viscous damping, hysteretic damping, stiffness."""

    mass: Float[Array, "dofs dofs"] = eqx.field(converter=as_array)
    """Mass matrix M [kg]."""
    viscous: Float[Array, "dofs dofs"] = eqx.field(converter=as_array)
    """Viscous damping matrix C [Ns/m]."""
    hysteretic: Float[Array, "dofs dofs"] = eqx.field(converter=as_array)
    """Hysteretic damping matrix D [N/m]."""
    stiffness: Float[Array, "dofs dofs"] = eqx.field(converter=as_array)
    """Stiffness matrix K [N/m]."""
    input_map: Float[Array, "dofs inputs"] = eqx.field(converter=as_array)
    """Where the inputs act, B."""
    output_map: Float[Array, "outputs dofs"] = eqx.field(converter=as_array)
    """What is measured, P."""
    inputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the inputs."""
    outputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the outputs."""

    def response(self, frequency: Float[Array, "frequencies"]) -> Complex[Array, "outputs inputs frequencies"]:
        """Complex receptance P(-ω²M + jωC + jD + K)⁻¹B at frequencies [Hz]."""

        omega = 2 * jnp.pi * frequency
        mass, viscous = self.mass[..., None], self.viscous[..., None]
        real = self.stiffness[..., None] - omega**2 * mass
        imaginary = omega * viscous + self.hysteretic[..., None]
        motion = solve_many(real + 1j * imaginary, _at_all(self.input_map, frequency))
        return jnp.einsum("ij,jkf->ikf", self.output_map + 0j, motion)


def _at_all(matrix: Array, frequency: Array) -> Array:
    """A complex copy of a matrix for every frequency, on the last axis."""
    return jnp.broadcast_to(matrix[..., None] + 0j, (*matrix.shape, frequency.size))


def linearise(
    plant: AbstractPlant,
    state: PyTree[Array] | None = None,
    inputs: PyTree[Array] | None = None,
    *,
    outputs: tuple[str, ...] | None = None,
    time: ArrayLike = 0.0,
    delay: ArrayLike = 0.0,
) -> StateSpace:
    """The plant near an operating point, by automatic differentiation.

    Args:
        plant: any plant.
        state: operating point; the plant's initial state if not given.
        inputs: operating inputs; the rest inputs if not given.
        outputs: names of the outputs to keep; all if not given.
        time: time [s], for plants that depend on it.
        delay: dead time to put before the system [s].

    Returns:
        The state space, its inputs and outputs named as the plant's.

    Raises:
        InputError: 64-bit mode off, or an output that the plant does not have.
    """
    require_x64()
    t = jnp.asarray(time, dtype=jnp.float64)
    state = plant.initial_state() if state is None else state
    inputs = plant.rest_inputs() if inputs is None else inputs
    x0, to_state = ravel_pytree(state)
    u0, to_inputs = ravel_pytree(inputs)
    names = plant.outputs(t, state, inputs)._fields
    chosen = names if outputs is None else outputs
    for name in chosen:
        if name not in names:
            raise InputError(f"The plant has no output {name!r}; it has {', '.join(names)}.")

    def rate(x: Array, u: Array) -> Array:
        return ravel_pytree(plant.vector_field(t, to_state(x), to_inputs(u)))[0]

    def measured(x: Array, u: Array) -> Array:
        everything = plant.outputs(t, to_state(x), to_inputs(u))
        return jnp.stack([getattr(everything, name) for name in chosen])

    a, b = jax.jacfwd(rate, argnums=(0, 1))(x0, u0)
    c, d = jax.jacfwd(measured, argnums=(0, 1))(x0, u0)
    return StateSpace(a, b, c, d, _names(inputs), tuple(chosen), jnp.asarray(delay, dtype=jnp.float64))


def frequency_response(
    system: StateSpace | SecondOrder,
    frequency: Float[ArrayLike, "..."],
    *,
    inputs: tuple[str, ...] | None = None,
    outputs: tuple[str, ...] | None = None,
) -> FRF:
    """Frequency response of a linear system; differentiable.

    Args:
        system: linear system.
        frequency: frequencies [Hz], a vector.
        inputs: names of the inputs wanted; all if not given.
        outputs: names of the outputs wanted; all if not given.

    Returns:
        The response, (response, excitation, frequency), e^{+jωt}.

    Raises:
        InputError: 64-bit mode off, frequencies not a vector, unknown input or output.
    """
    require_x64()
    f = jnp.asarray(frequency, dtype=jnp.float64)
    if f.ndim != 1:
        raise InputError(f"frequency must be a vector [Hz], but has shape {f.shape}.")
    rows = _indices("output", system.outputs, outputs)
    columns = _indices("input", system.inputs, inputs)
    response = system.response(f)[np.ix_(rows, columns)]
    return FRF(
        f, response, tuple(system.outputs[i] for i in rows), tuple(system.inputs[i] for i in columns), form="ratio"
    )


def _indices(kind: str, names: tuple[str, ...], wanted: tuple[str, ...] | None) -> list[int]:
    if wanted is None:
        return list(range(len(names)))
    for name in wanted:
        if name not in names:
            raise InputError(f"The system has no {kind} {name!r}; it has {', '.join(names)}.")
    return [names.index(name) for name in wanted]


def _names(tree: PyTree[Array]) -> tuple[str, ...]:
    names = []
    for keys, leaf in jax.tree_util.tree_leaves_with_path(tree):
        name = leaf_name(keys)
        names += [name] if jnp.ndim(leaf) == 0 else [f"{name}.{i}" for i in range(jnp.size(leaf))]
    return tuple(names)
