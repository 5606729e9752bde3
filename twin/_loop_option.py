"""The option of XLA's CPU compiler that makes simulations fast; this file loads nothing, so that it can come first."""

import os

_OPTION = "xla_cpu_small_while_loop_byte_threshold"


def make_small_loops_one_function() -> None:
    """Let XLA compile small loops, such as a controller tick, as one function: simulations run two to four times
    as fast.

    For programs, never for packages. Takes effect only before JAX compiles anything, and leaves flags that are set
    already alone.
    """
    os.environ.setdefault("XLA_FLAGS", f"--xla_backend_extra_options={_OPTION}=1000000")


def small_loops_are_one_function() -> bool:
    """Whether the option is set."""
    return _OPTION in os.environ.get("XLA_FLAGS", "")
