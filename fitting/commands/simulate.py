"""`drivetwin simulate`."""

import argparse

from fitting.commands._outcome import Outcome
from fitting.commands._study_run import add_study, run_study

HELP = "what a study's model does over time"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_study(parser, "simulate")


def run(options: argparse.Namespace) -> Outcome:
    """Run the study."""
    from fitting.study.simulate_run import run_simulate

    return run_study(options, run_simulate)
