"""The error of unusable input; this file loads nothing, so that a program's help need not wait for JAX."""


class InputError(ValueError):
    """Input that cannot be used: the message names the argument, the value seen, what was expected and what to do."""
