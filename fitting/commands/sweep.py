"""`drivetwin sweep`."""

import argparse

from fitting.commands._outcome import Outcome
from fitting.commands._study_run import add_study, run_study

HELP = "numbers of a study's model over a grid of its parameters"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_study(parser, "sweep")


def run(options: argparse.Namespace) -> Outcome:
    """Run the study."""
    from fitting.study.sweep_run import run_sweep

    return run_study(options, run_sweep)
