"""Share of the time at a limit, on signals whose share is known."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.laws import smooth_clip
from twin.performance import limit_share, warn_at_limit

T = np.array([0.0, 1.0, 2.0, 4.0])


@pytest.mark.parametrize(
    ("voltage", "share"),
    [
        ([0.0, 0.0, 0.0, 0.0], 0.0),
        ([10.0, 10.0, 10.0, 10.0], 1.0),
        ([-10.0, -10.0, -10.0, -10.0], 1.0),
        ([0.0, 10.0, 10.0, 0.0], 0.25),
        ([0.0, 20.0, 0.0, 0.0], 0.25),  # half of each flank is above
        ([10.0, -10.0, -10.0, 10.0], 0.25),  # from one limit to the other
        ([0.0, 10.0, 0.0, 0.0], 0.0),  # touches only
    ],
)
def test_known_shares(voltage, share):
    assert float(limit_share(T, np.array(voltage), 10.0, tolerance=0.0)) == pytest.approx(share, abs=1e-12)


def test_a_clipped_sine():
    t = np.linspace(0.0, 1.0, 4001)
    u = smooth_clip(20 * np.sin(2 * np.pi * t), 10.0)
    share = float(limit_share(t, u, 10.0))
    assert share == pytest.approx(1 - 2 / np.pi * np.arcsin(0.5), abs=2e-3)
    assert float(limit_share(t, u, np.inf)) == 0.0
    assert np.isnan(limit_share(t, u.at[7].set(jnp.nan), 10.0))


def test_derivative():
    t = np.linspace(0.0, 1.0, 33)

    def share(size):
        return limit_share(t, size * jnp.sin(7 * t), 1.0)

    at = jnp.asarray(1.4)
    rough = float(share(at + 1e-6) - share(at - 1e-6)) / 2e-6
    assert float(jax.grad(share)(at)) == pytest.approx(rough, rel=1e-6)
    for flat in (0.0, 0.5, 1e3):
        assert np.isfinite(jax.grad(share)(jnp.asarray(flat)))


def test_warning_only_if_nearly_all_the_time():
    with pytest.warns(UserWarning, match="voltage limit reached all the time"):
        warn_at_limit(T, np.array([9.995, 10.0, -10.0, -10.0])[[0, 1, 0, 1]], 10.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_at_limit(T, np.array([0.0, 10.0, 10.0, 10.0]), 10.0)


def test_bad_input_is_named():
    u = np.zeros(4)
    with pytest.raises(InputError, match="limit must be above zero"):
        limit_share(T, u, 0.0)
    with pytest.raises(InputError, match="tolerance"):
        limit_share(T, u, 1.0, tolerance=1.0)
