"""The compiled C loop on the rack-and-pinion case: what a user without any library would write for speed."""

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.benchmarks.rack_case import STATES, TIMES, motion

_SOURCE = Path(__file__).with_name("rack_loop.c")
_FLAGS = ("-O3", "-march=native", "-std=c11", "-shared", "-fPIC")
_ARRAY = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")


class Loop(NamedTuple):
    """The compiled source."""

    rate: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    """Right-hand side from state, reference and parameters."""
    library: ctypes.CDLL
    """What was compiled."""

    def runner(self, substeps: int, threads: int = 1) -> Callable[[np.ndarray], np.ndarray]:
        """Simulations by classical Runge-Kutta steps of constant length, shape (variants, times, 3).

        Args:
            substeps: steps between two saved times.
            threads: on which the variants are spread evenly; one variant runs on one.
        """
        saves = TIMES.size - 1
        wanted = np.ascontiguousarray(motion(np.linspace(0.0, TIMES[-1], 2 * saves * substeps + 1)))
        length = float(TIMES[1]) / substeps

        def run(values: np.ndarray) -> np.ndarray:
            result = np.empty((len(values), TIMES.size, 3))
            parts = zip(np.array_split(values, threads), np.array_split(result, threads), strict=True)

            def part(rows: np.ndarray, into: np.ndarray) -> None:
                self.library.simulate(len(rows), saves, substeps, length, wanted, rows, into)

            if threads == 1:
                part(values, result)
            else:
                with ThreadPoolExecutor(threads) as pool:
                    for future in [pool.submit(part, *arrays) for arrays in parts]:
                        future.result()
            return result

        return run


def compiled_loop() -> Loop | None:
    """Compile the source; None without a C compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder) / "rack_loop.so"
        subprocess.run([compiler, *_FLAGS, str(_SOURCE), "-o", str(binary), "-lm"], check=True)
        library = ctypes.CDLL(str(binary))
    library.simulate.argtypes = [*[ctypes.c_int] * 3, ctypes.c_double, *[_ARRAY] * 3]
    library.right_hand_side.argtypes = [_ARRAY] * 4
    library.simulate.restype = library.right_hand_side.restype = None

    def rate(state: np.ndarray, wanted: np.ndarray, values: np.ndarray) -> np.ndarray:
        result = np.empty(STATES)
        library.right_hand_side(state, wanted, values, result)
        return result

    return Loop(rate, library)
