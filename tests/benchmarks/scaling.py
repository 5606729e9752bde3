"""How time grows: variants of a move and of a frequency response, parameters of a Jacobian, masses, starts of a fit."""

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.multistart import multistart
from fitting.starts import sample_starts
from tests.benchmarks import rack_case
from tests.benchmarks.frequency_case import OUTPUTS, frequency_case
from tests.benchmarks.swarm import problems
from twin.batch import batched
from twin.control import ClosedLoop, DelayedPlant
from twin.linear import SecondOrder, frequency_response
from twin.modal import modes
from twin.parameters import ParameterSpace
from twin.references import JerkLimitedMove
from twin.simulation import simulate
from twin.stepping import ConstantSteps

DURATION = 1.0
"""Length of the rack-and-pinion moves [s]."""
SUBSTEPS = 17
"""Constant steps between saved times, accurate enough for all variants."""
# A call longer than this [s] is timed once.
_LONG = 2.0
# Calls are repeated in a turn until they took as long as this [s].
_TURN = 0.05


class Sizes(NamedTuple):
    """How large the runs are that growth is read from."""

    moves: tuple[int, ...] = (1, 10, 100, 1000, 10_000)
    """Variants of a move."""
    responses: tuple[int, ...] = (1, 10, 100, 1000, 10_000, 100_000)
    """Variants of a frequency response."""
    parameters: tuple[int, ...] = (1, 5, 10, rack_case.PARAMETERS)
    """Parameters of a Jacobian."""
    masses: tuple[int, ...] = (2, 5, 10, 20, 50, 100, 200)
    """Masses of a chain."""
    starts: tuple[int, ...] = (1, 10, 100, 1000)
    """Starts of a fit."""
    streamed: int = 512
    """Variants of a move that one stream, two, and two processes compute."""
    rounds: int = 3
    """Turns of timing; long calls are made once."""


SHORT = Sizes(
    moves=(1, 100),
    responses=(1, 100, 10_000),
    # Each takes long to compile.
    parameters=(),
    masses=(2, 10, 50),
    starts=(1, 10, 100),
    streamed=64,
    rounds=2,
)


class Curve(NamedTuple):
    """Time against one size."""

    group: str
    """Curves of one group share a picture."""
    name: str
    """What is timed."""
    item: str
    """What is counted."""
    sizes: tuple[int, ...]
    seconds: tuple[tuple[float, ...], ...]
    """Times of all turns at each size, compiled before [s]."""

    @property
    def medians(self) -> np.ndarray:
        """Median time at each size [s]."""
        return np.array([np.median(times) for times in self.seconds])

    @property
    def exponent(self) -> float:
        """Slope of log time over log size, over all sizes."""
        return float(np.polyfit(np.log(self.sizes), np.log(self.medians), 1)[0])

    @property
    def last_exponent(self) -> float:
        """The slope between the two largest sizes, where fixed costs matter least."""
        return float(np.diff(np.log(self.medians[-2:]))[0] / np.diff(np.log(self.sizes[-2:]))[0])


class Move(eqx.Module):
    """Torques and table position through the beginning of the rack-and-pinion drive's move."""

    loop: ClosedLoop
    reference: JerkLimitedMove
    times: Array
    stepping: ConstantSteps

    def __call__(self, values: Array) -> Array:
        loop = rack_case.space().unpack(self.loop, values)
        outputs = simulate(loop, self.reference, self.times, stepping=self.stepping).outputs
        return jnp.stack([outputs.table_position, outputs.torque_1, outputs.torque_2])


class Response(eqx.Module):
    """Log magnitudes of a two-mass drive's frequency response."""

    drive: DelayedPlant
    space: ParameterSpace
    frequency: Array

    def __call__(self, values: Array) -> Array:
        drive = self.space.with_values(self.drive, values)
        response = frequency_response(drive.linearise(), self.frequency, outputs=OUTPUTS, inputs=("command",))
        return jnp.log(jnp.abs(response.values))


def move() -> Move:
    """The move with the steps that the comparison with peers takes."""
    times = jnp.asarray(rack_case.TIMES[rack_case.TIMES <= DURATION + 1e-9])
    # Judged against a solution in the section on this drive, not by its own estimate.
    stepping = ConstantSteps(substeps=SUBSTEPS, rtol=1e9)
    return Move(rack_case.closed_loop(), rack_case.move(), times, stepping)


def all_curves(sizes: Sizes) -> list[Curve]:
    """Measure everything.

    Args:
        sizes: how large the runs are.
    """
    curves = [
        *variants(sizes),
        curve("parameters", "Jacobian of a move", "parameters", sizes.parameters, jacobian_of, sizes.rounds),
        curve("masses", "modes of a chain", "masses", sizes.masses, modes_of, sizes.rounds),
        curve("masses", "lowest frequency and its gradient", "masses", sizes.masses, gradient_of, sizes.rounds),
        curve("starts", "fit of Leipe's stiffness curve", "starts", sizes.starts, fits_from, sizes.rounds),
    ]
    return [one for one in curves if one.sizes]


