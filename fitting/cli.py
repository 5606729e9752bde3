"""The command `drivetwin`."""

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from twin._input_error import InputError
from twin._loop_option import make_small_loops_one_function


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: command line without the program's name; the process's own if not given.

    Returns:
        The exit code: 0 done, 2 input that cannot be used, 3 a study that was interrupted and goes on with the same
        command, 130 stopped by Ctrl-C.
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
        if not options.reads:
            options.out.mkdir(parents=True, exist_ok=True)
        print(options.run(options.out))
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
    return 0


def _told(message: str, code: int) -> int:
    print(f"drivetwin: {message}", file=sys.stderr)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="drivetwin",
        description="Differentiable twins of feed drives: measurements in, parameters with error bars out.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    demo = commands.add_parser("demo", help="identify a simulated servo axis from noisy records")
    _add_run(demo, _demo, "out/demo")
    reproduce = commands.add_parser("reproduce", help="repeat a published study, on measured data where there are any")
    studies = reproduce.add_subparsers(required=True, metavar="STUDY")
    emps = studies.add_parser("emps", help="EMPS ball-screw axis: inverse dynamics and output error")
    _add_run(emps, _emps, "out/emps")
    bench = studies.add_parser("two-inertia", help="two-inertia bench: two-mass drive from its frequency response")
    _add_run(bench, _two_inertia, "out/two-inertia")
    leipe = studies.add_parser("leipe", help="preloaded rack-and-pinion drive: load-dependent stiffness and damping")
    _add_run(leipe, _leipe, "out/leipe")
    mauro = studies.add_parser("mauro", help="ball-screw axis: modes, Table 1 by a fitted twin, gains by gradients")
    _add_run(mauro, _mauro, "out/mauro")
    ellinger = studies.add_parser("ellinger", help="whole machine: sensitivities, 6,000 small problems, joint fit")
    _add_run(ellinger, _ellinger, "out/ellinger")
    study = commands.add_parser("study", help="look after studies of many samples that are kept in a folder")
    status = study.add_subparsers(required=True, metavar="ACTION").add_parser("status", help="how far a study is")
    status.add_argument("out", type=Path, metavar="DIR", help="folder of the study")
    status.set_defaults(run=_study_status, reads=True)
    return parser


def _add_run(parser: argparse.ArgumentParser, run: Callable[[Path], str], out: str) -> None:
    parser.add_argument(
        "--out", type=Path, default=Path(out), metavar="DIR", help="folder for the results (%(default)s)"
    )
    parser.set_defaults(run=run, reads=False)


# Imported when asked for: the command's help must not wait for JAX and matplotlib.
def _study_status(folder: Path) -> str:
    from twin.study import study_status

    return str(study_status(folder))


def _demo(out: Path) -> str:
    from fitting.demo import run_demo

    return run_demo(out)


def _emps(out: Path) -> str:
    from fitting.identification.emps import reproduce_emps

    return reproduce_emps(out)


def _two_inertia(out: Path) -> str:
    from fitting.identification.two_inertia_report import reproduce_two_inertia

    summary = reproduce_two_inertia(out)
    lines = ["Two-mass drive fitted to record A, in units of the torque constant"]
    for path, estimate in summary["fit"]["parameters"].items():
        lines.append(f"  {path:28} {estimate['value']:12.5g} ± {estimate['standard_error']:.2g} {estimate['unit']}")
    for source in ("model fitted to A, undamped", "record B, regression"):
        pair = summary["frequencies"][source]
        resonance, antiresonance = pair["resonance"]["value"], pair["antiresonance"]["value"]
        lines.append(f"{source}: resonance {resonance:.2f} Hz, antiresonance {antiresonance:.2f} Hz")
    for record, errors in summary["log-magnitude error"].items():
        for name, error in errors.items():
            lines.append(f"log-magnitude error {record}, {name}: median {error['median']:.4f}, rms {error['rms']:.4f}")
    return "\n".join([*lines, f"Results in {out}"])


def _leipe(out: Path) -> str:
    from fitting.identification.leipe_report import reproduce_leipe, tabulate

    return f"{tabulate(reproduce_leipe(out))}\nResults in {out}"


def _mauro(out: Path) -> str:
    from fitting.identification.mauro_report import reproduce_mauro, tabulate

    return f"{tabulate(reproduce_mauro(out))}\nResults in {out}"


def _ellinger(out: Path) -> str:
    from fitting.identification.ellinger_report import reproduce_ellinger
    from fitting.identification.ellinger_summary import text_of

    return f"{text_of(reproduce_ellinger(out))}\nResults in {out}"
