"""What the commands have in common that answer a study file."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from fitting.commands._out_folder import add_out, close_folder, open_folder
from fitting.commands._outcome import Outcome
from fitting.commands._ticking import ticking

if TYPE_CHECKING:
    from fitting.study.study_file import StudyFile


def add_study(parser: argparse.ArgumentParser, name: str) -> None:
    """Give a command its study file and its folder.

    Args:
        parser: its parser.
        name: its name.
    """
    parser.add_argument("study", type=Path, metavar="STUDY.toml", help="study file; `drivetwin new` writes one")
    add_out(parser, f"out/{name}")


def run_study(options: argparse.Namespace, run: "Callable[[StudyFile, Path], Outcome]") -> Outcome:
    """Read the study, open the folder, run.

    Args:
        options: of the command line.
        run: what is to be done.

    Raises:
        InputError: a study or folder that cannot be used; nothing is written before the study is read.
    """
    from fitting.study.study_file import read_study

    study = read_study(options.study)
    folder = open_folder(options.out, force=options.force)
    with ticking(f"{study.title}: compiling and computing"):
        outcome = run(study, folder)
    close_folder(folder)
    return outcome
