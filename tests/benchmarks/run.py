"""Run all benchmarks: `python -m tests.benchmarks.run --out DIR`.

Writes `benchmarks.json` and `benchmarks.md` into the folder and prints the latter. Needs CasADi and pyswarms, which
come with the `bench` extra. Takes some minutes on two cores; `--short` leaves out the whole record, `--sections`
chooses.
"""

import argparse
import json
from pathlib import Path

import jax

from twin._loop_option import make_small_loops_one_function

SECTIONS = ("simulation", "rack_pinion", "programmes", "multistart", "swarm", "machine", "first_use")


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description="The twin against SciPy, SALib and CasADi, as ratios in one run.")
    parser.add_argument("--out", type=Path, required=True, help="folder for benchmarks.json and benchmarks.md")
    parser.add_argument("--ticks", type=int, default=2000, help="length of the stretch on which all entrants run")
    parser.add_argument("--rounds", type=int, default=2, help="turns of timing")
    parser.add_argument("--short", action="store_true", help="leave out the whole record")
    parser.add_argument("--sections", nargs="+", choices=SECTIONS, default=SECTIONS, help="what to run")
    parser.add_argument("--starts", type=int, default=1000, help="starts of the nonlinear programmes")
    options = parser.parse_args()

    # As the command line does; before the first array is made.
    make_small_loops_one_function()
    jax.config.update("jax_enable_x64", True)
    # Imported late: these modules make arrays.
    from tests.benchmarks import first_use, machine_report, multistart, programmes, rack_pinion, rack_report, swarm
    from tests.benchmarks.emps_case import dahl_case, rigid_case
    from tests.benchmarks.emps_simulation import compare, compare_best
    from tests.benchmarks.machine import machine_benchmark
    from tests.benchmarks.report import as_dictionary, as_markdown, machine

    comparisons = []
    text, results = "", {}
    if "simulation" in options.sections:
        rigid = rigid_case()
        stretch = compare(rigid.first(options.ticks), rounds=options.rounds)
        comparisons = [stretch, compare(dahl_case().first(options.ticks), rounds=options.rounds)]
        if not options.short:
            comparisons.insert(0, compare_best(rigid, stretch, rounds=options.rounds))
        results["emps_simulation"] = [as_dictionary(c) for c in comparisons]
    if "rack_pinion" in options.sections:
        drives = rack_pinion.all_rows(options.rounds)
        text += rack_report.as_markdown(drives) + "\n"
        results["rack_pinion"] = rack_report.as_dictionary(drives)
    if "programmes" in options.sections:
        found = programmes.counts()
        speeds = programmes.throughputs(options.starts, options.rounds)
        text += programmes.as_markdown(found, speeds) + "\n"
        results["nonlinear_programmes"] = programmes.as_dictionary(found, speeds)

    if "multistart" in options.sections:
        rows = multistart.all_cases()
        text += multistart.as_markdown(rows) + "\n"
        results["multistart"] = multistart.as_dictionary(rows)
    if "swarm" in options.sections:
        ledger = swarm.swarm_ledger()
        text += swarm.as_markdown(ledger) + "\n"
        results["swarm"] = swarm.as_dictionary(ledger)
    if "machine" in options.sections:
        found = machine_benchmark()
        text += machine_report.as_markdown(found) + "\n"
        results["machine"] = machine_report.as_dictionary(found)
    if "first_use" in options.sections:
        first = first_use.first_use()
        text += first_use.as_markdown(first) + "\n"
        results["first_use"] = first_use.as_dictionary(first)

    about = machine()
    text = as_markdown(comparisons, about).replace("## Machine", text + "## Machine")
    print(text)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "benchmarks.md").write_text(text, encoding="utf-8")
    (options.out / "benchmarks.json").write_text(json.dumps({"machine": about, **results}, indent=2), encoding="utf-8")


if __name__ == "__main__":
    main()
