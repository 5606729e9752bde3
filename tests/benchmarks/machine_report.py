"""What the section on machines leaves behind: the study beside the peers, its times judged, growth."""

from typing import Any

from tests.benchmarks import machine_growth
from tests.benchmarks.machine import AS_GOOD, SENSITIVITY, SOLVES, MachineBenchmark, Study
from tests.benchmarks.summary import SummaryRow, ratio_row, refused_row

PAPER = 132 * 60.0
"""Time that Ellinger and Zaeh give for their study on 40 cores [s]."""
ALIKE = 1e-7
"""Difference of MACXP up to which the peers solve the same problems [-]."""
TIMES = {"whole study": (180.0, 90.0), SOLVES: (60.0, 10.0)}
"""Time at most, and aimed for, on two cores [s]."""


def summary_rows(found: MachineBenchmark) -> list[SummaryRow]:
    """The ratios for the summary."""
    study, peers = found.study, found.peers
    agreement = f"MACXP to {peers.difference:.0e}"
    tools = {SENSITIVITY: "SALib, SciPy eigh", SOLVES: "SciPy SLSQP, differences"}
    rows = []
    for step, theirs in peers.scaled(study).items():
        what, peer = f"machine study, {step}", f"{tools[step]}, {peers.processes} processes, scaled from a part"
        if peers.difference > ALIKE:
            rows.append(refused_row(what, peer, f"{agreement}, limit {ALIKE:.0e}"))
        else:
            solved = (
                f"; {100 * peers.as_good:.0f} % of theirs as good as ours, {100 * peers.ours_as_good:.0f} % vice versa"
            )
            told = agreement + (solved if step == SOLVES else "")
            rows.append(ratio_row(what, peer, [theirs], [study.seconds[step]], told))
    for name, (seconds, _, aim) in _judged(study).items():
        row = ratio_row(f"machine study, {name}, time", f"goal of {aim:g} s", [seconds], [aim], "a price", most=1.0)
        rows.append(row)
    paper = "the paper's, 40 cores, as printed"
    rows.append(ratio_row("machine study, whole study", paper, [PAPER], [study.total], "another machine; not run here"))
    return rows


def as_markdown(found: MachineBenchmark) -> str:
    """Tables of the study beside the peers, and of growth."""
    study, peers, growth = found
    scaled = peers.scaled(study)
    lines = [
        "## The study of a machine, after Ellinger and Zaeh",
        "",
        f"{2 * len(study.runs.problems)} analyses over {len(study.problem.space)} parameters at N = {study.n}, "
        f"{study.runs.macxp.size} bounded solves, {int(study.runs.failed.sum())} of them failed; the joint fit ends "
        f"within {study.deviation:.1e} of the true values. Load of the computer at the start: {study.load:.1f}.",
        "",
        "| step | compiling call [s] | after it [s] | peers, scaled [s] | peers / twin |",
        "|---|---|---|---|---|",
    ]
    for step, seconds in study.seconds.items():
        theirs = f"{scaled[step]:.0f} | {scaled[step] / seconds:.1f}" if step in scaled else " | "
        lines.append(f"| {step} | {study.first[step]:.2f} | {seconds:.2f} | {theirs} |")
    both = sum(study.seconds[step] for step in scaled)
    lines += [
        f"| whole study | {sum(study.first.values()):.2f} | {study.total:.2f} | | |",
        f"| both long steps | | {both:.2f} | {sum(scaled.values()):.0f} | {sum(scaled.values()) / both:.1f} |",
        "",
        *(
            f"- {name}: {seconds:.1f} s, at most {most:.0f} s {_verdict(seconds, most)}, aim {aim:.0f} s "
            f"{_verdict(seconds, aim)}"
            for name, (seconds, most, aim) in _judged(study).items()
        ),
        f"- Peers: SALib, SciPy `eigh` and SciPy SLSQP by finite differences, {peers.processes} processes. Measured "
        f"and scaled to the whole: {peers.samples} samples at {1e3 * peers.sample_seconds:.2f} ms, SALib's analyses at "
        f"{peers.analysis_seconds:.2f} s per output, {peers.solves} solves at {1e3 * peers.solve_seconds:.0f} ms with "
        f"{peers.eigenproblems:.0f} eigenproblems each.",
        f"- Their MACXP of the samples differ from ours by {peers.difference:.1e} at most. From the same starts, "
        f"{100 * peers.as_good:.0f} % of their solves end as well as ours and {100 * peers.ours_as_good:.0f} % of ours "
        f"as well as theirs (1 - MACXP to {AS_GOOD:.0e}).",
        "",
    ]
    return "\n".join(lines) + "\n" + machine_growth.as_markdown(growth)


def _judged(study: Study) -> dict[str, tuple[float, float, float]]:
    taken = {"whole study": study.total, SOLVES: study.seconds[SOLVES]}
    return {name: (taken[name], *times) for name, times in TIMES.items()}


def _verdict(seconds: float, limit: float) -> str:
    return "hit" if seconds <= limit else "miss"


def as_dictionary(found: MachineBenchmark) -> dict[str, Any]:
    """The section for `benchmarks.json`, times in seconds."""
    study, peers, growth = found
    return {
        "parameters": len(study.problem.space),
        "n": study.n,
        "analyses": 2 * len(study.runs.problems),
        "solves": study.runs.macxp.size,
        "failed": int(study.runs.failed.sum()),
        "deviation": study.deviation,
        "load": study.load,
        "seconds": {**study.seconds, "total": study.total},
        "compiling_seconds": study.first,
        "peers": {**peers._asdict(), "scaled_seconds": peers.scaled(study)},
        "growth": machine_growth.as_dictionary(growth),
    }
