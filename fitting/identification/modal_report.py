"""A modal analysis of a file of measured responses, written down: a report, tables, shapes and pictures."""

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fitting.identification.modal_analysis import modal_analysis
from fitting.identification.modal_pictures import write_pictures
from fitting.identification.modal_tables import summarise, write_modes_csv, write_modes_toml, write_shapes
from fitting.json_file import write_json
from fitting.provenance import checksum, versions
from fitting.report.measured_modes import measured_modes_report
from fitting.report.page import write_report
from twin.frf import FRF
from twin.io.frf_uff import read_frf_uff, read_largest_frf_uff


def analyse_file(
    path: str | os.PathLike[str] | FRF,
    out: Path,
    *,
    band: tuple[float, float] | None = None,
    order: int | None = None,
    modes: int | Sequence[float] | None = None,
    outputs: tuple[str, ...] | None = None,
    inputs: tuple[str, ...] | None = None,
    form: str | None = None,
    damping: str = "viscous",
    reciprocal: bool | None = None,
) -> tuple[str, dict[str, Any]]:
    """Modes from a file of measured frequency responses, written into a folder.

    Writes `report.html`, `summary.json`, `modes.toml`, `modes.csv`, `shapes.csv`, `shapes.uff` (where rows are named by
    node and direction), `stabilisation.png`, `responses.png`, `shapes.png`, and `mac.png` (where there are as many
    points as modes). Where responses of a file are missing, the largest whole grid is used.

    Args:
        path: universal file with datasets 58, or responses read by other means.
        out: folder; made if it does not exist.
        band: lowest and highest frequency used [Hz]; all if not given.
        order: highest order, as in `modal_analysis`.
        modes: how many modes, or about which frequencies [Hz]; found by itself if not given.
        outputs: responses used; all of the file if not given.
        inputs: excitations used; all of the file if not given.
        form: receptance, mobility or accelerance, where the responses do not say it themselves.
        damping: "viscous" or "hysteretic".
        reciprocal: whether excitations and responses are swapped, as in `modal_analysis`.

    Returns:
        Table for the reader, and a summary that JSON can hold.

    Raises:
        InputError: a file that cannot be used, whatever `modal_analysis` refuses.
    """
    gaps: list[str] = []
    component, sums = "", {}
    if isinstance(path, FRF):
        frf, source = path, "responses given"
    else:
        source = Path(path).name
        if outputs is None and inputs is None:
            frf, gaps, component = read_largest_frf_uff(path)
        else:
            frf = read_frf_uff(path, outputs=outputs, inputs=inputs)
        sums = {"responses": checksum(Path(path))}
    analysis = modal_analysis(
        frf, band=band, order=order, modes=modes, form=form, damping=damping, reciprocal=reciprocal
    )
    analysis = dataclasses.replace(analysis, warnings=(*gaps, *analysis.warnings))
    out.mkdir(parents=True, exist_ok=True)
    asked = {
        "band": None if band is None else list(band),
        "order": order,
        "modes": modes if modes is None or isinstance(modes, int) else list(modes),
        "damping": damping,
    }
    summary = {"command": "modes", **summarise(analysis, source), "asked": asked, "versions": versions(), "data": sums}
    write_json(out / "summary.json", summary)
    write_modes_toml(analysis, summary, out / "modes.toml")
    write_modes_csv(analysis, out / "modes.csv")
    write_shapes(analysis, out, source, component)
    write_pictures(analysis, out)
    report = write_report(out / "report.html", measured_modes_report(analysis, summary))
    return f"Modes of {source}\n{analysis!r}\nReport: {report}", summary
