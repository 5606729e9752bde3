"""The report of a fit, from the package's result objects."""

from collections.abc import Mapping, Sequence
from typing import Any

from jaxtyping import ArrayLike

from fitting.identifiability import IdentifiabilityReport
from fitting.multistart import MultistartResult
from fitting.report.asked import Asked, asked_section
from fitting.report.compared import compared
from fitting.report.comparison import comparison_section
from fitting.report.content import Report, Section
from fitting.report.data import records_section
from fitting.report.numbers import plain
from fitting.report.parameters import parameters_section
from fitting.result import FitResult
from twin.frf import FRF
from twin.record import Record


def fit_report(
    *,
    title: str,
    asked: Asked,
    result: FitResult,
    records: Mapping[str, Record] | None = None,
    simulated: Mapping[str, Mapping[str, ArrayLike]] | None = None,
    deviation: Mapping[str, Mapping[str, ArrayLike]] | None = None,
    responses: Mapping[str, tuple[FRF, FRF]] | None = None,
    identifiability: IdentifiabilityReport | None = None,
    many: MultistartResult | None = None,
    ranking: Any = None,
    controls: Sequence[Any] = (),
    remarks: Mapping[str, Sequence[str]] | None = None,
    more: Sequence[Section] = (),
    stamp: str = "",
) -> Report:
    """The report of a fit.

    Args:
        title: title of the page.
        asked: what was asked.
        result: the fit.
        records: measured records by name.
        simulated: simulated samples by record and channel, at the record's times, in the channel's unit.
        deviation: standard deviation of the noise by record and channel, in the channel's unit: a number, or one for
            each sample.
        responses: pairs of measured and simulated frequency response by name.
        identifiability: what the data can tell, from `fitting.identifiability`.
        many: fits from many starts.
        ranking: sensitivity study, `SobolIndices` or `DerivativeMeasures`.
        controls: controls of the fit, from `fitting.controls`.
        remarks: remarks on the preparation of each record.
        more: further sections, for the end of the page.
        stamp: when the report was made; the page holds no other time.

    Raises:
        InputError: a simulated channel that was not measured, or of another length.
    """
    records = dict(records or {})
    series = compared(records, simulated or {}, deviation)
    sections = []
    if records:
        sections.append(records_section(records, remarks))
    if series:
        sections.append(comparison_section(series))
    sections.append(parameters_section(result, identifiability))
    facts = (
        ("Status", "converged" if result.success else "not converged"),
        ("Weighted residual, rms", plain(result.rms, 3)),
        ("Free parameters", str(len(result.space))),
        ("Steps", str(result.steps)),
    )
    return Report(
        title=title,
        asked=asked_section(asked, result.space),
        sections=(*sections, *more),
        facts=facts,
        stamp=stamp,
    )
