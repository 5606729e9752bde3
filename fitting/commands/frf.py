"""`drivetwin frf`."""

import argparse

from fitting.commands._outcome import Outcome
from fitting.commands._study_run import add_study, run_study

HELP = "frequency response of a study's model, beside measured ones"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_study(parser, "frf")


def run(options: argparse.Namespace) -> Outcome:
    """Run the study."""
    from fitting.study.frf_run import run_frf

    return run_study(options, run_frf)
