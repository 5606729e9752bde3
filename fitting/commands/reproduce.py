"""`drivetwin reproduce STUDY`: published studies, repeated."""

import argparse
import json
from pathlib import Path

from fitting.commands._out_folder import add_out, close_folder, open_folder
from fitting.commands._outcome import Outcome

HELP = "repeat a published study, on measured data where there are any"
_STUDIES = {
    "emps": "EMPS ball-screw axis: inverse dynamics and output error",
    "two-inertia": "two-inertia bench: two-mass drive from its frequency response",
    "leipe": "preloaded rack-and-pinion drive: load-dependent stiffness and damping",
    "mauro": "ball-screw axis: modes, Table 1 by a fitted twin, gains by gradients",
    "ellinger": "whole machine: sensitivities, 6,000 small problems, joint fit",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    studies = parser.add_subparsers(required=True, metavar="STUDY", dest="name")
    for name, told in _STUDIES.items():
        add_out(studies.add_parser(name, help=told, description=told), f"out/{name}")


def run(options: argparse.Namespace) -> Outcome:
    """Repeat the study."""
    folder = open_folder(options.out, force=options.force)
    text = {"emps": _emps, "two-inertia": _two_inertia, "leipe": _leipe, "mauro": _mauro, "ellinger": _ellinger}[
        options.name
    ](folder)
    close_folder(folder)
    return Outcome(text, json.loads((folder / "summary.json").read_text(encoding="utf-8")))


def _emps(out: Path) -> str:
    from fitting.identification.emps import reproduce_emps

    return reproduce_emps(out)


def _two_inertia(out: Path) -> str:
    from fitting.identification.two_inertia_report import reproduce_two_inertia

    summary = reproduce_two_inertia(out)
    lines = ["Two-mass drive fitted to record A, in units of the torque constant"]
    for path, estimate in summary["fit"]["parameters"].items():
        lines.append(f"  {path:28} {estimate['value']:12.5g} ± {estimate['standard_error']:.2g} {estimate['unit']}")
    for source in ("model fitted to A, undamped", "record B, regression"):
        pair = summary["frequencies"][source]
        resonance, antiresonance = pair["resonance"]["value"], pair["antiresonance"]["value"]
        lines.append(f"{source}: resonance {resonance:.2f} Hz, antiresonance {antiresonance:.2f} Hz")
    for record, errors in summary["log-magnitude error"].items():
        for name, error in errors.items():
            lines.append(f"log-magnitude error {record}, {name}: median {error['median']:.4f}, rms {error['rms']:.4f}")
    return "\n".join([*lines, f"Results in {out}"])


def _leipe(out: Path) -> str:
    from fitting.identification.leipe_report import reproduce_leipe, tabulate

    return f"{tabulate(reproduce_leipe(out))}\nResults in {out}"


def _mauro(out: Path) -> str:
    from fitting.identification.mauro_report import reproduce_mauro, tabulate

    return f"{tabulate(reproduce_mauro(out))}\nResults in {out}"


def _ellinger(out: Path) -> str:
    from fitting.identification.ellinger_report import reproduce_ellinger
    from fitting.identification.ellinger_summary import text_of

    return f"{text_of(reproduce_ellinger(out))}\nResults in {out}"
