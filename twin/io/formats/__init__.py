"""File formats of measurements: one format per file, found by listing this folder.

A format is a module here with `ENDINGS`, a tuple of file endings; `matches(head)`, which says from the first bytes
whether this is its format (0 no, 1 perhaps, 2 certainly); and `read(file, limit, *, options)`, which returns a list of
channels and a list of remarks. Its keyword arguments are the options that `read_measurement` takes. Libraries are
imported inside the functions, sizes are checked against `limit` (bytes) before anything is allocated, and nothing of
the file is ever executed.
"""
