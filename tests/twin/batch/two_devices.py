"""A batch on two forced devices of one processor: run as a program by a test."""

import json

import batch_functions as functions
import jax
import numpy as np

from twin import _batch_kernel
from twin.batch import batched


def main():
    """Compute on all devices; print where chunks were computed, and the largest error."""
    jax.config.update("jax_enable_x64", True)
    mapped, seen = _batch_kernel._mapped, []

    def watched(fn, rows):
        found = mapped(fn, rows)
        seen.append([str(device) for value in found.values for device in value.devices()])
        return found

    _batch_kernel._mapped = watched
    samples = np.random.default_rng(7).random((64, 3)) * 0.9
    found = batched(functions.counted, samples, chunk_size=4, progress=False)
    alone = [batched(functions.counted, samples[i : i + 1], progress=False).value[0] for i in range(8)]
    devices = sorted({device for one in seen[:16] for device in one})
    print(json.dumps({"devices": devices, "error": float(np.max(np.abs(found.value[:8] - alone)))}))


if __name__ == "__main__":
    main()
