"""`drivetwin fit`."""

import argparse

from fitting.commands._outcome import Outcome
from fitting.commands._study_run import add_study, run_study

HELP = "fit the free parameters of a study to its data, with intervals, controls and a report"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_study(parser, "fit")


def run(options: argparse.Namespace) -> Outcome:
    """Run the study."""
    from fitting.study.fit_run import run_fit

    return run_study(options, run_fit)
