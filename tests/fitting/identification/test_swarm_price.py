"""What a swarm pays for the curve fits that gradients have made."""

import numpy as np
import pytest

from fitting.identification.leipe import fit_printed_curves
from fitting.identification.swarm_price import swarm_price


@pytest.fixture(scope="module")
def curves():
    return fit_printed_curves(0.01)


@pytest.mark.parametrize("i", [0, 1], ids=["stiffness", "damping"])
def test_swarm_reaches_the_same_error_for_many_times_the_price(curves, i):
    fit = curves.scattered[i]
    swarm, paid = swarm_price(fit, curves.forces, curves.totals[i])
    assert swarm.reached and swarm.evaluations > 50 * paid
    assert 100 * swarm.cost == pytest.approx(fit.error_percent, rel=1e-5)


def test_parameter_at_zero_is_looked_for_from_zero():
    curves = fit_printed_curves(0.04)
    fit = curves.scattered[1]
    assert fit.result["d3"].value == 0
    swarm, _ = swarm_price(fit, curves.forces, curves.totals[1])
    assert np.all(np.isfinite(swarm.values)) and 100 * swarm.cost >= fit.error_percent
