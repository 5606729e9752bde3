"""Report on the reproduction of Ellinger and Zaeh: numbers, tables and pictures in a folder, main numbers as text."""

import time
from pathlib import Path
from typing import Any

from fitting.identification.ellinger_plots import draw_all
from fitting.identification.ellinger_study import DISTURBED_MODEL, IDEAL, repeat_disturbed, repeat_ideal, study_case
from fitting.identification.ellinger_summary import printed_beside, summarise, summarise_case, tables_of
from fitting.json_file import write_json
from fitting.result import FitResult
from twin.io.parameter_file import ParameterEntry, write_parameters

# The truth whose published identification is shown; any would do.
_TRUTH = 3


def reproduce_ellinger(
    out: Path, *, truths: int = 20, disturbances: int = 10, n: int = 1024, starts: int = 100
) -> dict[str, Any]:
    """Repeat Ellinger and Zaeh: a machine's 27 parameters by sensitivities and small problems, and by a joint fit.

    Writes `summary.json`, `parameters.toml` (of the disturbed model), `table2.csv` to `table5.csv`, sensitivities and
    problems of both cases as CSV, and one picture for each of the figures 2 and 5 to 9.

    Args:
        out: folder for the files; made if it does not exist.
        truths: random truths that an ideal model is identified from.
        disturbances: random truths with disturbed models.
        n: base points of the sensitivity studies.
        starts: runs of each small problem.

    Returns:
        The content of `summary.json`.
    """
    clock = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    cases = {
        name: study_case(_TRUTH, disturbed=name == DISTURBED_MODEL, n=n, starts=starts)
        for name in (IDEAL, DISTURBED_MODEL)
    }
    repeats = {IDEAL: repeat_ideal(range(truths)), DISTURBED_MODEL: repeat_disturbed(range(disturbances))}
    parts = {}
    for name, case in cases.items():
        tables = tables_of(case)
        parts[name] = summarise_case(case, tables, repeats[name])
        for number, table in printed_beside(name, tables).items():
            table.to_csv(out / f"table{number}.csv")
    summary = summarise(cases, parts)
    draw_all(out, cases[IDEAL], cases[DISTURBED_MODEL])
    for name, case in cases.items():
        case.guided.sensitivity.indices.to_dataframe().to_csv(out / f"sensitivity_{name}.csv")
        case.guided.runs.summary().to_csv(out / f"problems_{name}.csv")
    write_parameters(out / "parameters.toml", _entries(cases[DISTURBED_MODEL].refined.fit))
    summary["seconds_total"] = time.perf_counter() - clock
    write_json(out / "summary.json", summary)
    return summary


def _entries(result: FitResult) -> list[ParameterEntry]:
    return [
        ParameterEntry(p.path, float(v), p.unit or "1", float(se), p.lower, p.upper, "simulated modes of a machine")
        for p, v, se in zip(result.space.parameters, result.values, result.standard_errors, strict=True)
    ]
