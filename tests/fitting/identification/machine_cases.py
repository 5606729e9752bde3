"""The reference machine with a known truth, its modes, and small studies of it that several tests share."""

import functools

import jax.numpy as jnp
import numpy as np

from fitting.identification.machine_sensitivity import machine_sensitivity
from fitting.identification.machine_unknowns import unknown_space, unknowns
from twin.modal import modes, reference_modes
from twin.structure.reference_machine import POSITIONS, reference_machine

PLACES = (POSITIONS[1], POSITIONS[3])
"""Axis positions used [m]."""
FEW = 6
"""Reference modes at each position."""


@functools.cache
def nominal():
    return reference_machine()


@functools.cache
def space():
    return unknown_space(nominal())


@functools.cache
def true_values(seed=3):
    rng = np.random.default_rng(seed)
    stiff = unknowns(space()).kind == "stiffness"
    share = np.where(stiff, rng.uniform(0.8, 1.2, len(space())), 2.0 ** rng.uniform(-1, 1, len(space())))
    return np.asarray(space().values(nominal())) * share


@functools.cache
def truth():
    return space().with_values(nominal(), jnp.asarray(true_values()))


@functools.cache
def outputs():
    return tuple(name for name in nominal().outputs if name.split()[1] in "xyz")


@functools.cache
def measured(count=FEW, places=PLACES):
    systems = [truth().second_order(z, inputs=(), outputs=outputs()) for z in places]
    return [reference_modes(modes(system), indices=tuple(range(count))) for system in systems]


@functools.cache
def small_study():
    return machine_sensitivity(nominal(), measured(), PLACES, space(), seed=1, n=16)
