"""One mode after a few springs have changed: Rayleigh-quotient iteration against all modes by `eigh`."""

from tests.benchmarks.modal_update import modal_update
from tests.benchmarks.sections import Options, Section
from tests.benchmarks.summary import as_dictionary


def section(options: Options) -> Section:
    """The small problem of the machine's study, at many points."""
    rows = modal_update()
    lines = ["## One mode after a few springs have changed", ""]
    lines += [f"- {r.what}, {r.peer}: " + (r.met if r.ratio is None else f"{r.ratio:.3g} times slower") for r in rows]
    return Section("\n".join([*lines, ""]), as_dictionary(rows), rows)
