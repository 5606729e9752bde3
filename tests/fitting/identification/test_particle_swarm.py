"""The swarm that gradient fits are compared with: it finds minima, counts rightly and repeats itself."""

import numpy as np
import pytest

from fitting.identification.particle_swarm import particle_swarm
from twin._checks import InputError

LOW, HIGH = np.array([-5.0, -5.0, -5.0]), np.array([5.0, 5.0, 5.0])


def quadratic(places):
    return np.sum(np.array([1.0, 10.0, 100.0]) * (places - np.array([1.0, -2.0, 3.0])) ** 2, axis=1)


def rosenbrock(places):
    x, y = places.T
    return (1 - x) ** 2 + 100 * (y - x**2) ** 2


class Counted:
    """A cost that counts its positions and remembers the worst excess over its bounds."""

    def __init__(self, cost, lower, upper):
        self.cost, self.lower, self.upper = cost, lower, upper
        self.positions, self.excess = 0, 0.0

    def __call__(self, places):
        self.positions += len(places)
        self.excess = max(self.excess, np.max(self.lower - places), np.max(places - self.upper))
        return self.cost(places)


def test_the_minimum_of_a_quadratic():
    cost = Counted(quadratic, LOW, HIGH)
    found = particle_swarm(cost, LOW, HIGH, target=1e-10)
    assert found.reached
    assert found.cost <= 1e-10
    assert found.cost == quadratic(found.values[None])[0]
    np.testing.assert_allclose(found.values, [1.0, -2.0, 3.0], atol=2e-5)
    assert found.evaluations == cost.positions
    assert cost.excess <= 0


def test_the_minimum_of_rosenbrock_at_any_seed():
    low, high = np.array([-2.0, -2.0]), np.array([2.0, 2.0])
    for seed in range(1, 6):
        found = particle_swarm(rosenbrock, low, high, target=1e-8, seed=seed)
        assert found.reached
        np.testing.assert_allclose(found.values, 1.0, atol=1e-3)


def test_a_minimum_on_a_bound():
    found = particle_swarm(quadratic, LOW, np.array([0.5, 5.0, 5.0]), target=0.25 + 1e-9)
    assert found.reached
    assert found.values[0] == 0.5


def test_the_same_seed_gives_the_same_swarm():
    one, two, other = (particle_swarm(quadratic, LOW, HIGH, target=1e-3, seed=s) for s in (3, 3, 4))
    np.testing.assert_array_equal(one.values, two.values)
    assert (one.cost, one.evaluations) == (two.cost, two.evaluations)
    assert not np.array_equal(one.values, other.values)


def test_it_stops_after_its_rounds():
    cost = Counted(quadratic, LOW, HIGH)
    found = particle_swarm(cost, LOW, HIGH, target=0.0, particles=7, rounds=5)
    assert not found.reached
    assert found.evaluations == cost.positions == 7 * 6
    longer = particle_swarm(quadratic, LOW, HIGH, target=0.0, particles=7, rounds=50)
    assert longer.cost < found.cost


def test_the_last_round_counts():
    """A target that is first met in the last round is met."""
    whole = particle_swarm(quadratic, LOW, HIGH, target=1e-3)
    rounds = whole.evaluations // 40 - 1
    assert particle_swarm(quadratic, LOW, HIGH, target=1e-3, rounds=rounds).reached
    assert not particle_swarm(quadratic, LOW, HIGH, target=1e-3, rounds=rounds - 1).reached


def test_a_cost_that_is_not_a_number_never_leads():
    """As where a simulation fails: the first particle too."""

    def holed(places):
        return np.where(places[:, 0] < 0.9, np.nan, quadratic(places))

    found = particle_swarm(holed, LOW, HIGH, target=1e-8)
    assert found.reached
    np.testing.assert_allclose(found.values, [1.0, -2.0, 3.0], atol=2e-4)


@pytest.mark.parametrize(
    ("low", "high"),
    [([0.0, 0.0], [1.0, np.inf]), ([0.0, np.nan], [1.0, 1.0]), ([0.0, 2.0], [1.0, 1.0]), ([0.0, 1.0], [1.0, 1.0])],
)
def test_bounds_must_be_finite_and_in_order(low, high):
    with pytest.raises(InputError, match="finite bounds"):
        particle_swarm(rosenbrock, np.array(low), np.array(high), target=0.0)
