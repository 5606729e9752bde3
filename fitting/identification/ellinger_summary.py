"""What the reproduction of Ellinger and Zaeh comes to in numbers."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.identification.conformity import ConformityStatistics
from fitting.identification.ellinger_published import DEVIATIONS, SECONDS, TABLES
from fitting.identification.ellinger_study import DISTURBED_MODEL, IDEAL, Case, Repeat, Tables, deviations
from fitting.identification.machine_sensitivity import SHAPE
from twin.structure.reference_quantities import UNKNOWN

if TYPE_CHECKING:
    import pandas as pd

STIFFNESSES = tuple(q.name for q in UNKNOWN if q.kind == "stiffness")
DAMPINGS = tuple(q.name for q in UNKNOWN if q.kind != "stiffness")
"""Names of the unknowns."""
_NUMBERS = {(IDEAL, "identification"): 2, (IDEAL, "validation"): 3}
_NUMBERS |= {(DISTURBED_MODEL, "identification"): 4, (DISTURBED_MODEL, "validation"): 5}


def tables_of(case: Case) -> dict[str, Tables]:
    """Tables 2 and 3, or 4 and 5, by machine: "published", "robust", "refined", and "permuted" as control.

    Args:
        case: the case.
    """
    machines = {**case.machines, "permuted": case.permuted()}
    return {name: case.tables(machine) for name, machine in machines.items()}


def printed_beside(case: str, tables: Mapping[str, Tables]) -> "dict[int, pd.DataFrame]":
    """Tables as the paper prints them, ours beside, by their number in the paper.

    Args:
        case: "ideal" or "disturbed".
        tables: of `tables_of`.
    """
    import pandas as pd

    found = {}
    for where in ("identification", "validation"):
        columns = {}
        for measure, printed in TABLES[case, where].items():
            columns[measure.upper(), "paper"] = list(dataclasses.asdict(printed).values())
            for name, table in tables.items():
                columns[measure.upper(), name] = list(getattr(table, where).to_dict()[measure].values())
        rows = pd.Index(["worst", "5 % percentile", "mean", "median"], name="%")
        found[_NUMBERS[case, where]] = pd.DataFrame(columns, index=rows)
    return found


def summarise_case(case: Case, tables: Mapping[str, Tables], repeats: Sequence[Repeat]) -> dict[str, Any]:
    """One case's part of `summary.json`; errors are those of the joint fit, over all truths.

    Args:
        case: the truth that went through the published procedure.
        tables: of `tables_of`.
        repeats: all truths.
    """
    worst = np.max([np.abs(100 * one.deviation.relative) for one in repeats], axis=0)
    median = np.median([np.abs(100 * one.deviation.relative) for one in repeats], axis=0)
    errors = {
        quantity.name: {"worst": float(worst[i]), "median": float(median[i])} for i, quantity in enumerate(UNKNOWN)
    }
    return {
        "truths": len(repeats),
        "stiffness_error_percent": {name: errors[name] for name in STIFFNESSES},
        "damping_error_percent": {name: errors[name] for name in DAMPINGS},
        "by_truth": [_by_truth(one) for one in repeats],
        "paper_selection": {
            "truth": case.seed,
            "not_told_by_any_mode": list(case.guided.missing),
            "published": _selected(case, "published"),
            "robust": _selected(case, "robust"),
            "refined": _selected(case, "refined"),
            "problem": _problems(case),
            "paper_percent": dict(DEVIATIONS[case.name]),
        },
        "tables": {
            name: {where: _table(getattr(table, where)) for where in Tables._fields} for name, table in tables.items()
        }
        | {
            "paper": {
                where: {measure: dataclasses.asdict(one) for measure, one in TABLES[case.name, where].items()}
                for where in Tables._fields
            }
        },
        "seconds": {**case.guided.seconds._asdict(), "refinement": case.refinement_seconds},
    }


def summarise(cases: Mapping[str, Case], parts: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    """The content of `summary.json` but for the total time.

    Args:
        cases: both cases, by name.
        parts: of `summarise_case`, by name.
    """
    # The first case pays for compilation, so that the time of a study is that of the second.
    case = cases[DISTURBED_MODEL]
    runs = case.guided.runs
    return {
        **parts,
        "timed_case": DISTURBED_MODEL,
        "failed_by_case": {name: int(one.guided.runs.failed.sum()) for name, one in cases.items()},
        "gsa": {
            "n": case.guided.sensitivity.indices.n,
            "analyses": len(case.guided.sensitivity.indices.outputs),
            "seconds": case.guided.seconds.sensitivity,
            "searched_per_problem": runs.searched.sum(axis=1).tolist(),
            "screening": _screened(case),
        },
        "multistart": {
            "solves": int(runs.failed.size),
            "seconds": case.guided.seconds.parts,
            "failed": int(runs.failed.sum()),
        },
        "study": {
            "seconds": sum(case.guided.seconds) + case.refinement_seconds,
            "paper_seconds_on_40_cores": dict(SECONDS),
        },
    }


def text_of(summary: dict[str, Any]) -> str:
    """The main numbers as text.

    Args:
        summary: of `summarise`.
    """
    lines = []
    for name in (IDEAL, DISTURBED_MODEL):
        part = summary[name]
        by_truth = part["by_truth"]
        lines.append(f"{name.capitalize()} model, {len(by_truth)} random truths, joint fit: largest errors [%]")
        for kind, label in (("stiffness", "16 stiffnesses"), ("damping", "11 dampings")):
            worst = [one[f"{kind}_worst_percent"] for one in by_truth]
            middle = [one[f"{kind}_median_percent"] for one in by_truth]
            lines.append(f"  {label}: worst {max(worst):.2g}, largest median of a truth {max(middle):.2g}")
        z1 = [one["validation"] for one in by_truth]
        lines.append(
            f"  held-back z1: MACXP worst {min(one['macxp_worst'] for one in z1):.2f}, FRAC worst "
            f"{min(one['frac_worst'] for one in z1):.2f}, FRAC mean {min(one['frac_mean'] for one in z1):.2f}"
        )
        chosen = part["paper_selection"]
        lines.append(f"  truth {chosen['truth']} by the published procedure, then jointly:")
        for rule in ("published", "robust", "refined"):
            one = chosen[rule]
            lines.append(
                f"    {rule:10} stiffness median {one['stiffness_median']:.2g}, worst {one['stiffness_worst']:.2g} "
                f"({one['stiffness_worst_name']}); damping median {one['damping_median']:.2g}, worst "
                f"{one['damping_worst']:.2g} ({one['damping_worst_name']})"
            )
    screening = summary["gsa"]["screening"]
    largest = 100 * screening["largest_total_effect_cleared"]
    lines.append(
        f"Screening by derivatives, {screening['samples']} samples in {screening['seconds']:.1f} s: clears "
        f"{screening['cleared']} of {screening['pairs']} pairs of mode and stiffness; largest total effect among them "
        f"{largest:.1g} % by Sobol, {screening['cleared_wrongly']} above the threshold with its interval"
    )
    gsa, solves, study = summary["gsa"], summary["multistart"], summary["study"]
    lines.append(
        f"{gsa['analyses']} sensitivity analyses at N = {gsa['n']} in {gsa['seconds']:.1f} s, {solves['solves']} "
        f"bounded solves in {solves['seconds']:.1f} s ({solves['failed']} failed), whole study in "
        f"{study['seconds']:.1f} s, compiled before "
        f"(paper: {sum(study['paper_seconds_on_40_cores'].values()) / 60:.0f} min on 40 cores)"
    )
    return "\n".join(lines)


def _screened(case: Case) -> dict[str, Any]:
    """What derivatives clear before the Sobol study: pairs of a mode's MACXP and a stiffness."""
    cleared = ~case.screening.matters()[:, case.guided.runs.stiffness]
    sensitivity, stiffness = case.guided.sensitivity, case.guided.runs.stiffness
    total = sensitivity.total(SHAPE)[:, stiffness]
    certain = total - sensitivity.half_width(SHAPE)[:, stiffness] > case.screening.threshold
    return {
        "samples": int(case.screening.measures.n),
        "seconds": case.screening_seconds,
        "pairs": int(cleared.size),
        "cleared": int(cleared.sum()),
        "threshold": case.screening.threshold,
        "below_by_sobol": int(np.sum(total <= case.screening.threshold)),
        "largest_total_effect_cleared": float(np.max(total[cleared], initial=0.0)),
        # Sobol indices are estimates themselves: cleared wrongly is what they put above with all of their interval.
        "cleared_wrongly": int(np.sum(cleared & certain)),
        "left_out_of_all": list(case.screening.left_out),
    }


