"""Posteriors with known moments: normal, Student's t, cut off by a bound, a banana, two modes; and bad input."""

import builtins

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float
from scipy import stats
from scipy.signal import lfilter

from fitting.fit import fit
from fitting.mixing import effective_size, r_hat
from fitting.posterior import sample_posterior
from fitting.posterior_result import Posterior
from fitting.posterior_target import Box
from fitting.residuals.residual import AbstractResidual
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace


class Pair(eqx.Module):
    """Two numbers."""

    a: Float[Array, ""]
    b: Float[Array, ""]


class Curved(AbstractResidual):
    """rows·(a, b, a²) - samples, NaN where a < floor: linear, a banana, two modes or a model that fails by its numbers
    alone, so that all are one program."""

    rows: Float[Array, "n 3"]
    samples: Float[Array, " n"]
    floor: Float[Array, ""]

    def __call__(self, model):
        values = self.rows @ jnp.stack([model.a, model.b, model.a**2]) - self.samples
        return jnp.where(model.a < self.floor, jnp.nan, values)


def pair(a, b):
    return Pair(jnp.asarray(float(a)), jnp.asarray(float(b)))


def curved(rows, samples, floor=-np.inf):
    """Padded to eight rows; rows of zeros say nothing where the variance is known."""
    found = np.zeros((8, 3)), np.zeros(8)
    found[0][: len(rows)], found[1][: len(rows)] = rows, samples
    return Curved(*map(jnp.asarray, found), jnp.asarray(floor))


RNG = np.random.default_rng(3)
X = np.linspace(0.0, 2.0, 8)
LINE = curved(np.stack([np.ones(8), X, np.zeros(8)], axis=1), 3.0 - 0.7 * X + 0.3 * RNG.standard_normal(8))
SHORT = Curved(LINE.rows[:2], LINE.samples[:2], LINE.floor)
SPACE = ParameterSpace([Parameter("a", "m"), Parameter("b", "m/s")])
SETTINGS = {"warmup": 300, "samples": 1000}


def assert_moments(posterior, mean, deviation):
    """Means and standard deviations within four Monte-Carlo standard errors."""
    error = np.asarray(deviation) / np.sqrt(posterior.effective_size)
    np.testing.assert_array_less(np.abs(posterior.flat.mean(axis=0) - mean), 4 * error)
    # Twice the error that normal draws would have: squares mix slower, and Student's t has heavier tails.
    np.testing.assert_array_less(np.abs(posterior.flat.std(axis=0) - deviation), 6 * error)


@pytest.fixture(scope="module")
def known():
    return sample_posterior(LINE, pair(0, 0), SPACE, variance="known", **SETTINGS)


@pytest.fixture(scope="module")
def line():
    return fit(LINE, pair(0, 0), SPACE)


def test_known_variance_is_a_normal_posterior(known, line):
    rows = np.asarray(LINE.rows)[:, :2]
    covariance = np.linalg.inv(rows.T @ rows)
    assert known.success, known.message
    assert_moments(known, line.values, np.sqrt(np.diag(covariance)))
    expected = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert np.corrcoef(known.flat.T)[0, 1] == pytest.approx(expected, abs=0.05)
    assert (
        stats.kstest(known["a"][:, ::10].ravel(), stats.norm(line.values[0], covariance[0, 0] ** 0.5).cdf).pvalue > 1e-3
    )
    assert known.values.shape == (4, 1000, 2)
    np.testing.assert_allclose(known.acceptance, 0.85, atol=0.1)


BOUNDED = ParameterSpace([Parameter("a", "m", 2.9), Parameter("b", "", -1.0, 0.5, prior=(0.1, 0.4))])


@pytest.mark.slow
def test_unknown_variance_is_students_t():
    """With 8 data and 2 parameters the tails have 6 degrees of freedom; bounds and prior are too far to matter."""
    residual = curved(1e4 * np.asarray(LINE.rows), 1e4 * (np.asarray(LINE.rows) @ [5.0, 0.1, 0.0]) + 5 * X * (X - 1.4))
    result = fit(residual, pair(4, 0), BOUNDED)
    posterior = sample_posterior(residual, result, **SETTINGS)
    assert posterior.success, posterior.message
    assert_moments(posterior, result.values, result.standard_errors * np.sqrt(6 / 4))
    np.testing.assert_allclose(posterior.intervals(), result.intervals(), atol=0.4 * result.standard_errors.min())
    scaled = (posterior["b"][:, ::10].ravel() - result.values[1]) / result.standard_errors[1]
    assert stats.kstest(scaled, stats.t(6).cdf).pvalue > 1e-3


