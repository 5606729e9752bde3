"""Drives that `drivetwin new` writes a study file for, one per file.

A drive is a module here with `HELP`, a sentence; `model()`, which makes it with plausible values; and `REST`, what
comes after the table [model]: free parameters, data and questions. It is found by the file's name.
"""
