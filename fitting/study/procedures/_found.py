"""What a procedure found."""

from typing import Any, NamedTuple

from fitting.result import FitResult
from twin.frf import FRF


class Found(NamedTuple):
    """Parameters by a named procedure."""

    text: str
    """For the reader."""
    summary: dict[str, Any]
    """As plain numbers and text."""
    result: FitResult | None = None
    """The fit behind it, for the report."""
    responses: dict[str, tuple[FRF, FRF]] | None = None
    """Measured and fitted responses, for the report."""