def test_bounds_cut_off_and_priors_pull():
    """A fit on its bound, a parameter between two bounds with a prior: moments by quadrature over the density."""
    residual = curved(LINE.rows, LINE.samples - 0.6)
    start = fit(residual, pair(4, 0), BOUNDED)
    assert start.active[0]
    posterior = sample_posterior(residual, start, **SETTINGS)
    a, b = np.meshgrid(np.linspace(2.9, 9, 1500), np.linspace(-1, 0.5, 600), indexing="ij")
    rows = np.asarray(residual.rows)
    square = sum((row[0] * a + row[1] * b - y) ** 2 for row, y in zip(rows, residual.samples, strict=True))
    density = square**-4.0 * np.exp(-0.5 * ((b - 0.1) / 0.4) ** 2)
    mean = [np.average(x, weights=density) for x in (a, b)]
    assert posterior.success, posterior.message
    square = [np.average((x - m) ** 2, weights=density) for x, m in zip((a, b), mean, strict=True)]
    assert_moments(posterior, mean, np.sqrt(square))
    assert posterior["a"].min() >= 2.9
    assert posterior["b"].min() >= -1 and posterior["b"].max() <= 0.5


@pytest.mark.parametrize("bounds", [(-np.inf, np.inf), (2.0, np.inf), (-np.inf, 3.0), (2.0, 3.0), (2.0, 1e6)])
@pytest.mark.parametrize("width", [1e-3, 1.0, 1e3])
def test_the_map_into_the_bounds(bounds, width):
    """There and back; its logarithmic slope is that of the map, also where other bounds are infinite."""
    box = Box(*(jnp.asarray([side]) for side in (*bounds, width)))
    x = jnp.asarray([2.2])
    u = box.outside(x)
    np.testing.assert_allclose(box.inside(u), x, rtol=1e-9)
    np.testing.assert_allclose(box.log_slope(u), jnp.log(jax.jacfwd(box.inside)(u)[0]), atol=1e-6)
    far = box.inside(jnp.asarray([1e9]) * width)
    assert bounds[0] <= box.inside(-jnp.asarray([1e9]) * width)[0] <= far[0] <= bounds[1]


def test_a_banana():
    """a ~ N(0, 1), b | a ~ N(a², 0.5²): mean of b is 1, its variance 2.25."""
    residual = curved([[1, 0, 0], [0, 2, -2]], [0, 0])
    posterior = sample_posterior(residual, pair(0, 0), SPACE, variance="known", **SETTINGS)
    np.testing.assert_array_less(posterior.r_hat, 1.03)
    assert_moments(posterior, [0, 1], [1, 1.5])


def test_the_seed_is_all_the_chance_there_is(known):
    again = sample_posterior(LINE, pair(0, 0), SPACE, variance="known", **SETTINGS)
    np.testing.assert_array_equal(again.values, known.values)
    other = sample_posterior(LINE, pair(0, 0), SPACE, variance="known", seed=2, **SETTINGS)
    assert not np.any(other.values == known.values)


def test_two_modes_are_noticed():
    """Chains that start around different minima of a double well stay there, and R̂ says so."""
    residual = curved([[0, 0, 10], [0, 1, 0]], [10, 0])
    starts = np.asarray([[1.0, 0], [1, 0], [-1, 0], [-1, 0]])
    posterior = sample_posterior(residual, pair(1, 0), SPACE, variance="known", starts=starts, **SETTINGS)
    assert posterior.r_hat[0] > 1.5
    assert not posterior.success
    assert "The chains disagree (R̂ above 1.01) on a. " in posterior.message
    assert "NOT to be trusted" in repr(posterior)


