"""What the command `drivetwin` can do: one command per file.

A command is a module here with `HELP`, a sentence; `add_arguments(parser)`, which gives an argparse parser its
arguments; and `run(options)`, which does it and returns an `Outcome`. The command line finds it by the file's name,
underscores being hyphens. JAX, plots and readers are imported inside `run`: the help must not wait for them.
"""
