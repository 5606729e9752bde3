"""Screening of a machine's parameters: exact derivatives, bounds above total effects, and studies of what is kept."""

import jax.numpy as jnp
import numpy as np
import pytest
from machine_cases import FEW, PLACES, measured, nominal, small_study, space

from fitting.identification.machine_affine import affine_machine
from fitting.identification.machine_evidence import evidence
from fitting.identification.machine_macxp import macxp_of_one_ratio, macxp_slope
from fitting.identification.machine_pairing import paired_samples
from fitting.identification.machine_screening import screen_machine
from fitting.identification.machine_sensitivity import DAMPING, SHAPE, machine_sensitivity
from fitting.identification.machine_slopes import mode_slopes
from fitting.identification.machine_unknowns import unknowns
from sensitivity import derivative_samples
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace


@pytest.fixture(scope="module")
def screening():
    return screen_machine(nominal(), measured(), PLACES, space(), seed=1)


def test_the_slope_of_macxp_is_that_of_differences():
    omega, ratio, step = np.linspace(50.0, 70.0, 9), np.asarray(0.02), 1e-5
    above, below = (macxp_of_one_ratio(0.9, omega + h, 60.0, ratio) for h in (step, -step))
    np.testing.assert_allclose(macxp_slope(0.9, omega, 60.0, ratio), (above - below) / (2 * step), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(macxp_slope(0.9, 60.0, 60.0, ratio), 0.0, atol=1e-12)


def test_derivatives_are_those_of_differences():
    """Central differences of fourth order, in shares of each parameter."""
    data = evidence(measured(), PLACES)[1]
    part = affine_machine(nominal(), space(), data.position, data.outputs)
    samples = derivative_samples(space(), 8, seed=4)

    def at(values):
        found = paired_samples(part, data, values[:, part.stiffness], 0.3)
        return found, mode_slopes(part, data, found, values[:, part.damping])

    found, slopes = at(samples)
    np.testing.assert_array_equal(slopes.macxp, found.macxp)
    steps, weights, width = np.asarray([-2, -1, 1, 2]), np.asarray([1, -8, 8, -1]) / 12, 5e-4
    for number in range(len(space())):
        moved = np.repeat(samples[None], 4, axis=0)
        moved[..., number] *= 1 + width * steps[:, None]
        beside, there = at(moved.reshape(-1, len(space())))
        assert np.array_equal(beside.order.reshape(4, 8, FEW), np.repeat(found.order[None], 4, axis=0))
        for name in ("macxp", "ndd"):
            secant = np.tensordot(weights / width, getattr(there, name).reshape(4, 8, FEW), 1)
            exact = getattr(slopes, f"d_{name}")[..., number] * samples[:, number, None]
            np.testing.assert_allclose(exact, secant, rtol=1e-4, atol=1e-6)


def test_repeated_modes_have_finite_derivatives():
    data = evidence(measured(), PLACES)[0]
    part = affine_machine(nominal(), space(), data.position, data.outputs)
    values = derivative_samples(space(), 8, seed=4)
    found = paired_samples(part, data, values[:, part.stiffness], 0.3)
    twice = found.eigenvalues.copy()
    twice[:, 2] = twice[:, 1]
    slopes = mode_slopes(part, data, found._replace(eigenvalues=twice), values[:, part.damping])
    assert all(np.isfinite(array).all() for array in slopes)


def test_bounds_are_above_total_effects(screening):
    """Within the interval of a small study; no damper turns a shape, and every stiffness moves some mode."""
    study, kinds = small_study(), unknowns(space())
    assert screening.problems == study.problems and screening.measures.outputs == study.indices.outputs
    for kind in (SHAPE, DAMPING):
        rows = [study.indices.index(f"{kind} {name}") for name in study.problems]
        lowest = study.total(kind) - study.indices.ST_conf[rows]
        cleared = ~screening.matters(kind)
        assert np.all(lowest[cleared] <= screening.bound(kind)[cleared] + 1e-12)
        assert np.all(lowest[cleared] < 0.01)
    jumping = screening.unpaired > 0
    assert screening.matters(DAMPING)[np.ix_(jumping, kinds.stiffness)].all()
    assert not screening.matters(SHAPE)[:, kinds.damping].any()
    assert screening.matters(SHAPE)[:, kinds.stiffness].any(axis=1).all()
    assert set(screening.kept) | set(screening.left_out) == set(space().paths)
    may = screening.matters(SHAPE).any(axis=0) | screening.matters(DAMPING).any(axis=0)
    assert screening.kept == tuple(path for path, matters in zip(space().paths, may, strict=True) if matters)


def test_what_is_left_out_is_held_in_the_middle_and_has_no_effect():
    left = ("joints.coupling.hysteretic.rz", "joints.mounting_2.stiffness.y")
    kept = [path for path in reversed(space().paths) if path not in left]
    study = machine_sensitivity(nominal(), measured(), PLACES, space(), seed=1, n=8, only=kept)
    assert study.left_out == tuple(path for path in space().paths if path in left)
    assert study.indices.names == space().paths
    numbers = [space().paths.index(path) for path in left]
    assert np.all(study.indices.ST[:, numbers] == 0) and np.all(study.indices.S1_conf[:, numbers] == 0)
    middle = [np.mean([space()[path].lower, space()[path].upper]) for path in study.left_out]
    held = space().subset(study.left_out).with_values(nominal(), jnp.asarray(middle))
    alone = machine_sensitivity(held, measured(), PLACES, space().subset(kept[::-1]), seed=1, n=8)
    others = [i for i in range(len(space())) if i not in numbers]
    np.testing.assert_allclose(study.indices.ST[:, others], alone.indices.ST, rtol=1e-6, atol=1e-9)
    assert study.searched().shape == (2 * FEW, len(space()))


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="No free parameter"):
        machine_sensitivity(nominal(), measured(), PLACES, space(), seed=1, n=8, only=["joints.guide.stiffness.z"])
    damper = ["joints.coupling.hysteretic.rz"]
    with pytest.raises(InputError, match="No stiffness is studied"):
        machine_sensitivity(nominal(), measured(), PLACES, space(), seed=1, n=8, only=damper)
    with pytest.raises(InputError, match="threshold"):
        screen_machine(nominal(), measured(), PLACES, space(), seed=1, n=8, threshold=1.5)
    mass = ParameterSpace([Parameter("masses.cover.mass", "kg", 1.0, 2.0)])
    with pytest.raises(InputError, match="no stiffness or damping of a joint"):
        screen_machine(nominal(), measured(), PLACES, mass, seed=1, n=8)
