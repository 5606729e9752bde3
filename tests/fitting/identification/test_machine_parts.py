"""The small problems of a machine: gradient, runs, checks against all modes, and the rules of selection."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from machine_cases import FEW, PLACES, measured, nominal, outputs, space, true_values

from fitting.identification import machine_parts
from fitting.identification.machine_affine import affine_machine
from fitting.identification.machine_evidence import evidence
from fitting.identification.machine_likeness import PartData, Shares, Unlikeness, unlikeness
from fitting.identification.machine_part_data import PartProblem, data_from_mode, data_from_start
from fitting.identification.machine_part_runs import PartRuns, best_macxp
from fitting.identification.machine_parts import solve_parts
from fitting.identification.machine_selection import select_stiffness
from fitting.identification.machine_unknowns import unknowns
from twin._checks import InputError
from twin.correlation import macxp_of_modes
from twin.modal import modes
from twin.parameters import Parameter, ParameterSpace

SEARCHED = (0, 1, 2, 12, 23)
"""Stiffnesses searched in the tests of one problem: ME1 k_x, k_y, k_z, ME3 k_x, LGS k_x with its four shoes."""


def problem(mode, drawn, prepare=data_from_start):
    """Data of runs of one problem, and the machine at its position."""
    data = evidence(measured(), PLACES)[0]
    part = affine_machine(nominal(), space(), data.position, data.outputs)
    mask = np.isin(part.stiffness, SEARCHED)
    bounds = np.asarray([(p.lower, p.upper) for p in space().parameters])[part.stiffness]
    values = bounds[:, 0] + drawn * (bounds[:, 1] - bounds[:, 0])
    rows = int(mask[part.spring_of].sum()) + 2
    leaves = prepare(PartProblem(part, data, mode, mask, bounds, rows, int(mask.sum())), values)
    return tuple(jnp.asarray(leaf) for leaf in leaves), mask, part, values


def test_the_likeness_is_that_of_the_machine_and_its_gradient_right():
    drawn = np.random.default_rng(1).random((6, 16))
    for mode in range(FEW):
        data, mask, part, values = problem(mode, drawn)
        share = jnp.asarray(drawn[:, mask])
        value, slope = unlike(share, data)
        all_modes = best_macxp([(part, evidence(measured(), PLACES)[0], mode)], values[None])[0]
        np.testing.assert_allclose(1 - value, all_modes, atol=1e-9)
        step = 1e-5 * np.eye(mask.sum())
        up, down = ([unlike(share + e, data)[0] for e in sign * step] for sign in (1, -1))
        central = (np.stack(up, axis=1) - np.stack(down, axis=1)) / 2e-5
        np.testing.assert_allclose(slope, central, atol=2e-7 * np.abs(central).max() + 1e-9)


def test_from_the_mode_most_alike_the_likeness_is_exact_there_and_right_near_by():
    drawn = np.random.default_rng(5).random((4, 16))
    for mode in range(FEW):
        data, mask, part, values = problem(mode, drawn, data_from_mode)
        owner = [(part, evidence(measured(), PLACES)[0], mode)]
        share = jnp.asarray(drawn[:, mask])
        np.testing.assert_allclose(1 - unlike(share, data)[0], best_macxp(owner, values[None])[0], atol=1e-12)
        bounds = np.asarray([(p.lower, p.upper) for p in space().parameters])[part.stiffness]
        near = values + mask * 1e-3 * (bounds[:, 1] - bounds[:, 0])
        np.testing.assert_allclose(1 - unlike(share + 1e-3, data)[0], best_macxp(owner, near[None])[0], atol=1e-9)


def test_the_residual_is_differentiable_forward_and_in_reverse():
    drawn = np.random.default_rng(2).random((1, 16))
    data, mask, *_ = problem(2, drawn)
    data = PartData(*(leaf[0] for leaf in data))

    def cost(share):
        return 0.5 * jnp.sum(Unlikeness(data)(Shares(share)) ** 2)

    share = jnp.asarray(drawn[0, mask])
    value, slope = unlikeness(share, data)
    np.testing.assert_allclose(cost(share), value, rtol=1e-12)
    for derivative in (jax.grad, jax.jacfwd):
        np.testing.assert_allclose(derivative(cost)(share), slope, rtol=1e-9)


def test_the_best_macxp_is_that_of_twin_correlation():
    data = evidence(measured(), PLACES)
    part = affine_machine(nominal(), space(), PLACES[1], data[1].outputs)
    values = true_values()[part.stiffness] * np.array([[1.0], [1.02]])
    for mode in range(FEW):
        found = best_macxp([(part, data[1], mode)], values[None])[0]
        for value, k in zip(found, values, strict=True):
            paths = [space().paths[i] for i in part.stiffness]
            machine = space().subset(paths).with_values(nominal(), jnp.asarray(k))
            own = modes(machine.second_order(PLACES[1], inputs=(), outputs=outputs()))
            np.testing.assert_allclose(value, np.max(macxp_of_modes(own, measured()[1])[:, mode]), rtol=1e-8)
        np.testing.assert_allclose(found[0], 1, atol=1e-10)
    assert np.isnan(best_macxp([(part, data[1], 0)], np.full((1, 1, 16), np.nan))).all()


@jax.jit
@jax.vmap
def unlike(share, data):
    return unlikeness(share, PartData(*data))


def runs_of(value, macxp, *, searched=None, followed=None, stop="converged"):
    """Hand-made runs of two stiffnesses between 0 and 1, (problems, runs, 2)."""
    value, macxp = np.asarray(value, dtype=float), np.asarray(macxp, dtype=float)
    parameters = ParameterSpace([Parameter("a", "", 0.0, 1.0), Parameter("b", "", 0.0, 1.0)])
    shape = macxp.shape
    return PartRuns(
        parameters,
        np.arange(2),
        tuple(f"problem {i}" for i in range(shape[0])),
        np.ones((shape[0], 2), dtype=bool) if searched is None else np.asarray(searched),
        value,
        value,
        macxp,
        macxp if followed is None else np.asarray(followed),
        np.full(shape, stop, dtype=object),
        np.zeros(shape, dtype=int),
        np.zeros(shape, dtype=int),
    )


def test_the_paper_takes_the_problem_that_agrees_most_even_on_a_bound():
    agree, apart, bound = [[0.4, 0.3], [0.41, 0.5]], [[0.2, 0.6], [0.8, 0.61]], [[1.0, 0.0], [1.0, 0.9]]
    runs = runs_of([agree, apart, bound], np.ones((3, 2)))
    paper, robust = select_stiffness(runs), select_stiffness(runs, "robust")
    np.testing.assert_allclose(paper.value, [1.0, 0.605])
    assert paper.problem.tolist() == [2, 1]
    np.testing.assert_allclose(robust.value, [0.405, 0.605])
    np.testing.assert_allclose(robust.deviation, [0.005, 0.005])
    assert robust.problem.tolist() == [0, 1]
    assert "problem 1" in repr(robust)


def test_poor_fits_strayed_runs_and_unsearched_stiffnesses_do_not_count():
    good, poor = [[0.4, 0.3], [0.42, 0.3], [0.9, 0.3]], [[0.6, 0.5], [0.6, 0.5], [0.6, 0.5]]
    runs = runs_of(
        [good, poor],
        [[1.0, 1.0, 1.0], [0.5, 0.5, 0.5]],
        followed=[[1.0, 1.0, 0.2], [0.5, 0.5, 0.5]],
        searched=[[True, False], [True, False]],
    )
    assert runs.strayed.tolist() == [[False, False, True], [False, False, False]]
    assert runs.failed.sum() == 1
    robust = select_stiffness(runs, "robust")
    np.testing.assert_allclose(robust.value, [0.41, np.nan])
    assert robust.missing == ("b",) and robust.used.tolist() == [2, 0] and robust.failed == 1
    np.testing.assert_allclose(select_stiffness(runs).value[0], 0.6)
    assert select_stiffness(dataclasses.replace(runs, stop=np.full((2, 3), "too_many_steps"))).missing == ("a", "b")


def test_bad_selections_are_refused():
    runs = runs_of(np.full((1, 2, 2), 0.5), np.ones((1, 2)))
    with pytest.raises(InputError, match="rule must be"):
        select_stiffness(runs, "best")
    with pytest.raises(InputError, match="least_macxp"):
        select_stiffness(runs, "robust", least_macxp=1.0)


def mask_of(chosen):
    """Problems of both positions that search the same parameters, and all others none."""
    mask = np.zeros((2 * FEW, len(space())), dtype=bool)
    for number, parameters in chosen.items():
        mask[number, list(parameters)] = True
    return mask


def test_bad_problems_are_refused():
    with pytest.raises(InputError, match="searched has shape"):
        solve_parts(nominal(), measured(), PLACES, space(), np.ones((3, 27), dtype=bool), seed=1)
    with pytest.raises(InputError, match="rounds must not"):
        solve_parts(nominal(), measured(), PLACES, space(), mask_of({}), seed=1, rounds=-1)
    with pytest.raises(InputError, match="at least 2"):
        solve_parts(nominal(), measured(), PLACES, space(), mask_of({}), seed=1, starts=1)


@pytest.mark.slow
def test_runs_find_the_truth():
    """Also that problems without a stiffness to search are marked, and dampings are not searched."""
    kinds = unknowns(space())
    values = [float(value) for value in true_values()]

    def bounds(number, parameter):
        free = number in SEARCHED[:3]
        return (parameter.lower, parameter.upper) if free else (0.999999 * values[number], 1.000001 * values[number])

    own = ParameterSpace([Parameter(p.path, p.unit, *bounds(i, p)) for i, p in enumerate(space().parameters)])
    mask = mask_of({1: SEARCHED[:3], 2: (*SEARCHED[:3], int(kinds.damping[0]))})
    found = solve_parts(nominal(), measured(), PLACES, own, mask, seed=4, starts=6)
    assert np.all(found.stop[0] == "nothing_searched") and found.failed[0].all()
    assert not found.failed[1:3].any() and found.searched.sum() == 6
    selected = select_stiffness(found)
    np.testing.assert_allclose(selected.value[:3] / true_values()[list(SEARCHED[:3])], 1, atol=2e-3)
    assert set(selected.missing) == {own.paths[i] for i in kinds.stiffness[3:]}
    again = solve_parts(nominal(), measured(), PLACES, own, mask, seed=4, starts=6, threads=1)
    np.testing.assert_array_equal(found.value, again.value)

    assert not found.again[1:].any() and not found.mended.any()


@pytest.mark.slow
def test_a_planted_wrong_mode_is_found_out_and_solved_again(monkeypatch):
    mask = mask_of({1: SEARCHED[:2], 2: SEARCHED[:2]})

    def planted(problem, values):
        fields = [field.name for field in dataclasses.fields(PartData)]
        leaves = dict(zip(fields, data_from_start(problem, values), strict=True))
        # The start becomes another mode, and the frequency to begin near that mode's own.
        leaves["start"] = np.tile(np.eye(leaves["start"].shape[1])[9], (len(values), 1))
        leaves["near"] = leaves["eigenvalues"][:, 9]
        return tuple(leaves.values())

    def runs(**options):
        return solve_parts(nominal(), measured(), PLACES, space(), mask, seed=4, starts=4, **options)

    whole = runs()
    monkeypatch.setattr(machine_parts, "data_from_start", planted)
    wrong = runs(rounds=0)
    assert wrong.strayed[1:3].all() and wrong.failed[1:3].all() and not wrong.again.any()
    assert select_stiffness(wrong).missing == select_stiffness(wrong).runs.paths
    mended = runs()
    assert (mended.again[1:3] > 0).all() and not mended.again[[0, *range(3, 2 * FEW)]].any()
    assert mended.mended[1:3].all() and not mended.failed[1:3].any()
    assert (mended.steps[1:3] > wrong.steps[1:3]).all()
    np.testing.assert_allclose(mended.macxp[1:3], whole.macxp[1:3], atol=1e-5)
    np.testing.assert_array_equal(mended.value, runs(threads=1).value)
    assert "8 of 48 runs were solved again, 8 came right" in repr(mended)

    # What does not come right in the second try stays as it was, and marked.
    def astray(problem, values):
        return planted(problem, np.where(problem.searched, problem.bounds.mean(axis=1), values))

    monkeypatch.setattr(machine_parts, "data_from_mode", astray)
    still = runs(rounds=1)
    assert (still.again[1:3] == 1).all() and still.failed[1:3].all() and not still.mended.any()
    np.testing.assert_array_equal(still.value, wrong.value)
    np.testing.assert_array_equal(still.macxp, wrong.macxp)
