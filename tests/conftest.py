"""Every test runs in double precision, with shapes and types checked at run time."""

import jax

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "standard")

from jaxtyping import install_import_hook  # noqa: E402

for _package in ("twin", "sensitivity", "fitting"):
    install_import_hook(_package, "beartype.beartype")
