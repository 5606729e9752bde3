"""Run all benchmarks: `python -m tests.benchmarks.run --out DIR`.

Writes `benchmarks.json` and `benchmarks.md` into the folder and prints the latter. Needs CasADi, which comes with the
`bench` extra. Takes some minutes on two cores; `--short` leaves out the whole record.
"""

import argparse
import json
from pathlib import Path

import jax


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description="Speed of the twin against SciPy and CasADi, as ratios in one run.")
    parser.add_argument("--out", type=Path, required=True, help="folder for benchmarks.json and benchmarks.md")
    parser.add_argument("--ticks", type=int, default=2000, help="length of the stretch on which all entrants run")
    parser.add_argument("--rounds", type=int, default=2, help="turns of timing")
    parser.add_argument("--short", action="store_true", help="leave out the whole record")
    options = parser.parse_args()

    jax.config.update("jax_enable_x64", True)
    # Imported late: these modules make arrays.
    from tests.benchmarks.emps_case import dahl_case, rigid_case
    from tests.benchmarks.emps_simulation import compare, compare_best
    from tests.benchmarks.report import as_dictionary, as_markdown, machine

    rigid = rigid_case()
    stretch = compare(rigid.first(options.ticks), rounds=options.rounds)
    comparisons = [stretch, compare(dahl_case().first(options.ticks), rounds=options.rounds)]
    if not options.short:
        comparisons.insert(0, compare_best(rigid, stretch, rounds=options.rounds))

    about = machine()
    text = as_markdown(comparisons, about)
    print(text)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "benchmarks.md").write_text(text, encoding="utf-8")
    results = {"machine": about, "emps_simulation": [as_dictionary(c) for c in comparisons]}
    (options.out / "benchmarks.json").write_text(json.dumps(results, indent=2), encoding="utf-8")


if __name__ == "__main__":
    main()
