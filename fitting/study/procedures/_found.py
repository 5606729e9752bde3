"""What a procedure found."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from fitting.controls import Control
from fitting.identifiability import IdentifiabilityReport
from fitting.multistart import MultistartResult
from fitting.report.compared import Compared
from fitting.result import Estimate, FitResult
from twin.frf import FRF
from twin.record import Record


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
    records: dict[str, Record] | None = None
    """Records, for the report."""
    verdicts: IdentifiabilityReport | None = None
    """What the data can tell, for the report."""
    many: MultistartResult | None = None
    """All starts, for the report."""
    controls: Sequence[Control] = ()
    """Controls, for the report."""
    series: Sequence[Compared] = ()
    """Measured and modelled samples, for the report."""
    remarks: Mapping[str, Sequence[str]] | None = None
    """Remarks on each record, for the report."""
    derived: Mapping[str, Estimate] | None = None
    """Quantities that follow from the parameters, for the report."""
