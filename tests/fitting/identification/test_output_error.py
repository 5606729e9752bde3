"""Output error on simulated records: recovery, honest intervals over repeats, and the status of the result."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.fit import result_of
from fitting.identification.output_error import output_error
from fitting.residuals.trajectory import TrajectoryResidual, relative_error_percent
from fitting.solve import solve_raw
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from twin._checks import InputError
from twin.control import SampledLoop, SampledPositionVelocity
from twin.drives import ServoAxis
from twin.laws import CoulombViscousFriction
from twin.parameters import Parameter, ParameterSpace
from twin.record import Record
from twin.references import JerkLimitedMove, SumReference
from twin.simulation import simulate
from twin.stepping import ConstantSteps

AXIS = ServoAxis(95.0, CoulombViscousFriction(20.0, 200.0, 2e-3), gain=35.0, offset=-3.0)
TRUTH = SampledLoop(AXIS, SampledPositionVelocity(160.0, 240.0, 10.0), 2e-3)
REFERENCE = SumReference(
    (JerkLimitedMove(0.05, 0.3, 4.0, 200.0, start_time=0.02), JerkLimitedMove(-0.05, 0.1, 4.0, 200.0, start_time=0.4))
)
TIMES = jnp.arange(500) * 2e-3
STEPPING = ConstantSteps(substeps=2)
DEVIATION = {"position": 2e-6, "force": 2.0}
SPACE = ParameterSpace(
    [
        Parameter("plant.mass", "kg", 10.0, 1000.0, scale="log"),
        Parameter("plant.friction.coulomb", "N", 0.0, 100.0),
        Parameter("plant.friction.viscous", "N s/m", 0.0, 1000.0),
        Parameter("plant.offset", "N", -50.0, 50.0),
    ]
)
START = SPACE.with_values(TRUTH, jnp.asarray([60.0, 10.0, 100.0, 0.0]))


@pytest.fixture(scope="module")
def clean():
    return eqx.filter_jit(simulate)(TRUTH, REFERENCE, TIMES, stepping=STEPPING)


def test_noise_free_records_give_the_truth_back(clean):
    channels = {name: np.asarray(clean.channel(name)) for name in DEVIATION}
    record = Record.create(np.asarray(TIMES), channels, {"position": "m", "force": "N"})
    result = output_error(record, START, REFERENCE, SPACE, deviation=DEVIATION, stepping=STEPPING)
    assert result.success
    np.testing.assert_allclose(result.values, SPACE.values(TRUTH), rtol=1e-6)


@pytest.mark.slow
def test_intervals_cover_the_truth_in_200_repeats(clean):
    """95 % intervals of 200 fits to records with fresh noise cover the truth in 90 to 99 % for each parameter."""
    repeats = 200
    noise = np.random.default_rng(11).standard_normal((repeats, 2, TIMES.size))
    names = tuple(DEVIATION)
    deviations = tuple(jnp.asarray(DEVIATION[name]) for name in names)
    solver = BoundedLevenbergMarquardt()

    def one(sample):
        measured = tuple(
            clean.channel(name) + sd * sample[i] for i, (name, sd) in enumerate(zip(names, deviations, strict=True))
        )
        residual = TrajectoryResidual(TIMES, REFERENCE, measured, deviations, names, STEPPING)
        return solve_raw(residual, START, SPACE, solver, 40)

    solved = eqx.filter_jit(eqx.filter_vmap(one))(jnp.asarray(noise))
    truth = np.asarray(SPACE.values(TRUTH))
    covered = np.zeros((repeats, len(SPACE)))
    for i in range(repeats):
        result = result_of(jax.tree.map(lambda leaf, i=i: leaf[i], solved), START, SPACE)
        assert result.success, (i, result.message)
        low, high = result.intervals(0.95).T
        covered[i] = (low <= truth) & (truth <= high)
    share = covered.mean(axis=0)
    assert np.all((share >= 0.90) & (share <= 0.99)), share


def test_a_fit_whose_simulation_is_too_coarse_says_so(clean):
    channels = {"position": np.asarray(clean.channel("position"))}
    record = Record.create(np.asarray(TIMES), channels, {"position": "m"})
    strict = ConstantSteps(substeps=2, rtol=1e-12, atol=1e-15)
    result = output_error(record, START, REFERENCE, SPACE, deviation={"position": 2e-6}, stepping=strict, max_steps=3)
    assert "too coarse" in result.message


@pytest.mark.parametrize(
    ("deviation", "message"),
    [
        ({}, "Name at least one channel"),
        ({"position": 0.0}, "deviation of channel 'position' must be positive"),
        ({"current": 1.0}, "current"),
        ({"spare": 1.0}, "no output 'spare'"),
    ],
)
def test_channels_that_cannot_be_compared_are_refused(clean, deviation, message):
    samples = np.asarray(clean.channel("position"))
    record = Record.create(np.asarray(TIMES), {"position": samples, "spare": samples}, {"position": "m", "spare": "m"})
    with pytest.raises(InputError, match=message):
        output_error(record, START, REFERENCE, SPACE, deviation=deviation, stepping=STEPPING)


def test_a_fit_that_does_not_fit_says_so(clean):
    """Millimetres taken for metres: the solver converges all the same."""
    record = Record.create(
        np.asarray(TIMES), {"position": 1e3 * np.asarray(clean.channel("position"))}, {"position": "m"}
    )
    result = output_error(record, START, REFERENCE, SPACE, deviation={"position": 2e-6}, stepping=STEPPING)
    assert result.rms > 5
    assert "times the deviations given: a wrong unit" in result.message


def test_ticks_that_miss_the_period_are_refused_before_the_fit(clean):
    record = Record.create(
        2 * np.asarray(TIMES), {"position": np.asarray(clean.channel("position"))}, {"position": "m"}
    )
    with pytest.raises(InputError, match="ticks of the sampled controller"):
        output_error(record, START, REFERENCE, SPACE, deviation={"position": 2e-6}, stepping=STEPPING)


def test_relative_error():
    assert relative_error_percent(np.array([3.0, 4.0]), np.array([3.0, 3.0])) == pytest.approx(20.0)
    with pytest.raises(InputError, match="same samples"):
        relative_error_percent(np.ones(3), np.ones(4))
    with pytest.raises(InputError, match="zero throughout"):
        relative_error_percent(np.zeros(3), np.ones(3))
