"""JAX programs of small, fixed shapes translated to C."""

from twin.export.c_code.function import c_function as c_function