def _by_truth(one: Repeat) -> dict[str, Any]:
    stiffness, damping = 100 * np.abs(one.deviation.stiffness), 100 * np.abs(one.deviation.damping)
    fit = one.deviation.identification.fit
    return {
        "seed": one.seed,
        "stiffness_worst_percent": float(stiffness.max()),
        "stiffness_median_percent": float(np.median(stiffness)),
        "damping_worst_percent": float(damping.max()),
        "damping_median_percent": float(np.median(damping)),
        "validation": {
            "macxp_worst": one.validation.macxp.worst,
            "frac_worst": one.validation.frac.worst,
            "frac_mean": one.validation.frac.mean,
        },
        "steps": int(fit.steps),
        "stop": fit.stop,
        "cost": float(fit.cost),
        "unpaired": len(one.deviation.identification.unpaired),
    }


def _selected(case: Case, name: str) -> dict[str, Any]:
    deviation = deviations(case.machines[name], case.truth)
    found: dict[str, Any] = {"error_percent": deviation}
    for kind, names in (("stiffness", STIFFNESSES), ("damping", DAMPINGS)):
        sizes = {name: abs(deviation[name]) for name in names}
        worst = max(sizes, key=lambda name: sizes[name])
        found |= {
            f"{kind}_median": float(np.median(list(sizes.values()))),
            f"{kind}_worst": sizes[worst],
            f"{kind}_worst_name": worst,
        }
    return found


def _problems(case: Case) -> dict[str, dict[str, str]]:
    """Which reference mode each stiffness comes from, by rule."""
    names = {q.path: q.name for q in UNKNOWN}
    return {
        rule: {
            names[path]: by.selection.runs.problems[number] if number >= 0 else "none"
            for path, number in zip(by.selection.runs.paths, by.selection.problem, strict=True)
        }
        for rule, by in (("published", case.guided.chosen), ("robust", case.robust))
    }


def _table(table: ConformityStatistics) -> dict[str, Any]:
    return {**table.to_dict(), "unpaired": table.unpaired}
