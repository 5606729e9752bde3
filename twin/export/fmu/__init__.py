"""Functional mock-up units: a step of a system as a library in C that simulation tools load."""

from twin.export.fmu.write import write_fmu as write_fmu
