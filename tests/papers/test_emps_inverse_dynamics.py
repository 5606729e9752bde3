"""Inverse dynamics on the measured EMPS axis against the published estimates (Janot, Gautier, Brunot 2019)."""

import pytest

from fitting.identification.emps import ASYMMETRIC, SYMMETRIC, plain_space
from fitting.identification.inverse_dynamics import inverse_dynamics
from twin.drives import ServoAxis
from twin.io.data import DataNotFound
from twin.io.emps import read_emps
from twin.laws import AsymmetricFriction, CoulombViscousFriction

# Value and standard error; the asymmetric set is published without errors, so the symmetric ones of its kind stand in.
PUBLISHED_SYMMETRIC = {
    "mass": (95.1089, 0.1085),
    "friction.viscous": (203.5034, 1.146),
    "friction.coulomb": (20.3935, 0.1012),
    "offset": (-3.1648, 0.0444),
}
PUBLISHED_ASYMMETRIC = {
    "mass": (95.1540, 0.1085),
    "friction.viscous_positive": (166.706, 1.146),
    "friction.viscous_negative": (240.424, 1.146),
    "friction.coulomb_positive": (20.144, 0.1012),
    "friction.coulomb_negative": (20.628, 0.1012),
}


@pytest.fixture(scope="module")
def record():
    try:
        return read_emps().record
    except DataNotFound as error:
        pytest.skip(str(error))


def test_symmetric_estimates_are_the_published_ones(record):
    axis = ServoAxis(1.0, CoulombViscousFriction(1.0, 1.0, 1e-9))
    result = inverse_dynamics(record, axis, plain_space(SYMMETRIC))
    assert result.success
    for path, (value, error) in PUBLISHED_SYMMETRIC.items():
        assert abs(result[path].value - value) < error, path
        assert result[path].standard_error == pytest.approx(error, rel=0.15), path


def test_asymmetric_estimates_are_the_published_ones(record):
    axis = ServoAxis(1.0, AsymmetricFriction(1.0, 1.0, 1.0, 1.0, 1e-9))
    result = inverse_dynamics(record, axis, plain_space(ASYMMETRIC))
    for path, (value, error) in PUBLISHED_ASYMMETRIC.items():
        assert abs(result[path].value - value) < error, path
