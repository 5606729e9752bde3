"""Results saved and loaded: the ending left out, and files that are missing, damaged or of another kind or version."""

import dataclasses

import numpy as np
import pytest

from fitting import posterior_result
from fitting.posterior_result import Posterior
from fitting.result import FitResult
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

SPACE = ParameterSpace(
    [Parameter("mass", "kg", 1.0, 9.0, scale="log", prior=(2.0, 0.5)), Parameter("lag", "s", tied=("late",))]
)


@pytest.fixture
def posterior():
    values = np.random.default_rng(1).uniform(1.0, 2.0, (2, 10, 2))
    return Posterior(
        space=SPACE,
        values=values,
        r_hat=np.ones(2),
        effective_size=np.full(2, 20.0),
        divergences=0,
        acceptance=np.full(2, 0.8),
        evaluations=50,
        data=7,
        variance="known",
    )


@pytest.mark.parametrize("name", ["posterior", "posterior.npz", "run.1"])
def test_the_name_saved_to_is_the_name_to_load(posterior, tmp_path, name):
    posterior.save(tmp_path / name)
    loaded = Posterior.load(tmp_path / name)
    np.testing.assert_array_equal(loaded.values, posterior.values)
    assert loaded.space == SPACE
    assert repr(loaded) == repr(posterior)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"gone does not exist\. Give the file that Posterior\.save wrote"):
        Posterior.load(tmp_path / "gone")
    with pytest.raises(InputError, match=r"gone does not exist\. Give the file that FitResult\.save wrote"):
        FitResult.load(tmp_path / "gone", None)


def test_another_kind_of_result_is_refused(posterior, tmp_path):
    posterior.save(tmp_path / "posterior")
    with pytest.raises(InputError, match="is not a readable fit result"):
        FitResult.load(tmp_path / "posterior", None)


def test_another_version_is_refused(posterior, tmp_path):
    dataclasses.replace(posterior_result._FILE, version=0).write(tmp_path / "old", posterior)
    with pytest.raises(InputError, match=r"another version of drivetwin\. Make the posterior again"):
        Posterior.load(tmp_path / "old")
