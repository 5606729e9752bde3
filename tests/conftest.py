"""Every test runs in double precision, with shapes and types checked at run time."""

import jax
from jaxtyping import install_import_hook

from twin._loop_option import make_small_loops_one_function

# As the command line does: without it every operation of a small loop is a call of its own.
make_small_loops_one_function()
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "standard")

for _package in ("twin", "sensitivity", "fitting"):
    install_import_hook(_package, "beartype.beartype")