def curve(
    group: str,
    name: str,
    item: str,
    sizes: Sequence[int],
    make: Callable[[int], Callable[[], Any]],
    rounds: int,
) -> Curve:
    """Time a function at several sizes, in turns.

    Args:
        group: of the curve.
        name: what is timed.
        item: what is counted.
        sizes: the sizes.
        make: from a size to what is called; its first call compiles.
        rounds: turns.
    """
    calls = {size: make(size) for size in sizes}
    for call in calls.values():
        jax.block_until_ready(call())
    times: dict[int, list[float]] = {size: [] for size in sizes}
    for _ in range(rounds):
        for size, call in calls.items():
            if not times[size] or times[size][0] < _LONG:
                times[size].append(_turn(call))
    return Curve(group, name, item, tuple(sizes), tuple(tuple(times[size]) for size in sizes))


def _seconds(call: Callable[[], Any]) -> float:
    begin = time.perf_counter()
    jax.block_until_ready(call())
    return time.perf_counter() - begin


def _turn(call: Callable[[], Any]) -> float:
    """Median time of a turn's calls [s]."""
    times = []
    while sum(times) < _TURN:
        times.append(_seconds(call))
    return float(np.median(times))


def variants(sizes: Sizes) -> list[Curve]:
    """Variants of a move and of a frequency response, each as one batch."""
    one, case = move(), frequency_case()
    moves = rack_case.variants(max(sizes.moves, default=1))
    respond = Response(case.model, case.space, jnp.geomspace(1.0, 200.0, 40))
    spread = np.random.default_rng(1).uniform(0.8, 1.2, (max(sizes.responses, default=1), len(case.space)))
    drives = np.asarray(case.space.values(case.model)) * spread

    def batch_of(fn: Callable, rows: np.ndarray) -> Callable[[int], Callable[[], Any]]:
        return lambda size: lambda: batched(fn, rows[:size], progress=False).value

    return [
        curve("variants", f"move of {DURATION:g} s", "variants", sizes.moves, batch_of(one, moves), sizes.rounds),
        curve(
            "variants",
            "frequency response, 40 lines",
            "variants",
            sizes.responses,
            batch_of(respond, drives),
            sizes.rounds,
        ),
    ]


@eqx.filter_jit
def _jacobian(relative: Array, values: Array, one: Move) -> Array:
    rest = jnp.ones(values.size - relative.size)
    return jax.jacfwd(lambda part: one(values * jnp.concatenate([part, rest])))(relative)


def jacobian_of(parameters: int) -> Callable[[], Any]:
    """The derivative of a move's torques and position along the first so many parameters, by forward sensitivities."""
    one, values = move(), jnp.asarray(rack_case.nominal())
    return lambda: _jacobian(jnp.ones(parameters), values, one)


def chain(stiffness: Array) -> SecondOrder:
    """Masses of 1 kg in a row, each on a spring to the one before, the first to the ground."""
    following = jnp.append(stiffness[1:], 0.0)
    matrix = jnp.diag(stiffness + following) - jnp.diag(stiffness[1:], 1) - jnp.diag(stiffness[1:], -1)
    eye = jnp.eye(stiffness.size)
    names = tuple(str(i) for i in range(stiffness.size))
    return SecondOrder(eye, 0.0 * eye, 0.0 * eye, matrix, eye, eye, names, names)


@jax.jit
def _frequencies(stiffness: Array) -> Array:
    return modes(chain(stiffness)).frequency


_lowest_and_gradient = jax.jit(jax.value_and_grad(lambda stiffness: _frequencies(stiffness)[0]))


def modes_of(masses: int) -> Callable[[], Any]:
    """Frequencies and shapes of a chain of so many masses."""
    return lambda: _frequencies(jnp.full(masses, 1e6))


def gradient_of(masses: int) -> Callable[[], Any]:
    """Its lowest frequency, and the derivatives by the stiffnesses of all its springs."""
    return lambda: _lowest_and_gradient(jnp.full(masses, 1e6))


def fits_from(starts: int) -> Callable[[], Any]:
    """Fits of two parameters from so many starts, as one batch."""
    problem = problems()["Leipe stiffness (2)"]()
    values = problem.space.unscaled_rows(sample_starts(problem.space, starts))
    return lambda: multistart(problem.residual, problem.model, problem.space, starts=values).costs


def crossover(here: Curve, there: dict[str, Any]) -> float | None:
    """Size from which on a curve is below another one, between sizes on straight lines in logarithms.

    Args:
        here: a curve.
        there: another machine's, as `as_dictionary` gives it.

    Returns:
        The size; None where it is below nowhere, or from no size on.
    """
    sizes, others = np.asarray(here.sizes, dtype=float), dict(zip(there["sizes"], there["median_s"], strict=True))
    common = [i for i, size in enumerate(here.sizes) if size in others]
    if not common:
        return None
    gain = np.log([others[here.sizes[i]] / here.medians[i] for i in common])
    slow = np.flatnonzero(gain < 0)
    if slow.size == 0:
        return float(sizes[common[0]])
    if slow[-1] == len(common) - 1:
        return None
    i, logs = slow[-1], np.log(sizes[common])
    return float(np.exp(logs[i] - gain[i] * (logs[i + 1] - logs[i]) / (gain[i + 1] - gain[i])))


def as_dictionary(curves: Sequence[Curve]) -> list[dict[str, Any]]:
    """The curves for `benchmarks.json`, times in seconds."""
    return [
        {
            **{name: getattr(one, name) for name in ("group", "name", "item", "exponent", "last_exponent")},
            "sizes": list(one.sizes),
            "turns_s": [list(times) for times in one.seconds],
            "median_s": one.medians.tolist(),
        }
        for one in curves
    ]
