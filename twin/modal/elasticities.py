"""How much each parameter moves each natural frequency."""

from collections.abc import Callable, Iterable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import InputError, require_x64
from twin.linear import SecondOrder
from twin.modal._eigen import generalised_eigh, guarded_root
from twin.modal.undamped import check_matrices
from twin.paths import get_leaf, leaf_paths, set_leaves


class Elasticities(eqx.Module):
    """Relative change of natural frequencies per relative change of parameters."""

    values: Float[Array, "modes parameters"]
    """d ln f / d ln p [-]; 0 for a rigid-body mode, which stays at zero whatever the parameters."""
    frequency: Float[Array, "modes"]
    """Natural frequencies f [Hz]."""
    paths: tuple[str, ...] = eqx.field(static=True)
    """Dotted paths of the parameters p."""

    def __getitem__(self, path: str) -> Float[Array, "modes"]:
        """Those of one parameter.

        Raises:
            InputError: a parameter that was not asked for.
        """
        if path not in self.paths:
            raise InputError(f"No elasticity to {path!r}; there are {', '.join(self.paths)}.")
        return self.values[:, self.paths.index(path)]


def _own_system(model: Any) -> SecondOrder:
    return model.second_order()


def elasticities(
    model: Any,
    paths: Iterable[str] | None = None,
    *,
    system: Callable[[Any], SecondOrder] = _own_system,
) -> Elasticities:
    """Elasticity of every natural frequency to every parameter, in one call; differentiable itself.

    Those to all stiffnesses of a model add up to ½ for each elastic mode, those to all masses and inertias to -½. At a
    repeated eigenvalue only their mean over the repeated modes has a meaning.

    Args:
        model: a model, its parameters anywhere in it.
        paths: dotted paths of the parameters, as `space.paths` of a `ParameterSpace`; every number of the model if not
            given.
        system: makes the second-order system of a model; its `second_order()` if not given.

    Returns:
        The elasticities, modes ascending in frequency.

    Raises:
        InputError: 64-bit mode off, a path that the model does not have, matrices as `modes` refuses them.

    Source: p·φᵀ(∂K/∂p - λ·∂M/∂p)φ/(2λ), as R. L. Fox, M. P. Kapoor, AIAA Journal 6 (1968) 2426-2429.
    """
    require_x64()
    names = leaf_paths(model) if paths is None else tuple(paths)
    check_matrices(system(model))
    nominal = [get_leaf(model, path) for path in names]

    def eigenvalues(change: Array) -> Array:
        changed = set_leaves(model, {path: p * (1 + x) for path, p, x in zip(names, nominal, change, strict=True)})
        matrices = system(changed)
        return generalised_eigh(matrices.stiffness, matrices.mass)[0]

    still = jnp.zeros(len(names))
    values, slopes = eigenvalues(still), jax.jacfwd(eigenvalues)(still)
    omega = guarded_root(values)
    moving = (omega > 0)[:, None]
    result = jnp.where(moving, slopes / jnp.where(moving, 2 * values[:, None], 1.0), 0.0 * omega[:, None])
    return Elasticities(result, omega / (2 * jnp.pi), names)
