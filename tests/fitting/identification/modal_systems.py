"""Structures with known modes, and their measured responses."""

import jax.numpy as jnp
import numpy as np

from twin.frf import FRF

FREQUENCY = np.array([20.0, 33.0, 34.0, 60.0, 80.0, 95.0])
RATIO = np.array([0.01, 0.005, 0.008, 0.03, 0.002, 0.01])
LINES = np.arange(10.0, 110.0, 0.25)
NAMES = tuple(f"{i} x" for i in range(1, 9))
FORMS = {"receptance": 0, "mobility": 1, "accelerance": 2}


def shapes_for(modes, rows=8, seed=0):
    return np.random.default_rng(seed).standard_normal((rows, modes))


def response(
    frequency, ratio, shapes, lines=LINES, *, inputs=(0,), form="receptance", hysteretic=False, noise=0.0, seed=1
):
    """Responses of mass-normalised real modes; noise as a share of the rms of all, and its variance not given."""
    s = 2j * np.pi * lines
    omega = 2 * np.pi * np.asarray(frequency)[:, None]
    ratio = np.asarray(ratio)[:, None]
    middle = 2j * ratio * omega**2 if hysteretic else 2 * ratio * omega * s
    modal = s ** FORMS[form] / (s**2 + middle + omega**2)
    values = np.einsum("om,mf,im->oif", shapes, modal, shapes[list(inputs)])
    size = noise * np.sqrt(np.mean(np.abs(values) ** 2))
    random = np.random.default_rng(seed)
    values = values + size * (random.standard_normal(values.shape) + 1j * random.standard_normal(values.shape))
    names = tuple(f"{i + 1} x" for i in range(shapes.shape[0]))
    excited = tuple(names[i] for i in inputs)
    return FRF(jnp.asarray(lines), jnp.asarray(values), names, excited, form), size


def write_uff(path, frf, motion=12, missing=()):
    """Responses as a universal file, along x; without those of `missing`, (output, input)."""
    import pyuff

    sets = []
    for i, output in enumerate(frf.outputs):
        for j, excitation in enumerate(frf.inputs):
            if (output, excitation) in missing:
                continue
            sets.append(
                pyuff.prepare_58(
                    binary=0,
                    func_type=4,
                    rsp_node=int(output.split()[0]),
                    rsp_dir=1,
                    ref_node=int(excitation.split()[0]),
                    ref_dir=1,
                    data=np.asarray(frf.values)[i, j],
                    x=np.asarray(frf.frequency),
                    **{f"id{k}": "tap" for k in range(1, 6)},
                    ver_num=1,
                    load_case_id=0,
                    z_axis_spec_data_type=0,
                    rsp_ent_name="NONE",
                    ref_ent_name="NONE",
                    abscissa_spacing=1,
                    abscissa_min=float(frf.frequency[0]),
                    abscissa_inc=float(frf.frequency[1] - frf.frequency[0]),
                    abscissa_spec_data_type=18,
                    ordinate_spec_data_type=motion,
                    orddenom_spec_data_type=13,
                )
            )
    pyuff.UFF(str(path)).write_sets(sets, "overwrite")
    return path


def state_space_modes(system, below):
    """Poles and shapes of M·ẍ + C·ẋ + (K + jD)·x = 0 by the eigenvalues of its state space, ascending."""
    mass, viscous = np.asarray(system.mass), np.asarray(system.viscous)
    stiffness = np.asarray(system.stiffness) + 1j * np.asarray(system.hysteretic)
    n = mass.shape[0]
    matrix = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, viscous + 0j)],
        ]
    )
    poles, vectors = np.linalg.eig(matrix)
    kept = np.flatnonzero((poles.imag > 0) & (np.abs(poles) < 2 * np.pi * below))
    kept = kept[np.argsort(np.abs(poles[kept]))]
    return poles[kept], np.asarray(system.output_map) @ vectors[:n, kept]


def state_space_response(system, lines):
    """Receptance P(K + jD + jωC - ω²M)⁻¹B, (outputs, inputs, lines)."""
    omega = 2 * np.pi * lines[:, None, None]
    dynamic = np.asarray(system.stiffness) + 1j * np.asarray(system.hysteretic)
    dynamic = dynamic + 1j * omega * np.asarray(system.viscous) - omega**2 * np.asarray(system.mass)
    forces = np.broadcast_to(np.asarray(system.input_map), (lines.size, *np.shape(system.input_map)))
    return np.moveaxis(np.asarray(system.output_map) @ np.linalg.solve(dynamic, forces), 0, -1)
