"""A step of a system as a compiled program in a file, that any JAX runs without the model's Python."""

import hashlib
import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, require_x64
from twin.control.closed_loop import SampledLoop
from twin.export._library import library
from twin.export.one_step import Leaves, OneStep, one_step
from twin.io._files import existing_file
from twin.io._whole_file import whole_file
from twin.plant import AbstractPlant
from twin.stepping import AbstractStepping

_MAGIC = b"drivetwin step 1\n"
_PLATFORMS = ("cpu", "cuda", "rocm", "tpu")
_GROUPS = ("states", "inputs", "outputs", "parameters")


@dataclass(frozen=True)
class CompiledStep:
    """One step of a system: call it with states and inputs. Works inside `jax.jit` and `jax.lax.scan`."""

    states: tuple[str, ...]
    """Names of the states, in order."""
    inputs: tuple[str, ...]
    """Names of the inputs, in order."""
    outputs: tuple[str, ...]
    """Names of the outputs, in order."""
    parameters: tuple[str, ...]
    """Names of the parameters that can be changed, in order: dotted paths."""
    units: dict[str, dict[str, str]]
    """Units by name, for "states", "inputs", "outputs" and "parameters"; empty where not known."""
    period: float
    """Length of the step [s]."""
    platforms: tuple[str, ...]
    """Kinds of device that the program was compiled for, such as "cpu" and "cuda"."""
    initial_state: Float[Array, " states"]
    """State at the start."""
    rest_inputs: Float[Array, " inputs"]
    """Inputs of a system that is left alone."""
    parameter_values: Float[Array, " parameters"]
    """Values of the parameters in the model that was exported."""
    program: Any
    """The program, a `jax.export.Exported`."""

    def __call__(
        self,
        state: Float[ArrayLike, " states"],
        inputs: Float[ArrayLike, " inputs"],
        *,
        parameters: Float[ArrayLike, " parameters"] | None = None,
        time: Float[ArrayLike, ""] = 0.0,
    ) -> tuple[Float[Array, " states"], Float[Array, " outputs"]]:
        """One step, the inputs held over it.

        Args:
            state: states at its beginning, in the order of `states`.
            inputs: inputs, in the order of `inputs`.
            parameters: values in the order of `parameters`; those of the model that was exported if not given.
            time: time at its beginning [s], for plants that depend on it.

        Returns:
            The states one period later, and the outputs at the beginning of the step, for these inputs.
        """
        values = self.parameter_values if parameters is None else parameters
        arrays = (jnp.asarray(x, dtype=jnp.float64) for x in (values, state, inputs, time))
        after, measured = self.program.call(*arrays)
        return after, measured


def export_step(
    path: str | os.PathLike[str],
    system: AbstractPlant | SampledLoop,
    *,
    period: float | None = None,
    stepping: AbstractStepping | None = None,
    parameters: Iterable[str] | None = None,
    platforms: Iterable[str] = ("cpu", "cuda"),
) -> Path:
    """Write one step of a system as a compiled program; `load_step` reads it.

    The step is that of `simulate` with `ConstantSteps`, the inputs held over the period. States are those of the plant,
    and of a sampled loop also the controller's memory ("plant.position", "controller.previous"); inputs those of the
    plant, and of a sampled loop "reference.position", ..., "injection.command", ....

    Args:
        path: the file; one that exists is replaced.
        system: a plant, driven openly or in a closed loop; or a sampled loop without injection.
        period: length of the step [s]; of a sampled loop its own.
        stepping: constant steps, 4 to a period by default.
        parameters: dotted paths of the parameters that can still be changed, or of parts of the system; all finite
            numbers if not given.
        platforms: kinds of device to compile for; none of them need be here.

    Returns:
        Path of the file: a line that says what it is, names, units and values as one line of JSON, and the program as
        JAX serialises it. It holds no pickle.

    Raises:
        InputError: flatbuffers is not installed, 64-bit mode off, adaptive stepping, a period that is missing or not
            the loop's, an unknown path or platform, a folder that does not exist.
    """
    library("flatbuffers", "flatbuffers")
    from jax import export  # loaded late, with flatbuffers

    wanted = tuple(platforms)
    if not wanted or not set(wanted) <= set(_PLATFORMS):
        raise InputError(f"platforms must name some of {', '.join(_PLATFORMS)}, but is {wanted!r}. Correct the name.")
    step = one_step(system, period=period, stepping=stepping, parameters=parameters)
    groups = dict(zip(_GROUPS, (step.states, step.inputs, step.outputs, step.parameters), strict=True))
    shapes = [jax.ShapeDtypeStruct((len(groups[g].names),), jnp.float64) for g in ("parameters", "states", "inputs")]
    program = export.export(jax.jit(_flat(step)), platforms=wanted)(*shapes, _SCALAR)
    payload = bytes(program.serialize())
    about: dict[str, Any] = {"period": step.period, "digest": _digest(payload), "bytes": len(payload)}
    about["start"] = {name: groups[name].values.tolist() for name in ("states", "inputs", "parameters")}
    for name, leaves in groups.items():
        about[name] = [{"name": q.name, "unit": q.unit, "description": q.description} for q in leaves.names]
    with whole_file(path) as temporary:
        temporary.write_bytes(_MAGIC + json.dumps(about, ensure_ascii=False).encode() + b"\n" + payload)
    return Path(path)


