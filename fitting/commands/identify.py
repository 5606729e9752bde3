"""`drivetwin identify`."""

import argparse

from fitting.commands._outcome import Outcome
from fitting.commands._study_run import add_study, run_study

HELP = "parameters by a named procedure that needs no start, such as inverse_dynamics, two_mass or friction_curve"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_study(parser, "identify")


def run(options: argparse.Namespace) -> Outcome:
    """Run the study."""
    from fitting.study.identify_run import run_identify

    return run_study(options, run_identify)
