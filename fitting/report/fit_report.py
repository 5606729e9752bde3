"""The report of a fit, from the package's result objects."""

from collections.abc import Mapping, Sequence

from jaxtyping import ArrayLike

from fitting.controls import Control
from fitting.identifiability import IdentifiabilityReport
from fitting.multistart import MultistartResult
from fitting.profile import ProfileResult
from fitting.report.asked import Asked, asked_section
from fitting.report.compared import Compared, compared
from fitting.report.comparison import comparison_section
from fitting.report.content import Report, Section
from fitting.report.control_results import controls_section
from fitting.report.correlation import correlation_section
from fitting.report.data import records_section
from fitting.report.many_starts import many_starts_section
from fitting.report.numbers import plain
from fitting.report.parameters import parameters_section
from fitting.report.profiles import profiles_section
from fitting.report.ranking import ranking_section
from fitting.report.residuals import residuals_section
from fitting.report.responses import responses_section
from fitting.report.warnings import warnings_of
from fitting.result import Estimate, FitResult
from sensitivity.derivative_result import DerivativeMeasures
from sensitivity.sobol_result import SobolIndices
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
    response_units: Mapping[str, str] | None = None,
    identifiability: IdentifiabilityReport | None = None,
    many: MultistartResult | None = None,
    profiles: ProfileResult | None = None,
    ranking: SobolIndices | DerivativeMeasures | None = None,
    controls: Sequence[Control] = (),
    series: Sequence[Compared] = (),
    derived: Mapping[str, Estimate] | None = None,
    remarks: Mapping[str, Sequence[str]] | None = None,
    warnings: Sequence[str] = (),
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
        response_units: unit of output per input of each response by name; "1" if not given.
        identifiability: what the data can tell, from `fitting.identifiability`.
        many: fits from many starts.
        profiles: profile likelihoods of the fit.
        ranking: sensitivity study, `SobolIndices` or `DerivativeMeasures`.
        controls: controls of the fit, from `fitting.controls`.
        series: further measured and modelled samples, of records that are among `records`.
        derived: quantities that follow from the parameters, by name.
        remarks: remarks on the preparation of each record.
        warnings: what a reader has to know even before what the fit itself warns of.
        more: further sections, for the end of the page.
        stamp: when the report was made; the page holds no other time.

    Raises:
        InputError: a simulated channel that was not measured, or of another length.
    """
    records, responses = dict(records or {}), dict(responses or {})
    series = (*compared(records, simulated or {}, deviation), *series)
    sections = [records_section(records, remarks)] if records else []
    if series:
        sections += [comparison_section(series), residuals_section(series, records)]
    if responses:
        measured, model = ({name: pair[i] for name, pair in responses.items()} for i in (0, 1))
        sections.append(responses_section(measured, model, response_units))
    sections += [parameters_section(result, identifiability, derived), correlation_section(result)]
    sections += [profiles_section(profiles, result)] if profiles is not None else []
    sections += [many_starts_section(many)] if many is not None else []
    sections += [ranking_section(ranking)] if ranking is not None else []
    sections += [controls_section(controls)] if controls else []
    residuals = {one.name: one.weighted if one.weighted is not None else one.error for one in series}
    return Report(
        title=title,
        asked=asked_section(asked, result.space),
        warnings=(
            *warnings,
            *warnings_of(result, identifiability=identifiability, many=many, residuals=residuals, controls=controls),
        ),
        sections=(*sections, *more),
        facts=_facts(result, controls),
        stamp=stamp,
    )


def _facts(result: FitResult, controls: Sequence[Control]) -> tuple[tuple[str, str], ...]:
    facts = [
        ("Fit", "converged" if result.success else "not converged"),
        ("Residual / noise, rms", plain(result.rms, 3)),
        ("Free parameters", str(len(result.space))),
        ("Degrees of freedom", str(result.degrees_of_freedom)),
    ]
    if controls:
        passed = sum(control.passed for control in controls)
        facts.append(("Controls passed", f"{passed} of {len(controls)}"))
    return tuple(facts)
