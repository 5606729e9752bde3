"""`drivetwin study status`."""

import argparse
from pathlib import Path

from fitting.commands._out_folder import add_json
from fitting.commands._outcome import Outcome

HELP = "look after studies of many samples that are kept in a folder"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    actions = parser.add_subparsers(required=True, metavar="ACTION")
    status = actions.add_parser("status", help="how far a study is")
    add_json(status)
    status.add_argument("folder", type=Path, metavar="DIR", help="folder of the study")


def run(options: argparse.Namespace) -> Outcome:
    """Say how far a study is."""
    from twin.study import study_status

    status = study_status(options.folder)
    return Outcome(str(status), status._asdict())
