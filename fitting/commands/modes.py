"""`drivetwin modes`."""

import argparse
import sys
from pathlib import Path

from fitting.commands._out_folder import add_out, close_folder, open_folder
from fitting.commands._outcome import Outcome

HELP = "modes: of a study's model, or measured ones from frequency responses (a universal file)"


# Options that only measured responses have.
_MEASURED = ("band", "order", "modes", "as_measured")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "file",
        type=Path,
        metavar="FILE",
        help="study file (.toml), folder of a fit, or frequency responses such as a universal file",
    )
    measured = parser.add_argument_group("of measured responses, whose modes get standard errors and 95 % intervals")
    measured.add_argument("--band", nargs=2, type=float, metavar=("LOW", "HIGH"), help="frequencies to look at [Hz]")
    measured.add_argument("--order", type=int, metavar="N", help="highest order of the polynomials (30)")
    measured.add_argument(
        "--modes",
        nargs="+",
        metavar="F|N",
        help="about which frequencies modes are [Hz], or how many there are (one whole number; write 500.0 for a mode "
        "near 500 Hz); otherwise they are found",
    )
    measured.add_argument(
        "--as-measured",
        action="store_true",
        help="do not turn a test with a roving hammer around: otherwise, where there are more excitations than "
        "responses, shapes are by reciprocity those of the points that were hit",
    )
    add_out(parser, "out/modes")


def run(options: argparse.Namespace) -> Outcome:
    """Modes of a model, or measured ones."""
    from twin._input_error import InputError

    fitted = options.file / "fitted.toml"
    if fitted.is_file():
        options.file = fitted
    if options.file.suffix.lower() == ".toml":
        from fitting.commands._study_run import run_study
        from fitting.study.modes_run import run_modes

        for name in _MEASURED:
            if getattr(options, name):
                raise InputError(
                    f"--{name.replace('_', '-')} is for measured responses; the modes of a study's model are all given."
                )
        options.study = options.file
        return run_study(options, run_modes)
    from fitting.identification.modal_report import analyse_file
    from twin.io._files import existing_file

    modes = None if options.modes is None else _wanted(options.modes)
    existing_file(options.file, "file of frequency responses")
    folder = open_folder(options.out, force=options.force)
    print(f"drivetwin: looking for modes in {options.file.name}; many responses take minutes.", file=sys.stderr)
    text, summary = analyse_file(
        options.file,
        folder,
        band=tuple(options.band) if options.band else None,
        order=options.order,
        modes=modes,
        reciprocal=False if options.as_measured else None,
    )
    close_folder(folder)
    return Outcome(text, summary)


def _wanted(words: list[str]) -> int | list[float]:
    """How many modes, or about which frequencies."""
    from twin._input_error import InputError

    if len(words) == 1 and words[0].isdecimal():
        return int(words[0])
    try:
        return [float(word) for word in words]
    except ValueError as error:
        raise InputError(
            f"--modes {' '.join(words)} is neither frequencies [Hz] nor a number of modes. Write, for instance, "
            "--modes 143.7 287.2, or --modes 5."
        ) from error
