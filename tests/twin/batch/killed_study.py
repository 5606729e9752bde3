"""A small study that is killed again and again: run as a program by a test, with its folder and the number of kills.

JAX is loaded once, and each attempt is a fork of this process, made before JAX starts any thread.
"""

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

import jax
import numpy as np

from twin._fingerprint import versions
from twin.batch import batched

SAMPLES = np.random.default_rng(5).random((1200, 2))


def slow_product(sample):
    """Product of two numbers, a millisecond each."""
    time.sleep(1e-3)
    if sample[0] > 0.99:
        raise ValueError("too high")
    return {"product": sample[0] * sample[1], "both": sample}


def run(folder, stuck=0):
    """The study, with a disk that takes its time, so that it is killed amid writing too.

    Args:
        folder: its folder.
        stuck: number of the file, counted from 1, at which the disk stops for ever.
    """
    sync, files = os.fsync, 0

    def slow(descriptor):
        nonlocal files
        files += 1
        time.sleep(600 if files == stuck else 2e-3)
        sync(descriptor)

    os.fsync = slow
    return batched(slow_product, SAMPLES, store=folder, mode="loop", chunk_size=4, progress=False)


def attempt(folder, wanted, after, stuck):
    """Run the study in a fork, and kill it.

    Args:
        folder: its folder.
        wanted: pattern and number of the files that must be there first.
        after: how long it then goes on [s].
        stuck: as of `run`.

    Returns:
        Whether it was still running.
    """
    child = os.fork()
    if child == 0:
        run(folder, stuck)
        os._exit(0)
    pattern, number = wanted
    while len(list(folder.glob(pattern))) < number:
        done, _ = os.waitpid(child, os.WNOHANG)
        if done:
            return False
        time.sleep(1e-3)
    time.sleep(after)
    os.kill(child, signal.SIGKILL)
    return os.waitpid(child, 0)[1] == signal.SIGKILL


def main():
    """Kill, go on, print what was found."""
    folder, kills = Path(sys.argv[1]), int(sys.argv[2])
    jax.config.update("jax_enable_x64", True)
    versions()  # once for all forks
    draw = random.Random(1)
    killed, aside, chunks = [], 0, [0]
    for number in range(kills):
        if number in (1, 2, 3):  # amid the samples, the manifest, the first chunk
            pattern = ("samples*.partial", "manifest*.partial", "chunks/*.partial")[number - 1]
            killed.append(attempt(folder, (pattern, 1), 0.0, number))
        else:
            more = draw.randint(0, 8) if number else 0
            killed.append(attempt(folder, ("chunks/*.npz", chunks[-1] + more), draw.uniform(0.0, 0.01), 0))
        aside += any(folder.rglob("*.partial"))
        chunks.append(len(list(folder.glob("chunks/*.npz"))))
    found = {"killed": killed, "aside": aside, "chunks": chunks, "resumed": run(folder).digest}
    found["uninterrupted"] = batched(slow_product, SAMPLES, mode="loop", chunk_size=4, progress=False).digest
    print(json.dumps(found))


if __name__ == "__main__":
    main()
