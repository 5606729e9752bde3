"""A study that takes as long as it is told to: run as a program by tests of Ctrl-C."""

import os
import sys
import time

import jax
import numpy as np

from twin.batch import batched
from twin.executors import local_processes


def slow_square(sample):
    """Square of a number, after a pause."""
    time.sleep(float(os.environ["PAUSE"]))
    return sample**2


def main():
    """Run the study in the folder of the first argument, by workers if the second one says so."""
    jax.config.update("jax_enable_x64", True)
    pool = local_processes(2) if sys.argv[2] == "workers" else None
    found = batched(
        slow_square, np.arange(200.0), store=sys.argv[1], executor=pool, mode="loop", chunk_size=1, progress=False
    )
    print(found.message)
    if pool is not None:
        pool.shutdown()


if __name__ == "__main__":
    main()
