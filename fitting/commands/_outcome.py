"""What a command gives back to the command line."""

from typing import Any, NamedTuple


class Outcome(NamedTuple):
    """What a command found."""

    text: str
    """For the reader."""
    summary: dict[str, Any] | None = None
    """For programs, by `--json`: what JSON can hold; None for a command that has nothing more than its text."""
    code: int = 0
    """Exit code: 0, or 1 where it was done but the result must not be trusted, as a fit that did not converge."""
