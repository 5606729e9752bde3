"""100,000 variants of a drive as one study: `python -m tests.benchmarks.large_study --out DIR`.

One run that is let alone and one that is killed by SIGKILL again and again, each in a process of its own; then what a
sample that is NaN, one that is a thousand times as stiff and one that raises cost a smaller study. Writes
`large_study.json` and `large_study.md` into the folder, beside the stores. Another call goes on where it was.
"""

import argparse
import itertools
import json
import os
import random
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import jax
import numpy as np

from twin._loop_option import make_small_loops_one_function

_SLICES, _FEWEST = 10, 8
"""Shares of a run over which its rate is taken, and the fewest chunks of one: two come at a time."""
_START = 10.0
"""Within this time a process that is killed early has not computed its first chunk [s]."""


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description="A large study: rate, memory, kills, bad samples.")
    parser.add_argument("--out", type=Path, required=True, help="folder for the stores and the report")
    parser.add_argument("--samples", type=int, default=100_000, help="variants")
    parser.add_argument("--kills", type=int, default=20, help="times that the second run is killed")
    parser.add_argument("--bad-samples", type=int, default=10_000, help="variants of the study with bad samples")
    parser.add_argument("--only", choices=("run", "bad"), help=argparse.SUPPRESS)  # what a process of ours does
    parser.add_argument("--store", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    make_small_loops_one_function()
    jax.config.update("jax_enable_x64", True)
    if options.only == "run":
        print(json.dumps(run(options.store, options.samples)))
    elif options.only == "bad":
        print(json.dumps(bad(options.samples)))
    else:
        found = large_study(options.out, options.samples, options.kills, options.bad_samples)
        text = as_markdown(found)
        (options.out / "large_study.json").write_text(json.dumps(found, indent=2), encoding="utf-8")
        (options.out / "large_study.md").write_text(text, encoding="utf-8")
        print(text)


def large_study(out: Path, samples: int, kills: int, bad_samples: int) -> dict[str, Any]:
    """All three parts, as plain numbers.

    Args:
        out: folder for the stores.
        samples: variants.
        kills: times that the second run is killed.
        bad_samples: variants of the study with bad samples.
    """
    out.mkdir(parents=True, exist_ok=True)
    alone, killed = out / "alone", out / "killed"
    whole = json.loads(_finished(_start(out, "run", samples, alone)))
    times = kill_and_go_on(out, samples, kills, killed, len(list(alone.glob("chunks/*.npz"))))
    resumed = json.loads(_finished(_start(out, "run", samples, killed)))
    return {
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "load_at_end": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "alone": whole,
        "rate_per_second": rates(alone),
        "stored_bytes": sum(file.stat().st_size for file in alone.rglob("*") if file.is_file()),
        "kills": times,
        "resumed": resumed,
        "digests_equal": whole["digest"] == resumed["digest"],
        "peak_memory_of_processes": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024,
        "bad_samples": json.loads(_finished(_start(out, "bad", bad_samples, out))),
    }


def run(store: Path, samples: int) -> dict[str, Any]:
    """The study in this process, or what is left of it."""
    from tests.benchmarks import variant_case

    begin = time.perf_counter()
    found = variant_case.compute(variant_case.samples(samples), store)
    return {
        "digest": found.digest,
        "message": found.message,
        "wall_s": time.perf_counter() - begin,
        "peak_memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "median": {name: np.median(found[name], axis=0).tolist() for name in found.outputs},
    }


def kill_and_go_on(out: Path, samples: int, kills: int, store: Path, chunks: int) -> list[dict[str, Any]]:
    """Start the study again and again, and kill it: every fifth time while it starts, else at a random chunk.

    Args:
        out: folder of the compiled programs.
        samples: variants.
        kills: how many times.
        store: its folder.
        chunks: those of the whole study.
    """
    draw = random.Random(1)
    late = sorted(draw.uniform(0, 0.95 * chunks) for _ in range(kills))
    told = []
    for number in range(kills):
        process = _start(out, "run", samples, store)
        begin, early, after = time.monotonic(), draw.uniform(0.0, _START), draw.uniform(0.0, 1.0)
        if number % 5 == 0:
            time.sleep(early)
        else:
            while process.poll() is None and len(list(store.glob("chunks/*.npz"))) < late[number]:
                time.sleep(0.05)
            time.sleep(after)
        process.kill()
        process.communicate()
        lived = time.monotonic() - begin
        told.append(
            {
                "after_s": lived,
                "chunks": len(list(store.glob("chunks/*.npz"))),
                "unfinished_files": len(list(store.rglob("*.partial"))),
                "running": process.returncode < 0,
            }
        )
    return told


def bad(samples: int) -> dict[str, Any]:
    """What bad samples cost a study, and what they do to the others."""
    from tests.benchmarks import variant_case

    values = variant_case.samples(samples)
    spoiled, numbers = variant_case.with_bad_samples(values)
    # Also the second try and its width are compiled before anything is timed.
    variant_case.compute(variant_case.with_bad_samples(values[:512])[0], progress=False, chunk_size=256)
    seconds, found = [], []
    for given in (values, spoiled):
        begin = time.perf_counter()
        found.append(variant_case.compute(given, progress=False, chunk_size=256))
        seconds.append(time.perf_counter() - begin)
    clean, marked = found
    others = np.ones(samples, dtype=bool)
    others[list(numbers.values())] = False
    return {
        "samples": samples,
        "numbers": numbers,
        "marked": {name: marked.to_dataframe()["status"][number] for name, number in numbers.items()},
        "message": marked.message,
        "others_bitwise_equal": all(np.array_equal(clean[n][others], marked[n][others]) for n in clean.outputs),
        "clean_s": seconds[0],
        "with_bad_samples_s": seconds[1],
        "cost_ratio": seconds[1] / seconds[0],
    }


def rates(store: Path) -> list[float]:
    """Samples in a second in equal shares of the chunks after the first one, by the times at which they were stored."""
    times = np.sort([file.stat().st_mtime for file in store.glob("chunks/*.npz")])
    size = json.loads((store / "manifest.json").read_text(encoding="utf-8"))["chunks"]["size"]
    parts = max(1, min(_SLICES, len(times) // _FEWEST))
    ends = np.linspace(0, len(times) - 1, parts + 1).astype(int)
    return [float(size * (b - a) / (times[b] - times[a])) for a, b in itertools.pairwise(ends)]


def as_markdown(found: dict[str, Any]) -> str:
    """The report."""
    alone, bad_samples, kills = found["alone"], found["bad_samples"], found["kills"]
    shown = " ".join(f"{rate:.0f}" for rate in found["rate_per_second"])
    kept = " ".join(str(kill["chunks"]) for kill in kills)
    lines = [
        "# A large study",
        "",
        "Moves of one second of the preloaded rack and pinion, 20 parameters within 20 %, adaptive steps, rtol 1e-6.",
        "",
        f"- {alone['message']} {alone['wall_s']:.0f} s on {found['cores']} cores, compilation included",
        f"- samples in a second, over time: {shown}",
        f"- peak memory of a process: {found['peak_memory_of_processes'] / 1e6:.0f} MB; "
        f"on the disk: {found['stored_bytes'] / 1e6:.1f} MB",
        f"- killed {sum(kill['running'] for kill in kills)} times, chunks kept then: {kept}; "
        f"files half written: {sum(kill['unfinished_files'] for kill in kills)}",
        f"- digest after the kills equal to that of the run let alone: {'yes' if found['digests_equal'] else 'NO'}",
        f"- with one sample NaN, one 1,000 times as stiff and one that raises, of {bad_samples['samples']:,}: "
        f"{bad_samples['cost_ratio']:.2f} times the time; they are {bad_samples['marked']}; the others are "
        f"{'the same to the bit' if bad_samples['others_bitwise_equal'] else 'CHANGED'}",
    ]
    return "\n".join(lines) + "\n"


def _start(out: Path, part: str, samples: int, store: Path) -> "subprocess.Popen[str]":
    command = [sys.executable, "-m", "tests.benchmarks.large_study", "--only", part, "--out", str(out)]
    cache = {
        "JAX_COMPILATION_CACHE_DIR": str(out / "compiled"),
        "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]),
    }
    return subprocess.Popen(
        [*command, "--samples", str(samples), "--store", str(store)],
        env={**os.environ, **cache},
        stdout=subprocess.PIPE,
        text=True,
    )


def _finished(process: "subprocess.Popen[str]") -> str:
    printed, _ = process.communicate()
    if process.returncode:
        raise RuntimeError(f"A process of the study ended with code {process.returncode}; what it said is above.")
    return printed


if __name__ == "__main__":
    main()
