"""Named procedures of `drivetwin identify`, one per file.

A procedure is a module here with `HELP`, a sentence; `KEYS`, the keys of [identify] beside `procedure`; and
`run(study, table, out)`, which returns a `Found`. It is found by the file's name.
"""
