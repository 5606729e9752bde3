"""Evidence that adds up: data sets with shared and own parameters, kinds of evidence together, weights and names."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.fit import fit, result_of
from fitting.residuals.frequency_response import FrequencyResponseResidual, rest_response
from fitting.residuals.linear import LinearResidual
from fitting.residuals.residual import JointResidual, pieces
from fitting.residuals.selected import SelectedResidual, across
from fitting.residuals.trajectory import TrajectoryResidual
from fitting.result import FitResult
from fitting.solve import solve
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.uncertainty import covariance_of
from twin._checks import InputError
from twin.drives import ServoAxis, TwoMass
from twin.drives.inputs import DriveInputs
from twin.laws import ViscousFriction
from twin.parameters import Parameter, ParameterSpace
from twin.record import Record
from twin.references import SampledSignal
from twin.simulation import simulate
from twin.stepping import ConstantSteps

RNG = np.random.default_rng(8)
AXIS = ServoAxis(80.0, ViscousFriction(100.0))
ONE = ParameterSpace(
    [Parameter("mass", "kg"), Parameter("friction.viscous", "N s/m", size=10.0), Parameter("offset", "N")]
)
SETS = {"low": (30, 5.0), "high": (50, -12.0)}
ROWS = {
    name: np.stack([RNG.standard_normal(n), RNG.standard_normal(n), np.ones(n)], axis=1)
    for name, (n, _) in SETS.items()
}
FORCES = {
    name: rows @ [95.0, 210.0, SETS[name][1]] + 3.0 * RNG.standard_normal(rows.shape[0]) for name, rows in ROWS.items()
}
EVIDENCE = JointResidual(
    tuple(SelectedResidual(LinearResidual(ROWS[name], FORCES[name], ONE), name) for name in SETS), names=tuple(SETS)
)


@pytest.fixture(scope="module")
def shared():
    return fit(EVIDENCE, {"low": AXIS, "high": AXIS}, across(ONE, tuple(SETS), free=("offset",)))


def test_shared_parameters_agree_with_stacked_least_squares(shared):
    zero = {name: np.zeros((n, 1)) for name, (n, _) in SETS.items()}
    design = np.vstack(
        [
            np.hstack([ROWS["low"], zero["low"]]),
            np.hstack([ROWS["high"][:, :2], zero["high"], ROWS["high"][:, 2:]]),
        ]
    )
    target = np.concatenate([FORCES["low"], FORCES["high"]])
    expected, square, *_ = np.linalg.lstsq(design, target)
    errors = np.sqrt(square[0] / 76 * np.diag(np.linalg.inv(design.T @ design)))
    assert shared.success
    assert shared.space.paths == ("low.mass", "low.friction.viscous", "low.offset", "high.offset")
    np.testing.assert_allclose(shared.values, expected, rtol=1e-8)
    np.testing.assert_allclose(shared.standard_errors, errors, rtol=1e-8)
    assert shared.degrees_of_freedom == 76


def test_what_is_tied_is_one_number_in_the_fitted_model(shared):
    low, high = shared.model["low"], shared.model["high"]
    assert float(low.mass) == float(high.mass) == shared.values[0]
    assert float(low.friction.viscous) == float(high.friction.viscous)
    assert float(low.offset) != float(high.offset)


def test_ties_survive_saving(shared, tmp_path):
    shared.save(tmp_path / "joint.npz")
    loaded = FitResult.load(tmp_path / "joint.npz", {"low": AXIS, "high": AXIS})
    assert loaded.space == shared.space
    assert float(loaded.model["high"].mass) == shared.values[0]


def test_a_held_tie_stays_in_every_data_set():
    space = across(ONE, tuple(SETS), free=("offset",))
    found = fit(EVIDENCE, {"low": AXIS, "high": AXIS}, space, hold="low.mass")
    assert float(found.model["low"].mass) == float(found.model["high"].mass) == 80.0


def test_a_tie_that_starts_apart_is_refused_before_the_fit():
    other = eqx.tree_at(lambda axis: axis.mass, AXIS, jnp.asarray(90.0))
    with pytest.raises(InputError, match=r"low.mass and high.mass are tied, but start at 80 and 90 kg"):
        fit(EVIDENCE, {"low": AXIS, "high": other}, across(ONE, tuple(SETS), free=("offset",)))


def test_across_ties_all_but_what_is_free():
    twice = ParameterSpace([Parameter("mass", "kg", 1.0, 9.0, tied=("gain",)), Parameter("offset", prior=(0.0, 2.0))])
    space = across(twice, ("0", "1", "2"), free=["offset"])
    assert space.paths == ("0.mass", "0.offset", "1.offset", "2.offset")
    assert space["0.mass"].tied == ("0.gain", "1.mass", "1.gain", "2.mass", "2.gain")
    assert (space["0.mass"].upper, space["2.offset"].prior) == (9.0, (0.0, 2.0))
    models = (AXIS, AXIS, AXIS)
    assert float(space.with_values(models, jnp.asarray([4.0, 1.0, 2.0, 3.0]))[2].gain) == 4.0


@pytest.mark.parametrize(
    ("names", "free", "said"),
    [
        ((), (), "names must be different names"),
        (("a", "a"), (), "names must be different names"),
        (("a.b", "c"), (), "without dots"),
        (("a", "b"), ("gain",), "No free parameter 'gain'"),
    ],
)
def test_data_sets_that_cannot_be_joined_are_refused(names, free, said):
    with pytest.raises(InputError, match=said):
        across(ONE, names, free=free)


def test_a_piece_that_refuses_the_model_is_named():
    with pytest.raises(InputError, match=r"Evidence 'high': .*no 'high' there"):
        EVIDENCE({"low": AXIS})
    unnamed = JointResidual(EVIDENCE.parts)
    with pytest.raises(InputError, match=r"Evidence '1 \(SelectedResidual\)'"):
        unnamed({"low": AXIS})
    with pytest.raises(InputError, match="names gives 1 names"):
        JointResidual(EVIDENCE.parts, names=("low",))
    nested = SelectedResidual(JointResidual((EVIDENCE,), names=("plant",)), "x")
    assert [p.name for p in pieces(nested, {"x": {"low": AXIS, "high": AXIS}})] == ["plant.low", "plant.high"]


DRIVE = TwoMass(4.8e-3, 4.7e-3, 548.0, 0.05, ViscousFriction(0.046), ViscousFriction(0.08))
TIMES = np.arange(80) * 1e-3
SIGNAL = SampledSignal(TIMES, DriveInputs(jnp.sign(jnp.sin(300.0 * TIMES**0.8)), jnp.zeros(TIMES.size)))
TWO_MASS = ParameterSpace(
    [
        Parameter("motor_inertia", "kg m²", scale="log"),
        Parameter("load_inertia", "kg m²", scale="log", prior=(4.9e-3, 2e-4)),
        Parameter("stiffness", "Nm/rad", scale="log"),
    ]
)


@pytest.fixture(scope="module")
def drive_evidence():
    """A noisy record and a noisy frequency response of the same drive, and what the record is without noise."""
    rng = np.random.default_rng(9)
    clean = eqx.filter_jit(simulate)(DRIVE, SIGNAL, TIMES, stepping=ConstantSteps(2)).channel("velocity")
    velocity = np.asarray(clean) + 0.05 * rng.standard_normal(TIMES.size)
    record = Record.create(TIMES, {"velocity": velocity}, {"velocity": "rad/s"})
    response = eqx.filter_jit(rest_response)(DRIVE, np.linspace(20.0, 150.0, 30))
    exact = np.asarray(response.values)
    sd = 0.1 * np.abs(exact)
    draw = rng.standard_normal((2, *exact.shape))
    noisy = exact + sd * (draw[0] + 1j * draw[1]) / np.sqrt(2)
    keep = [response.outputs.index("velocity")], [response.inputs.index("command")]
    at = np.ix_(*keep)
    measured = dataclasses.replace(
        response,
        values=jnp.asarray(noisy[at]),
        variance=jnp.asarray(sd[at] ** 2),
        outputs=("velocity",),
        inputs=("command",),
    )
    trajectory = TrajectoryResidual.create(record, SIGNAL, {"velocity": 0.05}, stepping=ConstantSteps(2))
    return trajectory, FrequencyResponseResidual(measured), clean


@pytest.mark.slow
def test_record_response_and_prior_add_their_information(drive_evidence):
    start = TWO_MASS.with_values(DRIVE, jnp.asarray([4e-3, 5e-3, 500.0]))
    joint = JointResidual(drive_evidence[:2], names=("record", "response"))
    solved = solve(joint, start, TWO_MASS, BoundedLevenbergMarquardt(), 50)
    result = result_of(solved, start, TWO_MASS)
    assert result.success
    assert result.rms == pytest.approx(1.0, abs=0.15)
    truth = np.asarray(TWO_MASS.values(DRIVE))
    assert np.all(np.abs(result.values - truth) < 4 * result.standard_errors)

    # Rows of the record, the response and the prior, in this order.
    stacked = np.asarray(solved.jacobian)
    assert stacked.shape == (TIMES.size + 60 + 1, 3)
    none, ones = np.zeros(3, dtype=bool), np.ones(stacked.shape[0])
    found = covariance_of(ones, stacked, none, priors=1, variance="known")
    rows = np.split(stacked, [TIMES.size, TIMES.size + 60])
    np.testing.assert_allclose(found.matrix, np.linalg.inv(sum(j.T @ j for j in rows)), rtol=1e-9)
    alone = covariance_of(np.ones(TIMES.size), rows[0], none, variance="known")
    assert np.all(np.diag(found.matrix) < np.diag(alone.matrix))
    np.testing.assert_allclose(stacked[-1], [0.0, result.values[1] / 2e-4, 0.0], rtol=1e-9)


def test_a_deviation_for_each_sample_weights_each_sample(drive_evidence):
    trajectory, _, velocity = drive_evidence
    record = Record.create(TIMES, {"velocity": trajectory.measured[0]}, {"velocity": "rad/s"})
    sd = 0.05 * (1 + np.arange(TIMES.size) / 40)
    weighted = TrajectoryResidual.create(record, SIGNAL, {"velocity": sd}, stepping=ConstantSteps(2))
    error = (np.asarray(velocity) - np.asarray(trajectory.measured[0])) / sd
    np.testing.assert_allclose(eqx.filter_jit(weighted)(DRIVE), error, rtol=1e-9, atol=1e-9)
    for bad, said in (
        (sd[:-1], r"deviation of channel 'velocity' has shape \(79,\), but the channel has 80 samples"),
        (np.where(sd > 0.1, 0.0, sd), "deviation of channel 'velocity' must be positive"),
        (np.where(sd > 0.1, np.inf, sd), "deviation of channel 'velocity' must be finite"),
    ):
        with pytest.raises(InputError, match=said):
            TrajectoryResidual.create(record, SIGNAL, {"velocity": bad})
