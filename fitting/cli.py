"""The command `drivetwin`."""

import argparse
import importlib
import os
import pkgutil
import sys
import traceback
from collections.abc import Sequence

from fitting import commands
from fitting.commands._outcome import Outcome
from twin._input_error import InputError
from twin._loop_option import make_small_loops_one_function


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: command line without the program's name; the process's own if not given.

    Returns:
        The exit code: 0 done, 1 done with a result that must not be trusted, 2 input that cannot be used, 3 a study
        that was interrupted and goes on with the same command, 4 an error of drivetwin itself, 130 stopped by Ctrl-C.
    """
    options = _parser().parse_args(arguments)
    make_small_loops_one_function()
    os.environ.setdefault("MPLBACKEND", "Agg")  # pictures go to files, also where there is no screen
    # Packages never change JAX's configuration; the program that uses them does.
    import jax

    from twin.compile_cache import use_compile_cache

    jax.config.update("jax_enable_x64", True)
    use_compile_cache()
    from twin.batch import StudyInterrupted

    try:
        outcome = options.run(options)
        print(_as_json(outcome) if options.json else outcome.text)
    except BrokenPipeError:  # whoever reads has had enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (InputError, OSError) as error:
        return _told(str(error), 2)
    except StudyInterrupted as error:
        return _told(str(error), 3)
    except KeyboardInterrupt:
        return _told(
            "stopped by Ctrl-C; what a study had stored is kept, and the same command goes on from there.", 130
        )
    except Exception:  # the program's own fault, which must not pass for a result
        traceback.print_exc()
        return _told("this is an error of drivetwin itself. Please report it with the lines above.", 4)
    else:
        return outcome.code
    return 0


def _as_json(outcome: Outcome) -> str:
    from fitting.json_file import as_json

    return as_json({"text": outcome.text} if outcome.summary is None else outcome.summary)


def _told(message: str, code: int) -> int:
    print(f"drivetwin: {message}", file=sys.stderr)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="drivetwin",
        description="Differentiable twins of feed drives: measurements in, parameters with error bars out.",
    )
    offered = parser.add_subparsers(required=True, metavar="COMMAND")
    for found in sorted(pkgutil.iter_modules(commands.__path__), key=lambda module: module.name):
        if found.name.startswith("_"):
            continue
        command = importlib.import_module(f"{commands.__name__}.{found.name}")
        one = offered.add_parser(found.name.replace("_", "-"), help=command.HELP, description=command.HELP)
        command.add_arguments(one)
        one.set_defaults(run=command.run, json=False)
    return parser
