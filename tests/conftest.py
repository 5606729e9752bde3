"""Every test runs in double precision, with shapes and types checked at run time."""

import gc
import os
from collections.abc import Iterator
from pathlib import Path

import jax
import pytest
from jaxtyping import install_import_hook

from twin._loop_option import make_small_loops_one_function

# As the command line does: without it every operation of a small loop is a call of its own.
make_small_loops_one_function()
# Most of a run is compilation. The workers share what one of them compiled, commands and notebooks that tests start
# do as well, and so does the next run. JAX keys the entries by program, options, versions and processor.
_cache = str(Path(__file__).parents[1] / ".jax_cache")
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", _cache)
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.3")
jax.config.update("jax_compilation_cache_dir", os.environ["JAX_COMPILATION_CACHE_DIR"])
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.3)
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "standard")

for _package in ("twin", "sensitivity", "fitting"):
    install_import_hook(_package, "beartype.beartype")

_ROOM = 2.5e9
"""Bytes of memory of a worker beyond which it forgets its compiled programs after a module."""


@pytest.fixture(autouse=True, scope="module")
def _bounded_memory() -> Iterator[None]:
    """Thousands of tests compile thousands of programs, which a worker would otherwise keep until its end."""
    yield
    if _resident() > _ROOM:
        jax.clear_caches()
        gc.collect()


def _resident() -> float:
    """Bytes of memory that this process holds; 0 where the system does not say."""
    try:
        return float(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return 0.0
