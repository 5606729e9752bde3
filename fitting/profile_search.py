"""The search for the ends of profile intervals: all parameters and both sides move on as one batch."""

import itertools
from collections.abc import Iterable

import numpy as np

from fitting.lanes import Task, solve_lanes
from fitting.objective import Objective
from fitting.result import FitResult
from fitting.solve import Solver


class Side:
    """What is known on one side of the estimate of one parameter."""

    def __init__(self, index: int, sign: int, scale: float, room: float):
        self.index, self.sign, self.room = index, sign, room
        self.shifts, self.ratios, self.vectors = [0.0], [0.0], []
        self.next = min(scale, room)
        self.done = room <= 0
        self.bracket = np.inf
        self.failures = 0

    def note(self, shift: float, ratio: float, vector: np.ndarray) -> None:
        """Add a point; a fit that failed counts as not seen."""
        if not np.isfinite(ratio):
            return
        at = int(np.searchsorted(self.shifts, shift))
        self.shifts.insert(at, shift)
        self.ratios.insert(at, ratio)
        # The estimate itself, at shift 0, has no entry here.
        self.vectors.insert(at - 1, vector)

    def crossing(self, critical: float) -> int | None:
        """Number of the point after which the ratio first crosses the critical value."""
        for i, (before, after) in enumerate(itertools.pairwise(self.ratios)):
            if before < critical <= after:
                return i
        return None

    def end(self, critical: float) -> float | None:
        """Shift at which the ratio first crosses the critical value, between the points known."""
        i = self.crossing(critical)
        if i is None:
            return None
        (a, b), (ra, rb) = self.shifts[i : i + 2], self.ratios[i : i + 2]
        return a + (critical - ra) / (rb - ra) * (b - a)

    def plan(self, critical: float) -> None:
        """Where to look next: between the points if the end is there, else farther out."""
        i, end = self.crossing(critical), self.end(critical)
        last, ratio = self.shifts[-1], self.ratios[-1]
        if i is not None and end is not None:
            (a, b), (below, above) = self.shifts[i : i + 2], self.ratios[i : i + 2]
            self.done = min(critical - below, above - critical) < 0.003 * critical or b - a < 1e-9 * b
            # A straight line between points that are far apart creeps up from one side: halve instead.
            self.next = 0.5 * (a + b) if b - a > 0.5 * self.bracket else end
            self.bracket = b - a
        elif last >= self.room:
            self.done = True
        elif last > 0 and self.next > last:
            # The fit there failed: less far out.
            self.next = 0.5 * (last + self.next)
            self.done = self.next - last <= 1e-6 * last
        else:
            growth = np.clip(1.05 * critical / max(ratio, 1e-3 * critical), 1.2, 3.0)
            self.next = min(max(last, 1e-12) * growth if last > 0 else self.next / 3, self.room)
            self.done = self.next <= 1e-14 * max(1.0, self.room if np.isfinite(self.room) else 1.0)


