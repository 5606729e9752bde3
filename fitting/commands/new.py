"""`drivetwin new`."""

import argparse
from pathlib import Path

from fitting.commands._out_folder import add_json
from fitting.commands._outcome import Outcome

HELP = "write a commented study file for a drive to begin with"


# What to try first with the file as it is.
_FIRST = {"rack-pinion": "modes"}
# What to try first with data, where that is no fit.
_FIRST_WITH_DATA = {"current-driven-axis": "identify"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("drive", nargs="?", help="the drive; without it, they are listed")
    parser.add_argument("--out", type=Path, metavar="FILE", help="study file to write (DRIVE.toml)")
    parser.add_argument("--data", type=Path, metavar="FILE", help="measurements whose channels are to be entered")
    parser.add_argument("--force", action="store_true", help="replace a file of that name")
    add_json(parser)


def run(options: argparse.Namespace) -> Outcome:
    """Write the file."""
    from fitting.study.new_study import known_drives, new_study
    from twin._input_error import InputError

    if options.drive is None:
        known = {name: module.HELP for name, module in known_drives().items()}
        lines = ["Drives:", *(f"  {name:14} {told}" for name, told in known.items())]
        return Outcome("\n".join([*lines, "Write a study file by: drivetwin new DRIVE"]), {"drives": known})
    file = options.out or Path(f"{options.drive.replace('_', '-')}.toml")
    text = new_study(options.drive, data=options.data, folder=file.parent)
    if file.exists() and not options.force:
        raise InputError(f"{str(file)!r} exists. Name another file by --out, or add --force to replace it.")
    if not file.parent.is_dir():
        raise InputError(f"the folder of {str(file)!r} does not exist. Create it first.")
    file.write_text(text, encoding="utf-8")
    name = options.drive.replace("_", "-")
    first = _FIRST_WITH_DATA.get(name, "fit") if options.data else _FIRST.get(name, "simulate")
    told = f"{file} written. Adapt it, then for instance: drivetwin {first} {file}"
    return Outcome(told, {"file": str(file)})
