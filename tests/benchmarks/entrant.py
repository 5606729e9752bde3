"""What takes part in a benchmark, and how it is timed."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

# A call shorter than this [s] is repeated within its round, so that a round is not decided by one interruption.
_ROUND = 0.1
# A call longer than this [s] averages the machine's noise by itself: it is made once.
_LONG = 4.0


@dataclass(frozen=True)
class Entrant:
    """One tool with one setting, ready to be called."""

    name: str
    """Name in the table."""
    role: str
    """What it stands for: the fastest right entrant of a role is the one compared."""
    simulate: Callable[[], np.ndarray]
    """Positions at the ticks, shape (ticks,) [m]."""
    jacobian: Callable[[], np.ndarray] | None
    """Derivatives of the positions, shape (ticks, parameters) [m per scaled parameter]; None where it has none."""
    build: float = 0.0
    """Time that it took to set up [s]."""
    compiles: bool = False
    """Whether the first call compiles, and so is timed apart."""


@dataclass(frozen=True)
class Spread:
    """Times of repeated calls."""

    min: float
    """Shortest [s]."""
    median: float
    """Median [s]."""
    max: float
    """Longest [s]."""
    calls: int
    """Number of calls [-]."""
    turns: list[float]
    """Median call of each turn, to be compared with others' in the same turn [s]."""

    @staticmethod
    def of(times: Sequence[float], turns: Sequence[float] = ()) -> "Spread":
        """The spread of times, at least one [s].

        Args:
            times: all of them.
            turns: medians of turns; each time is a turn if not given.
        """
        return Spread(min(times), float(np.median(times)), max(times), len(times), list(turns or times))


@dataclass(frozen=True)
class Timing:
    """What one function took, and what it returned at its first call."""

    spread: Spread
    """Calls after compilation."""
    compile: float
    """First call less the shortest later one, where the first call compiles [s]; else 0."""
    answer: np.ndarray
    """Result of the first call."""


def time_interleaved(
    functions: Mapping[str, tuple[Callable[[], np.ndarray], bool]],
    rounds: int,
    accept: Callable[[str, np.ndarray], bool],
) -> dict[str, Timing]:
    """Time several functions in turns, so that whatever else the machine does meets all of them alike.

    Args:
        functions: by name, the function and whether its first call compiles.
        rounds: turns that each function gets.
        accept: whether an answer is right; functions with a wrong answer are timed once only.

    Returns:
        Timings by name. The first call gives the answer; it counts as a timing only if it does not compile.
    """
    answers, first, times, turns = {}, {}, {name: [] for name in functions}, {name: [] for name in functions}
    for name, (function, compiles) in functions.items():
        answers[name], first[name] = _timed(function)
        if not compiles:
            times[name].append(first[name])
    for _ in range(rounds):
        for name, (function, compiles) in functions.items():
            if accept(name, answers[name]) and (compiles or first[name] < _LONG):
                calls = _round_of(function)
                times[name] += calls
                turns[name].append(float(np.median(calls)))
    timings = {}
    for name, (function, compiles) in functions.items():
        spread = Spread.of(times[name] or [_timed(function)[1]], turns[name])
        timings[name] = Timing(spread, max(first[name] - spread.min, 0.0) if compiles else 0.0, answers[name])
    return timings


def _round_of(function: Callable[[], np.ndarray]) -> list[float]:
    times = []
    while sum(times) < _ROUND:
        times.append(_timed(function)[1])
    return times


def _timed(function: Callable[[], np.ndarray]) -> tuple[np.ndarray, float]:
    begin = time.perf_counter()
    answer = function()
    return answer, time.perf_counter() - begin
