"""`drivetwin demo`."""

import argparse

from fitting.commands._out_folder import add_out, close_folder, open_folder
from fitting.commands._outcome import Outcome

HELP = "identify a simulated drive from its noisy records: the main job, without any data"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_out(parser, "out/demo")


def run(options: argparse.Namespace) -> Outcome:
    """Run the demo."""
    from fitting.rack_pinion_demo import run_demo

    folder = open_folder(options.out, force=options.force)
    text = run_demo(folder)
    close_folder(folder)
    return Outcome(text)