def load_step(path: str | os.PathLike[str]) -> CompiledStep:
    """Read what `export_step` wrote. Reading runs nothing of the file; calling the step runs its program.

    Args:
        path: the file.

    Returns:
        The step, to be called with states and inputs.

    Raises:
        InputError: flatbuffers is not installed, 64-bit mode off, a file that does not exist, is none, is damaged, or
            was written by a JAX too new or too old for this one.
    """
    require_x64()
    library("flatbuffers", "flatbuffers")
    from jax import export  # loaded late, with flatbuffers

    file = existing_file(path, "Compiled step")
    data = file.read_bytes()
    if not data.startswith(_MAGIC):
        raise InputError(f"{str(file)!r} is no compiled step. Give a file that export_step wrote.")
    text, _, payload = data[len(_MAGIC) :].partition(b"\n")
    try:
        about = json.loads(text)
        if about["bytes"] != len(payload) or about["digest"] != _digest(payload):
            raise ValueError("its program is cut short or changed")
        names = {group: tuple(one["name"] for one in about[group]) for group in _GROUPS}
        units = {group: {one["name"]: one["unit"] for one in about[group]} for group in _GROUPS}
        start = {name: jnp.asarray(about["start"][name], dtype=jnp.float64) for name in about["start"]}
        # Only now, and only if it is whole: JAX reads it by its own schema.
        program = export.deserialize(bytearray(payload))
        return CompiledStep(
            states=names["states"],
            inputs=names["inputs"],
            outputs=names["outputs"],
            parameters=names["parameters"],
            units=units,
            period=float(about["period"]),
            platforms=tuple(program.platforms),
            initial_state=start["states"],
            rest_inputs=start["inputs"],
            parameter_values=start["parameters"],
            program=program,
        )
    except Exception as error:  # whatever a damaged file makes the readers raise
        raise InputError(
            f"{str(file)!r} cannot be read ({type(error).__name__}: {error}). Export the step again, with this version "
            "of JAX."
        ) from error


_SCALAR = jax.ShapeDtypeStruct((), np.dtype("float64"))


def _flat(step: OneStep) -> Any:
    """The step as a function of vectors."""

    def run(p: Array, x: Array, u: Array, t: Array) -> tuple[Array, Array]:
        groups = _arrays(step.parameters, p), _arrays(step.states, x), _arrays(step.inputs, u)
        return _vector(step.advance(*groups, t)), _vector(step.observe(*groups, t))

    return run


def _arrays(leaves: Leaves, vector: Array) -> list[Array]:
    found, begin = [], 0
    for array in leaves.arrays:
        found.append(vector[begin : begin + array.size].reshape(array.shape).astype(array.dtype))
        begin += array.size
    return found


def _vector(arrays: list[Array]) -> Array:
    return jnp.concatenate([jnp.ravel(jnp.asarray(array, dtype=jnp.float64)) for array in arrays])


def _digest(payload: bytes) -> str:
    return hashlib.sha256(payload).hexdigest()
