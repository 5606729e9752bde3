"""What cannot be simulated is refused with one clear error."""

import jax.numpy as jnp
import numpy as np
import pytest
from reference_systems import ConstantInputs, viscous_axis

from twin._checks import InputError
from twin.control import SampledLoop, SampledPositionVelocity
from twin.references import JerkLimitedMove
from twin.simulation import simulate
from twin.stepping import AdaptiveSteps, ConstantSteps

TICKS = 2e-3 * np.arange(11)
LOOP = SampledLoop(viscous_axis(), SampledPositionVelocity(100.0, 200.0), 2e-3)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"times": np.zeros(1)}, "at least two times"),
        ({"times": np.array([0.0, 2e-3, 1e-3])}, "increase"),
        ({"times": np.array([0.0, np.nan, 1.0])}, "finite"),
        ({"stepping": AdaptiveSteps()}, "simulated with ConstantSteps"),
        ({"times": TICKS * 1.1}, "must be the ticks of the sampled controller, 0.002 s apart"),
    ],
)
def test_bad_input_is_named(change, said):
    with pytest.raises(InputError, match=said):
        simulate(**{"system": LOOP, "reference": JerkLimitedMove(0.1, 0.5, 5.0, 100.0), "times": TICKS, **change})


def test_bad_stepping_is_named():
    for make, said in (
        (lambda: ConstantSteps(0), "substeps must be at least 1, but is 0"),
        (lambda: AdaptiveSteps(rtol=0.0), "rtol must be positive"),
        (lambda: AdaptiveSteps(atol=-1.0), "atol must be positive"),
        (lambda: AdaptiveSteps(gradient="backward"), "gradient must be"),
    ):
        with pytest.raises(InputError, match=said):
            make()


def test_an_output_that_is_not_there():
    trajectory = simulate(
        viscous_axis(), ConstantInputs(0.0, 0.0), jnp.linspace(0.0, 1.0, 3), stepping=ConstantSteps(1, rtol=1.0)
    )
    with pytest.raises(InputError, match="no output 'torque'; it has position, velocity, command, force"):
        trajectory.channel("torque")
