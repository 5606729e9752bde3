"""Run all benchmarks: `python -m tests.benchmarks.run --out DIR`.

Writes `benchmarks.json` and `benchmarks.md`, and pictures of the scaling curves, into the folder and prints the table:
a summary of all ratios, then a section each. Needs the peers, which come with the `bench` extra. Takes many minutes on
two cores; `--short` leaves out what takes long, `--sections` chooses.
"""

import argparse
import json
import sys
import time
import traceback
from pathlib import Path

import jax

from tests.benchmarks import sections
from tests.benchmarks.report import machine, write
from twin._loop_option import make_small_loops_one_function


def main() -> None:
    """Run, print, write."""
    # As the command line does; before the first array is made.
    make_small_loops_one_function()
    jax.config.update("jax_enable_x64", True)
    names = sections.names()
    parser = argparse.ArgumentParser(description="The twin against its peers, as ratios in one run.")
    parser.add_argument("--out", type=Path, required=True, help="folder for benchmarks.json, benchmarks.md, pictures")
    parser.add_argument("--ticks", type=int, default=2000, help="length of the stretch on which all entrants run")
    parser.add_argument("--rounds", type=int, default=2, help="turns of timing")
    parser.add_argument("--short", action="store_true", help="leave out the whole record and the large sizes")
    parser.add_argument("--sections", nargs="+", choices=names, default=names, help="what to run")
    parser.add_argument("--starts", type=int, default=1000, help="starts of the nonlinear programmes")
    parser.add_argument("--compare", type=Path, help="benchmarks.json of another machine, for crossover batch sizes")
    given = parser.parse_args()
    earlier = json.loads(given.compare.read_text(encoding="utf-8")) if given.compare else None
    options = sections.Options(given.out, given.rounds, given.ticks, given.starts, given.short, earlier)
    text, left_out = run_all(given.sections, options)
    print(text)
    if left_out:
        raise SystemExit(f"left out, as they failed: {', '.join(left_out)}")


def run_all(names: list[str], options: sections.Options) -> tuple[str, list[str]]:
    """Run sections one after the other; what is there so far is written after each.

    Args:
        names: of the sections.
        options: what was asked for.

    Returns:
        The report, and the sections that are not in it, as they failed.
    """
    options.out.mkdir(parents=True, exist_ok=True)
    about, found, seconds, text, left_out = machine(), {}, {}, "", []
    for name in names:
        begin = time.perf_counter()
        try:
            found[name] = sections.run(name, options)
        except Exception:  # a peer that is missing must not cost the other sections
            traceback.print_exc()
            left_out.append(name)
            continue
        seconds[name] = round(time.perf_counter() - begin, 1)
        print(f"{name}: {seconds[name]:.0f} s", file=sys.stderr, flush=True)
        text = write(options.out, found, {**about, "seconds": seconds})
    return text, left_out


if __name__ == "__main__":
    main()
