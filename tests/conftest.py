"""Every test runs in double precision, with shapes and types checked at run time."""

import os

# As the command line does: without it every operation of a small loop is a call of its own.
os.environ.setdefault("XLA_FLAGS", "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=1000000")

import jax

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "standard")

from jaxtyping import install_import_hook  # noqa: E402

for _package in ("twin", "sensitivity", "fitting"):
    install_import_hook(_package, "beartype.beartype")
