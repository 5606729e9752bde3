"""Lanes on several threads never wait for each other."""

import faulthandler

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.multistart import multistart
from fitting.residuals.residual import AbstractResidual
from tests.benchmarks.frequency_case import frequency_case
from tests.fitting.curves import Coefficients, noisy, two_decays
from twin._lapack import calls_lapack


class Solved(AbstractResidual):
    """A·b = 1 with a matrix that depends on b, solved by LAPACK inside a loop."""

    samples: jax.Array

    def __call__(self, model):
        def body(_, x):
            return jnp.linalg.solve(jnp.eye(3) + 0.1 * jnp.outer(model.b, x), model.b)

        return jax.lax.fori_loop(0, 2, body, jnp.ones(3)) - self.samples


def test_a_call_of_lapack_is_found_wherever_it_hides():
    model = Coefficients(jnp.ones(3))
    assert calls_lapack(lambda m: Solved(jnp.ones(3))(m), model)
    assert calls_lapack(jax.jit(jax.grad(lambda x: jnp.sum(jnp.linalg.eigh(jnp.diag(x))[1]))), jnp.arange(3.0))
    curve = noisy(two_decays, [2.0, 0.5, 1.0, 3.0], np.linspace(0, 5, 60), 0.01)
    assert not calls_lapack(lambda m: curve(m), Coefficients(jnp.ones(4)))


@pytest.mark.slow
def test_trap_23_frequency_responses_on_several_threads_do_not_hang():
    case = frequency_case(60)
    faulthandler.dump_traceback_later(300, exit=True)
    try:
        result = multistart(case.residual, case.model, case.space, starts=200, threads=4)
    finally:
        faulthandler.cancel_dump_traceback_later()
    assert result.success.mean() > 0.95
    assert np.mean(result.clusters == 0) > 0.95
