"""`drivetwin export`."""

import argparse
from pathlib import Path

from fitting.commands._out_folder import add_json
from fitting.commands._outcome import Outcome

HELP = "write a study's model for other tools: an FMU, or a compiled step"
_FORMATS = ("fmu2", "fmu3", "step")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("study", type=Path, metavar="STUDY.toml", help="study file, such as fitted.toml of a fit")
    parser.add_argument("--to", choices=_FORMATS, default="fmu3", help="FMI 2 or 3 for co-simulation, or jax.export")
    parser.add_argument("--period", metavar="TIME", help='step of a drive without a sampled loop, such as "0.1 ms"')
    parser.add_argument("--out", type=Path, metavar="FILE", help="file to write (named as the study)")
    parser.add_argument("--force", action="store_true", help="replace a file of that name")
    add_json(parser)


def run(options: argparse.Namespace) -> Outcome:
    """Write the file."""
    from fitting.study.study_file import read_study
    from twin._input_error import InputError
    from twin.control import SampledLoop
    from twin.export import export_step, write_fmu
    from twin.io.quantity import parse_quantity

    study = read_study(options.study)
    file = options.out or options.study.with_suffix(".step" if options.to == "step" else ".fmu")
    if file.exists() and not options.force:
        raise InputError(f"{str(file)!r} exists. Name another file by --out, or add --force to replace it.")
    sampled = isinstance(study.model, SampledLoop)
    if options.period is None and not sampled:
        raise InputError(f'--period is missing: {type(study.model).__name__} has no step of its own. Give "0.1 ms".')
    period = None if options.period is None else parse_quantity(options.period, ("s",), name="--period").value
    if options.to == "step":
        export_step(file, study.model, period=period, stepping=study.stepping)
    else:
        version = {"fmu2": "2.0", "fmu3": "3.0"}[options.to]
        write_fmu(file, study.model, period=period, stepping=study.stepping, version=version, description=study.title)
    size = file.stat().st_size
    return Outcome(f"{file} written, {size / 1000:.0f} kB.", {"file": str(file), "format": options.to, "bytes": size})
