"""What the rack-and-pinion section leaves behind: ratios with their goals, a table, plain numbers."""

from dataclasses import asdict, dataclass
from typing import Any

from tests.benchmarks.rack_case import PARAMETERS, TIMES
from tests.benchmarks.rack_peers import RTOL
from tests.benchmarks.rack_pinion import (
    CVODES,
    CVODES_COMPILED,
    LOOP,
    ODEINT,
    SCIPY,
    SUBSTEPS,
    TWIN,
    VARIANTS,
    WIDTH,
    Row,
)
from tests.benchmarks.rack_twin import work_per_evaluation
from tests.benchmarks.summary import SummaryRow, ratio_row


@dataclass(frozen=True)
class Goal:
    """A ratio that the twin is built for."""

    name: str
    ratio: float
    least: float | None
    """The ratio aimed for; None where there is none."""
    peer: Row
    """The fastest accurate entrant of the peer."""
    twin: Row
    """That of the twin."""

    @property
    def verdict(self) -> str:
        """Whether it is reached."""
        return "" if self.least is None else ("hit" if self.ratio >= self.least else "miss")


def goals(rows: list[Row]) -> list[Goal]:
    """Peer over twin, by the fastest accurate entrants.

    Args:
        rows: as `all_rows` returns them.
    """
    cores = max(row.cores for row in rows)
    wanted = [
        ("single run", CVODES, 1, 1, 0.5),
        ("single run", CVODES_COMPILED, 1, 1, None),
        ("single run", SCIPY, 1, 1, None),
        ("single run", ODEINT, 1, 1, None),
        ("variants", CVODES, 1, 1, 5.0),
        ("variants", CVODES_COMPILED, 1, 1, None),
        ("variants", SCIPY, 1, 1, 50.0),
        ("variants", ODEINT, 1, 1, None),
        ("variants", LOOP, 1, 1, 1.0),
        ("variants", CVODES, 1, cores, None),
        ("variants", SCIPY, 1, cores, None),
        ("variants", LOOP, cores, cores, 1.0),
        ("Jacobian", CVODES, 1, 1, 10.0),
        ("Jacobian", CVODES_COMPILED, 1, 1, None),
    ]
    found = []
    for section, role, theirs, ours, least in wanted:
        peer, twin = _best(rows, section, role, theirs), _best(rows, section, TWIN, ours)
        if peer and twin:
            name = (
                f"{section}: {role} on {theirs} / twin on {ours}"
                if section == "variants"
                else f"{section}: {role} / twin"
            )
            found.append(Goal(name, peer.each / twin.each, least, peer, twin))
    return found


def _best(rows: list[Row], section: str, role: str, cores: int) -> Row | None:
    fitting = [r for r in rows if (r.section, r.role, r.cores) == (section, role, cores) and r.accurate]
    return min(fitting, key=lambda row: row.each, default=None)


def summary_rows(rows: list[Row]) -> list[SummaryRow]:
    """The ratios for the summary; arguments as of `goals`."""
    found = []
    for goal in goals(rows):
        theirs, ours = ([t / row.variants for t in row.spread.turns] for row in (goal.peer, goal.twin))
        told = f"twin to {goal.twin.error:.0e}, peer to {goal.peer.error:.0e}"
        found.append(ratio_row(f"rack and pinion, {goal.name}", goal.peer.name, theirs, ours, told, least=goal.least))
    return found


def as_markdown(rows: list[Row]) -> str:
    """The report's section."""
    lines = [
        "## Rack-and-pinion drive",
        "",
        f"The drive of Leipe et al. under its preload cascade, {TIMES[-1]:g} s, {TIMES.size} saved times; {VARIANTS} "
        f"variants, of which the twin runs {WIDTH} in step; the Jacobian of both torques over {PARAMETERS} "
        f"parameters. Tolerances of the peers are {RTOL:g}. Ratios of medians, of the fastest accurate entrants:",
        "",
    ]
    for goal in goals(rows):
        aim = "" if goal.least is None else f" (goal {goal.least:g}: {goal.verdict})"
        lines.append(f"- {goal.name}: {goal.ratio:.3g}{aim}")
    lines += ["", *_limits(rows)]
    if not any(row.role == LOOP for row in rows):
        lines.append("- C loop: left out, no C compiler was found")
    for section in dict.fromkeys(row.section for row in rows):
        lines += [
            "",
            f"| {section} | median per run [ms] | shortest | calls of | build and compile [s] | error [-] "
            "| position error [m] |",
            "|---|---|---|---|---|---|---|",
        ]
        lines += [_line(row) for row in rows if row.section == section]
    return "\n".join(lines) + "\n"


def _limits(rows: list[Row]) -> list[str]:
    """What bounds the speed, in words and in operations per second."""
    work = work_per_evaluation(WIDTH)
    lines = [
        f"The vector field is {work.flops:.0f} operations and {work.read_and_written:.0f} bytes of cache each time, "
        "a step of Bosh3 three evaluations: by the compiler's `cost_analysis` of the vector field compiled alone.",
    ]
    for row in rows:
        evaluations = (3 * SUBSTEPS + 1) * (TIMES.size - 1)
        if row.name.startswith(f"twin, Bosh3, {SUBSTEPS} steps") and row.section == "variants":
            lines.append(f"{row.name}: {1e-9 * work.flops * evaluations / row.each:.2g} GFlop/s.")
    lines.append(
        "Logarithms are vector arithmetic; what is left of an evaluation is, by its operations, mostly some 24 roots "
        "and 19 quotients. Error control would need half the evaluations, but variants wait for each other and each "
        "evaluates the reference at its own times. Within diffrax a single run is bound by what surrounds the "
        "evaluations. The Jacobian is bound by the arithmetic of the directions."
    )
    return lines


def _line(row: Row) -> str:
    poor = "" if row.accurate else " not accurate enough"
    shortest = 1e3 * row.spread.min / row.variants
    position = "" if row.position_error is None else f"{row.position_error:.1e}"
    times = f"{1e3 * row.each:.4g} | {shortest:.4g} | {row.spread.calls} x {row.variants}"
    return f"| {row.name} | {times} | {row.compile:.1f} | {row.error:.1e}{poor} | {position} |"


def as_dictionary(rows: list[Row]) -> dict[str, Any]:
    """The same as plain numbers and names, times in seconds."""
    return {
        "goals": [
            {
                "name": g.name,
                "ratio": g.ratio,
                "least": g.least,
                "verdict": g.verdict,
                "entrants": [g.peer.name, g.twin.name],
            }
            for g in goals(rows)
        ],
        "rows": [asdict(row) for row in rows],
    }
