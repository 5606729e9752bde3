"""`drivetwin si "1500 rpm"`: a quantity in SI."""

import argparse

from fitting.commands._outcome import Outcome

HELP = "a quantity in SI"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("quantity", help='number with its unit, such as "1500 rpm"')
    parser.add_argument("--json", action="store_true", help="print the summary as JSON, for programs")


def run(options: argparse.Namespace) -> Outcome:
    """Convert it."""
    from twin.io.quantity import parse_quantity  # libraries are imported where they are used: --help stays quick

    found = parse_quantity(options.quantity)
    return Outcome(f"{found.value:.10g} {found.unit}", found._asdict())
