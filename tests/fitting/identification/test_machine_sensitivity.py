"""The Sobol study of a machine's modes: outputs against modes solved and compared one by one."""

import jax.numpy as jnp
import numpy as np
import pytest
from machine_cases import FEW, PLACES, measured, nominal, outputs, small_study, space
from threadpoolctl import threadpool_info

from fitting.identification.machine_affine import affine_machine
from fitting.identification.machine_evidence import evidence
from fitting.identification.machine_macxp import macxp_of_one_ratio
from fitting.identification.machine_sensitivity import machine_sensitivity, mode_outputs
from fitting.identification.machine_unknowns import unknown_space, unknowns
from fitting.shared_out import shared_out
from sensitivity import sobol_samples
from twin._checks import InputError
from twin.correlation import eigenvalue, macxp, macxp_of_modes, ndd_squared, pair_modes
from twin.modal import ReferenceModes, modes
from twin.parameters import Parameter, ParameterSpace


def test_the_closed_form_is_macxp_of_one_damping_ratio():
    rng = np.random.default_rng(0)
    for _ in range(20):
        shapes, f, ratio = rng.normal(size=(9, 2)), rng.uniform(10, 12, 2), rng.uniform(1e-3, 0.3)
        poles = eigenvalue(f, np.full(2, ratio))
        wanted = macxp(shapes[:, 0], poles[0], shapes[:, 1], poles[1])
        mac = (shapes[:, 0] @ shapes[:, 1]) ** 2 / np.prod(np.sum(shapes**2, axis=0))
        found = macxp_of_one_ratio(mac, 2 * np.pi * f[0], 2 * np.pi * f[1], ratio)
        np.testing.assert_allclose(found, wanted, rtol=1e-12)


def test_outputs_are_those_of_modes_solved_one_by_one():
    data = evidence(measured(), PLACES)
    parts = [affine_machine(nominal(), space(), one.position, one.outputs) for one in data]
    samples = sobol_samples(space(), 8, seed=2)
    shape, damping, unpaired = mode_outputs(parts, data, samples, threads=2)
    assert shape.shape == damping.shape == (8 * 29, 2 * FEW)
    marked = np.zeros(2 * FEW)
    for row in range(0, len(samples), 31):
        machine = space().with_values(nominal(), jnp.asarray(samples.values[row]))
        for number, (z, reference) in enumerate(zip(PLACES, measured(), strict=True)):
            found = modes(machine.second_order(z, inputs=(), outputs=outputs()))
            pairs, alike = pair_modes(found, reference), np.asarray(macxp_of_modes(found, reference))
            order = np.where(pairs.paired, pairs.order, alike.argmax(axis=0))
            own = slice(number * FEW, (number + 1) * FEW)
            marked[own] += ~np.asarray(pairs.paired)
            np.testing.assert_allclose(shape[row, own], alike[order, np.arange(FEW)], rtol=1e-8)
            ratio = ndd_squared(np.asarray(found.damping_ratio)[order], reference.damping_ratio)
            np.testing.assert_allclose(damping[row, own], ratio, rtol=1e-7, atol=1e-12)
    assert np.all((unpaired > 0) | (marked == 0))
    assert np.isfinite(shape).all() and np.isfinite(damping).all()


def test_a_study_names_its_outputs_and_sees_no_damper_in_a_shape():
    study = small_study()
    assert study.indices.outputs[0] == "MACXP mode 1 at -60 mm"
    assert study.indices.outputs[-1] == f"NDD² mode {FEW} at +330 mm"
    kinds = unknowns(space())
    assert np.all(study.total("MACXP")[:, kinds.damping] == 0)
    assert not study.searched()[:, kinds.damping].any()
    assert np.all(study.searched(interval=True) >= study.searched())
    assert study.unpaired.shape == (2 * FEW,)


def test_bounds_are_those_of_equation_14():
    made = unknown_space(nominal())
    value = np.asarray(made.values(nominal()))
    stiff = unknowns(made).kind == "stiffness"
    assert (stiff.sum(), (~stiff).sum()) == (16, 11)
    bounds = np.asarray([(p.lower, p.upper) for p in made.parameters]) / value[:, None]
    np.testing.assert_allclose(bounds[stiff], [[0.7, 1.3]] * 16)
    np.testing.assert_allclose(bounds[~stiff], [[1 / 3, 3.0]] * 11)


def blas_threads(_=None):
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_numpy_keeps_its_threads_afterwards():
    before = blas_threads()
    assert shared_out(blas_threads, range(2)) == [[1] * len(before)] * 2
    assert blas_threads() == before
    np.testing.assert_allclose(np.linalg.eigh(np.diag([1.0, 2.0]))[0], [1, 2])


def study(references=None, positions=PLACES, parameters=None):
    return machine_sensitivity(
        nominal(), measured() if references is None else references, positions, parameters or space(), seed=1, n=8
    )


def test_bad_input_is_refused():
    first, second = measured()
    with pytest.raises(InputError, match="1 sets of reference modes for 2 positions"):
        study([first])
    with pytest.raises(InputError, match="same millimetre twice"):
        study(positions=(0.1, 0.1))
    other = ReferenceModes(second.frequency, second.damping_ratio, second.output_shapes[:3], second.outputs[:3])
    with pytest.raises(InputError, match="other outputs"):
        study([first, other])
    undamped = ReferenceModes(second.frequency, 0 * second.damping_ratio, second.output_shapes, second.outputs)
    with pytest.raises(InputError, match="and damping ratio 0"):
        study([first, undamped])
    turned = ReferenceModes(second.frequency, second.damping_ratio, 1j * second.output_shapes, second.outputs)
    with pytest.raises(InputError, match="complex"):
        study([first, turned])
    with pytest.raises(InputError, match="no stiffness or damping of a joint"):
        study(parameters=ParameterSpace([Parameter("masses.cover.mass", "kg", 1.0, 2.0), *space().parameters]))
    with pytest.raises(InputError, match="does not act in 'y'"):
        study(
            parameters=ParameterSpace([Parameter("joints.z_brake.stiffness.y", "N/m", 1.0, 2.0), *space().parameters])
        )
    with pytest.raises(InputError, match="finite bounds"):
        study(parameters=ParameterSpace([Parameter("joints.guide.stiffness.z", "N/m")]))
