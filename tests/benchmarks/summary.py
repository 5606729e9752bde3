"""Ratios of all sections in one table: what was compared with whom, how far they agree, and whether the goal is met."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

_HEAD = ("what", "peer", "ratio (median)", "range", "turns", "goal", "met?", "agreement")


@dataclass(frozen=True)
class SummaryRow:
    """One ratio: the peer's time, or whatever is paid, over the twin's; above one where the twin is ahead."""

    what: str
    """What was done."""
    peer: str
    """Who else did it."""
    ratio: float | None
    """Median over the turns [-]; None where the peer was refused."""
    low: float | None
    """Smallest in a turn [-]."""
    high: float | None
    """Largest in a turn [-]."""
    turns: int
    """Number of turns; one has no spread."""
    agreement: str
    """How well the answers agree."""
    least: float | None = None
    """Goal: at least this ratio [-]."""
    most: float | None = None
    """Goal: at most this ratio [-], where the ratio is a price."""

    @property
    def goal(self) -> str:
        """The goal in words."""
        limits = ((">=", self.least), ("<=", self.most))
        return " and ".join(f"{sign} {limit:g}" for sign, limit in limits if limit is not None)

    @property
    def met(self) -> str:
        """Whether the median meets the goal; empty where there is none."""
        if self.ratio is None:
            return "refused"
        if not self.goal:
            return ""
        above = self.least is None or self.ratio >= self.least
        below = self.most is None or self.ratio <= self.most
        return "yes" if above and below else "no"


def ratio_row(
    what: str, peer: str, theirs: Sequence[float], ours: Sequence[float], agreement: str, **goal: float | None
) -> SummaryRow:
    """A row from times of turns.

    Args:
        what: what was done.
        peer: who else did it.
        theirs: what the peer paid in each turn, per unit of work.
        ours: what the twin paid. With as many turns as the peer's the ratio is that within each turn; otherwise of
            every one of theirs to every one of ours.
        agreement: how well the answers agree.
        goal: `least` or `most`.
    """
    paired = len(theirs) == len(ours)
    ratios = np.divide(theirs, ours) if paired else np.divide.outer(np.asarray(theirs), np.asarray(ours)).ravel()
    low, high = float(ratios.min()), float(ratios.max())
    return SummaryRow(what, peer, float(np.median(ratios)), low, high, min(len(theirs), len(ours)), agreement, **goal)


def refused_row(what: str, peer: str, agreement: str, **goal: float | None) -> SummaryRow:
    """A row for a peer whose answer is not the same, and so is worth no ratio; arguments as of `ratio_row`."""
    return SummaryRow(what, peer, None, None, None, 0, agreement, **goal)


def compared(
    what: str,
    peer: str,
    theirs: Callable[[], np.ndarray],
    ours: Callable[[], np.ndarray],
    *,
    limit: float,
    error: Callable[[np.ndarray, np.ndarray], float] | None = None,
    rounds: int = 5,
    **goal: float | None,
) -> SummaryRow:
    """Check that two functions give the same answer, then time them in turns.

    Args:
        what: what is done.
        peer: who else does it.
        theirs: the peer's function; what it does at its first call only, such as compiling, is not timed.
        ours: the twin's.
        limit: largest error of the peer's answer. Above it, or if it is NaN, the peer is refused and not timed.
        error: from the peer's answer and the twin's to the error; if not given `difference`.
        rounds: turns of timing.
        goal: `least` or `most`.
    """
    off = (error or difference)(theirs(), ours())
    if not off <= limit:
        return refused_row(what, peer, f"differs by {off:.1e}, limit {limit:.0e}", **goal)
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(rounds):
        for function, taken in zip((theirs, ours), times, strict=True):
            begin = time.perf_counter()
            function()
            taken.append(time.perf_counter() - begin)
    return ratio_row(what, peer, *times, f"to {off:.1e}", **goal)


def difference(answer: np.ndarray, right: np.ndarray) -> float:
    """Largest difference, relative to the largest entry of the right answer; infinite where shapes differ."""
    if answer.shape != right.shape:
        return math.inf
    return float(np.max(np.abs(answer - right)) / np.max(np.abs(right)))


def as_markdown(rows: Sequence[SummaryRow]) -> str:
    """The table."""
    cells = [_HEAD, *(_cells(row) for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(_HEAD))]
    lines = ["| " + " | ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " |" for row in cells]
    rule = "|" + "|".join("-" * (w + 2) for w in widths) + "|"
    about = (
        "Ratios are the peer's time, or what else it pays, over the twin's, taken turn by turn in one run; a price is "
        "at most what its goal says. Peers that do not give the same answer are refused."
    )
    return "\n".join(["## Summary", "", about, "", lines[0], rule, *lines[1:], ""])


def as_dictionary(rows: Sequence[SummaryRow]) -> list[dict[str, Any]]:
    """The rows for `benchmarks.json`."""
    return [{**asdict(row), "goal": row.goal, "met": row.met} for row in rows]


def _cells(row: SummaryRow) -> tuple[str, ...]:
    if row.ratio is None or row.low is None or row.high is None:
        ratio, spread = "", ""
    else:
        ratio, spread = f"{row.ratio:.3g}", "" if row.turns < 2 else f"{row.low:.3g} to {row.high:.3g}"
    return (row.what, row.peer, ratio, spread, str(row.turns), row.goal, row.met, row.agreement)
