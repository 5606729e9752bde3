"""Every test runs in double precision, with shapes and types checked at run time."""

import os
from pathlib import Path

import jax
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
