"""`drivetwin modes`."""

import argparse
from pathlib import Path

from fitting.commands._out_folder import add_out, close_folder, open_folder
from fitting.commands._outcome import Outcome

HELP = "modes: of a study's model, or measured ones from frequency responses (a universal file)"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "file",
        type=Path,
        metavar="FILE",
        help="study file (.toml), folder of a fit, or frequency responses such as a universal file",
    )
    parser.add_argument("--band", nargs=2, type=float, metavar=("LOW", "HIGH"), help="frequencies to look at [Hz]")
    parser.add_argument(
        "--as-measured",
        action="store_true",
        help="do not turn a test with a roving hammer around: otherwise, where there are more excitations than "
        "responses, shapes are by reciprocity those of the points that were hit",
    )
    add_out(parser, "out/modes")


def run(options: argparse.Namespace) -> Outcome:
    """Modes of a model, or measured ones."""
    fitted = options.file / "fitted.toml"
    if fitted.is_file():
        options.file = fitted
    if options.file.suffix.lower() == ".toml":
        from fitting.commands._study_run import run_study
        from fitting.study.modes_run import run_modes
        from twin._input_error import InputError

        if options.band:
            raise InputError("--band is for measured responses; the modes of a study's model are all given.")
        options.study = options.file
        return run_study(options, run_modes)
    from fitting.identification.modal_report import analyse_file
    from twin.io._files import existing_file

    existing_file(options.file, "file of frequency responses")
    folder = open_folder(options.out, force=options.force)
    text, summary = analyse_file(
        options.file,
        folder,
        band=tuple(options.band) if options.band else None,
        reciprocal=False if options.as_measured else None,
    )
    close_folder(folder)
    return Outcome(text, summary)
