"""The three measures of a positioning from a trajectory, and a sweep of a gain that scores them by eq. 22."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from twin._checks import InputError
from twin.performance import motoring_energy, positioning_cost, positioning_performance, response_time, static_error
from twin.sweep import sweep
from twin.trajectory import SimulationStatus, Trajectory

T = np.linspace(0.0, 1.0, 401)


class Outputs(NamedTuple):
    position: Float[Array, "times"]
    power: Float[Array, "times"]


class Lag(eqx.Module):
    """A unit mass that follows a step by a first-order lag, of which a load keeps off a part."""

    gain: Float[Array, ""]
    load: Float[Array, ""]

    def run(self):
        decay = jnp.exp(-self.gain * T)
        speed = self.gain * decay
        # The force is that of inertia and of a friction of two newtons.
        outputs = Outputs((1 - self.load / self.gain) * (1 - decay), speed * (2.0 - self.gain * speed))
        # A gain that is not positive is a run that failed.
        outputs = jax.tree.map(lambda x: jnp.where(self.gain > 0, x, jnp.nan), outputs)
        return Trajectory(jnp.asarray(T), (), outputs, SimulationStatus.successful, jnp.asarray(0.0))


def perform(model):
    return positioning_performance(model.run(), 1.0, window=0.1, share=0.9)


MODEL = Lag(jnp.asarray(10.0), jnp.asarray(0.2))


def test_is_the_measures_by_name():
    run = MODEL.run()
    found = perform(MODEL)
    assert float(found.error) == float(static_error(T, run.outputs.position, 1.0, 0.1).signed)
    assert float(found.energy) == float(motoring_energy(T, run.outputs.power))
    assert float(found.time) == float(response_time(T, run.outputs.position, 1.0, share=0.9))
    assert float(found.error) == pytest.approx(0.02, abs=1e-4)
    with pytest.raises(InputError, match="position, power"):
        positioning_performance(run, 1.0, window=0.1, position="angle")


def test_sweep_of_a_gain_is_scored():
    found = sweep(MODEL, {"gain": [-1.0, 5.0, 8.0, 12.0, 20.0]}, perform, units={"error": "m", "time": "s"})
    np.testing.assert_array_equal(found.failed, [True, False, False, False, False])
    cost = positioning_cost(found["error"], found["energy"], found["time"])
    assert np.isnan(cost[0]) and np.all(np.isfinite(cost[1:]))
    assert np.all((cost[1:] >= -2) & (cost[1:] <= 1))
    assert np.all(np.diff(found["time"][1:]) < 0)


def test_derivatives_by_the_model():
    def measures(gain):
        return jnp.stack(perform(eqx.tree_at(lambda m: m.gain, MODEL, gain)))

    compiled = jax.jit(measures)
    exact = jax.jit(jax.jacfwd(measures))(MODEL.gain)
    numeric = (compiled(MODEL.gain + 1e-6) - compiled(MODEL.gain - 1e-6)) / 2e-6
    np.testing.assert_allclose(exact, numeric, rtol=1e-5, atol=1e-8)
