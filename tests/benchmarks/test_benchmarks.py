"""The ratios that the twin is built for, on a shortened record; never a time in seconds."""

from collections.abc import Callable
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

pytest.importorskip("casadi", reason="CasADi, a peer of the benchmarks, is not installed: take the bench extra.")

from tests.benchmarks.emps_case import Case, dahl_case, rigid_case
from tests.benchmarks.emps_simulation import CVODES, SCIPY, TWIN, Comparison, compare

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
