"""The reference machine identified from its modes."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.identification.force_balance import force_balance
from fitting.identification.machine import identify_machine
from fitting.identification.machine_measurement import measured_modes, noisy
from fitting.identification.machine_study import (
    DISTURBED,
    IDENTIFICATION,
    VALIDATION,
    conformity_of,
    disturbed_machine,
    identify_truth,
    permuted_damping,
    random_truth,
)
from fitting.identification.machine_unknowns import stiffness_space, unknown_space
from twin._checks import InputError
from twin.modal import ReferenceModes
from twin.parameters import Parameter, ParameterSpace
from twin.structure.reference_machine import reference_machine

MACHINE = reference_machine()
SPACE = unknown_space(MACHINE, scale="log")


def without(reference, mode):
    kept = [i for i in range(reference.frequency.size) if i != mode]
    return ReferenceModes(
        reference.frequency[np.array(kept)],
        reference.damping_ratio[np.array(kept)],
        reference.output_shapes[:, np.array(kept)],
        reference.outputs,
    )


@pytest.mark.parametrize("seed", [0, 1])
def test_exact_modes_give_the_truth(seed):
    found = identify_truth(seed)
    assert np.abs(found.stiffness).max() < 1e-7
    assert np.abs(found.damping).max() < 1e-7
    assert not found.identification.unpaired
    # The balance of forces alone finds the stiffnesses, from the middle of the bounds.
    balanced, space = found.identification.start, stiffness_space(SPACE)
    true = np.asarray(space.values(random_truth(seed)))
    assert balanced.success
    np.testing.assert_allclose(balanced.values, true, rtol=1e-6)


def test_balance_of_forces_starts_anywhere_in_the_bounds():
    space = stiffness_space(SPACE)
    references = measured_modes(random_truth(3), IDENTIFICATION)
    true = np.asarray(space.values(random_truth(3)))
    for seed in (1, 2):
        shares = np.random.default_rng(seed).uniform(0.71, 1.29, len(space))
        start = space.with_values(MACHINE, space.values(MACHINE) * jnp.asarray(shares))
        np.testing.assert_allclose(force_balance(start, references, IDENTIFICATION, space).values, true, rtol=1e-6)


@pytest.mark.slow
def test_noise_and_a_missing_mode():
    truth = random_truth(2)
    references = list(noisy(measured_modes(truth, IDENTIFICATION), 1))
    references[1] = without(references[1], 7)
    found = identify_machine(MACHINE, references, IDENTIFICATION, SPACE)
    assert found.fit.success
    assert 0.9 < found.fit.rms < 1.1
    assert not found.unpaired
    true = np.asarray(SPACE.values(truth))
    score = (np.log(found.fit.values / true)) / np.sqrt(np.diag(found.fit.scaled_covariance))
    assert np.abs(score).max() < 4.5
    assert 0.6 < np.sqrt(np.mean(score**2)) < 1.5


@pytest.mark.slow
def test_a_mode_that_is_none_is_reported_and_left_out():
    truth = random_truth(2)
    references = list(measured_modes(truth, IDENTIFICATION))
    random = np.random.default_rng(0)
    shapes = np.asarray(references[0].output_shapes).copy()
    shapes[:, 12] = random.standard_normal(shapes.shape[0]) * np.sqrt(np.mean(shapes[:, 12] ** 2))
    frequency = np.asarray(references[0].frequency).copy()
    frequency[12] = 240.0
    references[0] = ReferenceModes(frequency, references[0].damping_ratio, shapes, references[0].outputs)
    found = identify_machine(MACHINE, references, IDENTIFICATION, SPACE)
    assert [(mode.position, mode.mode) for mode in found.unpaired] == [(IDENTIFICATION[0], 12)]
    np.testing.assert_allclose(found.fit.values, np.asarray(SPACE.values(truth)), rtol=1e-4)


@pytest.mark.slow
def test_disturbed_model_with_what_is_uncertain_let_go():
    plain = identify_truth(4, model=disturbed_machine(4))
    found = identify_truth(4, model=disturbed_machine(4), uncertain=DISTURBED)
    assert 5 * np.median(np.abs(found.stiffness)) < np.median(np.abs(plain.stiffness))
    assert np.abs(found.stiffness).max() < 0.005 < np.abs(plain.stiffness).max()
    truth = random_truth(4)
    held_back = conformity_of(found.identification.machine, truth, VALIDATION)
    assert held_back.macxp.worst > 99
    assert held_back.frac.mean > 99.8


@pytest.mark.slow
def test_the_same_deviations_of_other_dampings_are_worse():
    truth, found = random_truth(3), identify_truth(3, noise=1)
    own, control = (
        conformity_of(machine, truth, VALIDATION)
        for machine in (found.identification.machine, permuted_damping(found.identification.machine, truth))
    )
    assert control.ndd.mean > 2 * own.ndd.mean


@pytest.mark.slow
def test_frequencies_in_rad_per_second_do_not_pass_unnoticed():
    wrong = [
        ReferenceModes(2 * np.pi * one.frequency, one.damping_ratio, one.output_shapes, one.outputs)
        for one in measured_modes(random_truth(3), IDENTIFICATION)
    ]
    with pytest.warns(UserWarning, match="of 60 measured modes are paired.*Hz"):
        found = identify_machine(MACHINE, wrong, IDENTIFICATION, SPACE, start=MACHINE)
    assert not found.success
    assert "too unlike" in repr(found) and "too unlike" in found._repr_html_()


def test_bad_input():
    references = measured_modes(MACHINE, IDENTIFICATION)
    with pytest.raises(InputError, match="rail"):
        measured_modes(MACHINE, [2.0])
    with pytest.raises(InputError, match="rail"):
        identify_machine(MACHINE, references, [0.0, 0.1, 3.0], SPACE)
    with pytest.raises(InputError, match="fewer modes"):
        measured_modes(MACHINE, [0.0], count=100)
    with pytest.raises(InputError, match="2 positions"):
        identify_machine(MACHINE, references, [0.0, 0.1], SPACE)
    renamed = [
        ReferenceModes(r.frequency, r.damping_ratio, r.output_shapes, ("P1 x", *r.outputs[1:])) for r in references
    ]
    with pytest.raises(InputError, match="P1 x"):
        identify_machine(MACHINE, renamed, IDENTIFICATION, SPACE)
    with pytest.raises(InputError, match="stiffness matrix is linear in"):
        force_balance(
            MACHINE,
            references,
            IDENTIFICATION,
            ParameterSpace([Parameter("components.bed.density", "", 0.5, 2.0, scale="log")]),
        )
    with pytest.raises(InputError, match="logarithmic"):
        force_balance(
            MACHINE,
            references,
            IDENTIFICATION,
            ParameterSpace([Parameter("joints.guide.stiffness.x", "N/m", 1e8, 2e8)]),
        )


def test_what_would_pass_as_a_measurement_is_refused():
    references = measured_modes(MACHINE, IDENTIFICATION[:1], count=4)
    per_cent = [ReferenceModes(r.frequency, 100 * r.damping_ratio, r.output_shapes, r.outputs) for r in references]
    with pytest.raises(InputError, match="not per cent"):
        identify_machine(MACHINE, per_cent, IDENTIFICATION[:1], SPACE)
    with pytest.raises(InputError, match="same millimetre twice"):
        identify_machine(MACHINE, [*references, *references], [IDENTIFICATION[0]] * 2, SPACE)
    far = [ReferenceModes(1e4 * r.frequency, r.damping_ratio, r.output_shapes, r.outputs) for r in references]
    with pytest.raises(InputError, match="like any of the 4 measured"):
        identify_machine(MACHINE, far, IDENTIFICATION[:1], SPACE, start=MACHINE)
    dampings = SPACE.subset([path for path in SPACE.paths if ".stiffness." not in path])
    with pytest.raises(InputError, match="no stiffness of a joint"):
        identify_machine(MACHINE, references, IDENTIFICATION[:1], dampings)
