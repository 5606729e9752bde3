"""Which responses to which excitations were all measured, where some are missing."""

from collections.abc import Collection
from itertools import combinations

# Up to so many names of one side every choice of them is tried.
_TRIED = 12


def largest_grid(pairs: Collection[tuple[str, str]]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The largest grid of responses and excitations without a gap.

    Args:
        pairs: (response, excitation) that were measured.

    Returns:
        Names of the responses and of the excitations, in the order in which they come.
    """
    rows, columns = (tuple(dict.fromkeys(pair[i] for pair in pairs)) for i in (0, 1))
    there = set(pairs)
    if len(columns) < len(rows):
        found = _largest(columns, rows, {(b, a) for a, b in there})
        return found[1], found[0]
    return _largest(rows, columns, there)


def _largest(
    few: tuple[str, ...], many: tuple[str, ...], there: set[tuple[str, str]]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    of = {one: {other for other in many if (one, other) in there} for one in few}

    def shared(chosen: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(other for other in many if all(other in of[one] for one in chosen))

    if len(few) <= _TRIED:
        choices = [one for size in range(len(few), 0, -1) for one in combinations(few, size)]
    else:  # the emptiest name goes first
        ranked = sorted(few, key=lambda one: len(of[one]), reverse=True)
        choices = [tuple(one for one in few if one in ranked[:size]) for size in range(len(few), 0, -1)]
    best = max(choices, key=lambda chosen: len(chosen) * len(shared(chosen)))
    return best, shared(best)


def missing(pairs: Collection[tuple[str, str]]) -> list[tuple[str, str]]:
    """Pairs that a whole grid would have.

    Args:
        pairs: (response, excitation) that were measured.
    """
    rows, columns = (tuple(dict.fromkeys(pair[i] for pair in pairs)) for i in (0, 1))
    there = set(pairs)
    return [(row, column) for row in rows for column in columns if (row, column) not in there]