def test_a_failing_model_is_a_point_without_density():
    """NaN where a < 0: the posterior is the part above, and the draws that ran into it are counted."""
    residual = curved([[1, 0, 0], [0, 1, 0]], [1, 0], floor=0.0)
    posterior = sample_posterior(residual, pair(1, 0), SPACE, variance="known", **SETTINGS)
    assert np.all(posterior["a"] >= 0)
    assert posterior["a"].mean() == pytest.approx(stats.truncnorm(-1, np.inf, loc=1).mean(), abs=0.12)
    assert posterior.divergences > 0
    assert "met a failed simulation" in posterior.message


def test_diagnostics():
    """Both against blackjax 1.7.1, on chains with and without a common mean; the size of a process of known memory."""
    noise = np.random.default_rng(7).standard_normal((4, 400, 2))
    samples = noise + np.arange(4)[:, None, None] * [0.0, 0.2]
    np.testing.assert_allclose(r_hat(samples), [1.00309502, 1.04264302], rtol=1e-8)
    np.testing.assert_allclose(effective_size(samples), [1498.95, 72.21], rtol=0.02)
    memory = lfilter([1.0], [1.0, -0.8], np.random.default_rng(8).standard_normal((4, 5000, 1)), axis=1)
    np.testing.assert_allclose(effective_size(memory), 20_000 * 0.2 / 1.8, rtol=0.15)


def test_a_chain_that_never_moved_is_not_trusted():
    stuck = np.zeros((4, 50, 1))
    assert np.isnan(r_hat(stuck)) and np.isnan(effective_size(stuck))
    space = ParameterSpace([Parameter("a")])
    posterior = Posterior(space, stuck, r_hat(stuck), effective_size(stuck), 0, np.zeros(4), 0, 3, "known")
    assert not posterior.success
    assert "The chains disagree" in posterior.message


def test_save_and_load(known, tmp_path):
    known.save(tmp_path / "posterior.npz")
    loaded = Posterior.load(tmp_path / "posterior.npz")
    np.testing.assert_array_equal(loaded.values, known.values)
    assert loaded.to_dataframe().equals(known.to_dataframe())
    assert (loaded.space, loaded.message, loaded.data) == (known.space, known.message, 8)
    (tmp_path / "other.npz").write_text("nothing")
    with pytest.raises(InputError, match="not a readable posterior"):
        Posterior.load(tmp_path / "other.npz")


def test_shows_itself(known):
    table = known.to_dataframe(level=0.9)
    assert list(table.index) == ["a", "b"] and list(table["unit"]) == ["m", "m/s"]
    assert {"mean", "standard deviation", "median", "90 % from", "90 % to", "R-hat", "effective size"} < set(table)
    assert "<table" in known._repr_html_()
    assert "4 chains of 1000 samples, known variance" in repr(known)
    with pytest.raises(InputError, match="'c' was not sampled; these were: a, b"):
        known["c"]
    with pytest.raises(InputError, match="level must be between 0 and 1"):
        known.intervals(95.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"chains": 1}, "chains must be at least 2, but is 1"),
        ({"variance": "none"}, 'must be "estimated" or "known"'),
        ({"acceptance": 1.0}, "acceptance must be between 0 and 1"),
        ({"space": None}, "space is missing"),
        ({"starts": np.zeros((3, 2))}, r"starts has shape \(3, 2\); give one row for each of the 4 chains"),
        ({"starts": np.full((4, 2), np.nan)}, "not finite at the start of chain 0"),
        ({"residual": curved([[1, 0, 0]], [0])}, "Neither data nor priors limit b: there is no posterior"),
        ({"residual": curved([[np.nan, 0, 0]], [0])}, "not finite at the model given"),
        (
            {"residual": Curved(LINE.rows[:2], LINE.samples[:2], LINE.floor)},
            "2 residuals are not enough to estimate 2 parameters",
        ),
    ],
)
def test_what_cannot_be_sampled_is_refused(changes, message):
    arguments = {"residual": LINE, "model": pair(0, 0), "space": SPACE} | changes
    with pytest.raises(InputError, match=message):
        sample_posterior(**arguments)


def test_without_the_extra_the_message_names_it(monkeypatch):
    real = builtins.__import__

    def missing(name, *rest):
        if name.startswith("blackjax"):
            raise ImportError("No module named 'blackjax'")
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(InputError, match=r"pip install 'drivetwin\[bayes\]'"):
        sample_posterior(LINE, pair(0, 0), SPACE)
