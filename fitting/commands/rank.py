"""`drivetwin rank`."""

import argparse

from fitting.commands._outcome import Outcome
from fitting.commands._study_run import add_study, run_study

HELP = "which free parameters of a study matter for which output"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_study(parser, "rank")


def run(options: argparse.Namespace) -> Outcome:
    """Run the study."""
    from fitting.study.rank_run import run_rank

    return run_study(options, run_rank)