class ProfileSearch:
    """All sides of all profiles, moved on together."""

    def __init__(
        self,
        *,
        objective: Objective,
        result: FitResult,
        indices: list[int],
        squares: np.ndarray,
        critical: float,
        solver: Solver,
        max_steps: int,
    ):
        self.objective, self.result, self.indices = objective, result, indices
        self.squares, self.critical, self.solver, self.max_steps = squares, critical, solver, max_steps
        self.lowest = result.cost
        space = result.space
        self.lower, self.upper = np.asarray(space.lower), np.asarray(space.upper)
        spread = np.sqrt(np.diag(result.scaled_covariance))
        self.sides = []
        for i in indices:
            x = result.scaled[i]
            span = self.upper[i] - self.lower[i]
            guess = critical * spread[i] if np.isfinite(spread[i]) and spread[i] > 0 else np.nan
            if not np.isfinite(guess):
                guess = 0.1 * span if np.isfinite(span) else 0.1 * max(1.0, abs(x))
            self.sides += [Side(i, -1, guess, x - self.lower[i]), Side(i, 1, guess, self.upper[i] - x)]

    def advance(self) -> bool:
        """One round of the search; False when all ends are found."""
        busy = [side for side in self.sides if not side.done]
        if busy:
            self.solve([(side, side.next) for side in busy])
            for side in busy:
                side.plan(self.critical)
        return any(not side.done for side in self.sides)

    def unsettled(self) -> list[str]:
        """Parameters of which an end is only known roughly."""
        return self._paths_of(side for side in self.sides if not side.done)

    def failing(self) -> list[str]:
        """Parameters of which an end was not reached because fits with them held did not converge."""
        return self._paths_of(
            s for s in self.sides if s.failures and s.end(self.critical) is None and s.shifts[-1] < s.room
        )

    def fill(self, points: int) -> None:
        """Points in between, for the picture."""
        wanted = []
        for side in self.sides:
            end = side.end(self.critical) or side.shifts[-1]
            farthest = min(1.15 * end, side.room)
            grid = farthest * np.arange(1, points + 1) / points
            wanted += [(side, shift) for shift in grid if np.min(np.abs(np.asarray(side.shifts) - shift)) > 0.02 * end]
        if wanted:
            self.solve(wanted)

    def solve(self, wanted: list[tuple[Side, float]]) -> None:
        """Fit all others with one parameter held, each from its nearest neighbour."""
        count, best = len(wanted), self.result.scaled
        lower, upper = np.tile(self.lower, (count, 1)), np.tile(self.upper, (count, 1))
        start = np.empty((count, best.size))
        for row, (side, shift) in enumerate(wanted):
            held = np.clip(best[side.index] + side.sign * shift, self.lower[side.index], self.upper[side.index])
            start[row] = np.clip(self._guess(side, shift), self.lower, self.upper)
            start[row, side.index] = lower[row, side.index] = upper[row, side.index] = held
        # Few widths, so that few programs are compiled.
        width = min(64, max(8, 1 << (2 * len(self.indices) - 1).bit_length()))
        ended = solve_lanes(
            self.objective, Task(start, lower, upper), self.solver, max_steps=self.max_steps, width=width
        )
        for row, (side, shift) in enumerate(wanted):
            cost = ended.cost[row] if ended.success[row] else np.nan
            self.lowest = np.nanmin([self.lowest, cost])
            square = self.squares[side.index]
            rise = max(2 * (cost - self.result.cost) / square, 0.0) if np.isfinite(cost) else np.nan
            side.failures += not np.isfinite(rise)
            side.note(shift, float(np.sqrt(rise)), ended.vector[row])

    def points(self, index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Shifts, ratios and scaled vectors of one profile, rising, the estimate among them."""
        below, above = self.both(index)
        shifts = np.concatenate([-np.asarray(below.shifts[:0:-1]), np.asarray(above.shifts)])
        ratio = np.concatenate([-np.asarray(below.ratios[:0:-1]), np.asarray(above.ratios)])
        return shifts, ratio, np.stack([*below.vectors[::-1], self.result.scaled, *above.vectors])

    def both(self, index: int) -> tuple[Side, Side]:
        """The two sides of one parameter."""
        below, above = (side for side in self.sides if side.index == index)
        return below, above

    def _paths_of(self, sides: Iterable[Side]) -> list[str]:
        return list(dict.fromkeys(self.result.space.paths[side.index] for side in sides))

    def _guess(self, side: Side, shift: float) -> np.ndarray:
        """Where the other parameters will be: on the line through the two nearest points, else by linear theory."""
        best, i = self.result.scaled, side.index
        shifts = np.asarray(side.shifts)
        vectors = [best, *side.vectors]
        if len(vectors) > 1:
            near = int(np.clip(np.searchsorted(shifts, shift), 1, len(shifts) - 1))
            a, b = shifts[near - 1], shifts[near]
            return vectors[near - 1] + (shift - a) / (b - a) * (vectors[near] - vectors[near - 1])
        column = self.result.scaled_covariance[:, i]
        slope = column / column[i] if np.isfinite(column[i]) and column[i] > 0 else np.zeros_like(best)
        return best + side.sign * shift * np.where(np.isfinite(slope), slope, 0.0)
