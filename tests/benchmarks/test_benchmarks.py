"""The ratios that the twin is built for, on a shortened record; never a time in seconds."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

pytest.importorskip("casadi", reason="CasADi, a peer of the benchmarks, is not installed: take the bench extra.")

from tests.benchmarks.emps_case import Case, dahl_case, rigid_case
from tests.benchmarks.emps_report import as_markdown, summary_rows
from tests.benchmarks.emps_simulation import CVODES, SCIPY, TWIN, Comparison, compare
from tests.benchmarks.entrant import Spread
from tests.benchmarks.programmes import Count, Throughput
from tests.benchmarks.programmes import summary_rows as programme_rows
from tests.benchmarks.rack_case import STATES, closed_loop, constants, move, rate, segments, space, variants
from tests.benchmarks.rack_loop import compiled_loop
from tests.benchmarks.rack_pinion import CVODES as CVODES_RACK
from tests.benchmarks.rack_pinion import Row
from tests.benchmarks.rack_report import summary_rows as rack_summary

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    return compare(rigid_case().first(2000), rounds=1, scipy_methods=("RK23",), extras=False)


@pytest.mark.parametrize("role", [TWIN, SCIPY, CVODES])
def test_every_tool_gives_the_same_answer(comparison: Comparison, role: str):
    assert comparison.best_simulation(role) is not None
    assert comparison.best_jacobian(role) is not None


def test_the_twin_is_not_less_accurate_than_the_peer_with_sensitivities(comparison: Comparison):
    twin, peer = comparison.best_jacobian(TWIN), comparison.best_jacobian(CVODES)
    assert twin.position_error < peer.position_error
    assert twin.jacobian_error < peer.jacobian_error


def test_simulation_is_ten_times_faster_than_scipy(comparison: Comparison):
    assert comparison.ratios()["SciPy / twin, simulation"] >= 10


def test_jacobian_is_ten_times_faster_than_scipy_finite_differences(comparison: Comparison):
    assert comparison.ratios()["SciPy / twin, Jacobian"] >= 10


def test_jacobian_is_faster_than_casadi_cvodes(comparison: Comparison):
    assert comparison.ratios()["CasADi CVODES / twin, Jacobian"] > 1


def test_every_ratio_has_a_row_of_the_summary(comparison: Comparison):
    rows = summary_rows(comparison)
    assert len(rows) == len(comparison.ratios()) and sum(bool(row.goal) for row in rows) == 3
    assert all(row.low <= row.ratio <= row.high and "limit" in row.agreement for row in rows)
    assert comparison.case.name in as_markdown([comparison])


@pytest.mark.parametrize("make", [rigid_case, dahl_case])
def test_the_peers_get_the_equations_of_the_twin(make: Callable[[], Case]):
    case = make()
    plant = case.loop.plant
    state = np.linspace(0.003, 0.4, len(case.start))
    structure = jax.tree.structure(plant.initial_state())
    inputs = plant.rest_inputs()._replace(command=jnp.asarray(1.7))
    named = jax.tree.unflatten(structure, [jnp.asarray(x) for x in state])
    ours = jax.tree.leaves(plant.vector_field(jnp.asarray(0.0), named, inputs))
    functions = SimpleNamespace(sqrt=np.sqrt, expm1=np.expm1, exp=np.exp)
    theirs = case.rate(list(state), 1.7, case.values(case.vector, functions), functions)
    np.testing.assert_allclose(ours, theirs, rtol=1e-12)


@pytest.fixture(scope="module")
def rack_states() -> list[tuple[Any, ...]]:
    """Time, reference, state and parameters, at random; the state is about as large as it gets."""
    random = np.random.default_rng(3)
    size = np.array([1e-2, 1e-2, 2e-5, 1.0, 1.0, 1e-2, 1.0, 1.0])
    cases = []
    for values, t in zip(variants(20, seed=4), random.uniform(0.0, 3.0, 20), strict=True):
        wanted = next(s for s in segments() if t <= s.end).point(t)
        cases.append((t, wanted, size * random.standard_normal(STATES), values))
    return cases


def test_the_rack_and_pinion_peers_get_the_equations_of_the_twin(rack_states: list[tuple[Any, ...]]):
    loop, reference = closed_loop(), move()
    structure = jax.tree.structure(loop.initial_state())

    @jax.jit
    def ours(t, state, values):
        named = jax.tree.unflatten(structure, list(state))
        return jnp.stack(jax.tree.leaves(space().unpack(loop, values).vector_field(t, named, reference(t))))

    for t, wanted, state, values in rack_states:
        theirs = rate(state.tolist(), wanted, constants(values.tolist()), np.sqrt)
        np.testing.assert_allclose(ours(t, state, values), theirs, rtol=1e-10, atol=1e-10)


def test_the_c_loop_gets_the_same_equations(rack_states: list[tuple[Any, ...]]):
    loop = compiled_loop()
    if loop is None:
        pytest.skip("no C compiler (cc, gcc or clang) was found")
    for _, wanted, state, values in rack_states:
        theirs = rate(state.tolist(), wanted, constants(values.tolist()), np.sqrt)
        np.testing.assert_allclose(loop.rate(state, np.asarray(wanted), values), theirs, rtol=1e-10, atol=1e-10)


def test_rows_of_the_rack_and_pinion_are_per_variant():
    times = {TWIN: [2.0, 4.0], CVODES_RACK: [6.0, 6.0]}
    rows = [
        Row("variants", role, role, 1, 4 if role == TWIN else 1, Spread.of(turns), 0.0, 1e-5, 1e-9, True)
        for role, turns in times.items()
    ]
    row, *_ = rack_summary(rows)
    assert (row.ratio, row.low, row.high, row.least) == (9.0, 6.0, 12.0, 5.0)


def test_rows_of_the_programmes():
    counts = [Count("twin", 9, 0, 10.0, 11.0), Count("SciPy", 8, 1, 12.0, 13.0)]
    speed = Throughput("HS71", 4, Spread.of([1.0, 2.0]), 0.5, 8.0, 4, 3)
    evaluations, loop = programme_rows(counts, [speed])
    assert evaluations.ratio == 1.2 and evaluations.met == "yes"
    assert loop.ratio == 6.0 and "4 and 3 of 4" in loop.agreement
