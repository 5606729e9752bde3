"""Measured data in (`csv`, `mat`, `frf_uff`), component models (`component`), parameter files in and out, units.

Import a reader from its file, such as `from twin.io.mat import read_mat`. Units are converted here, and nowhere else.
"""
