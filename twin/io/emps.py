"""The EMPS data set: a ball-screw servo axis under P position and P velocity control, sampled at 1 kHz.

Janot, Gautier, Brunot, "Data Set and Reference Models of EMPS", Workshop on Nonlinear System Identification Benchmarks,
2019.
"""

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from twin._checks import InputError
from twin.io.data import data_file
from twin.io.mat import pick_variable, read_mat
from twin.record import Record

_FILES = {"train": "emps/DATA_EMPS.mat", "test": "emps/DATA_EMPS_PULSES.mat"}
_SAMPLE_PERIOD = 1e-3
_JITTER_LIMIT = 1e-6


class EmpsRecord(NamedTuple):
    """One EMPS record with the constants of its controller and its drive."""

    record: Record
    """Channels on the load side: `reference_position` (qg) [m], `position` (qm) [m], `voltage` (vir) [V],
    `force` = gtau·vir [N]; in the test record also `pulse_voltage` (pulses_N) [V]."""
    kp: float
    """Position gain kp [1/s]."""
    kv: float
    """Velocity gain kv [V/(m/s)]."""
    gtau: float
    """Drive gain gtau: force per control signal [N/V]."""


def read_emps(path: str | os.PathLike[str] | None = None, record: str = "train") -> EmpsRecord:
    """Read one of the two EMPS records.

    The recorded clock strays from 1 kHz by at most 0.032 µs (standard deviation 0.012 µs); the times given are the
    uniform k·0.001 s.

    The pulses of the test record are already contained in `voltage`. The file stores them as bytes, 0 or 5, which lost
    their fraction: what `voltage` exceeds the control law by is 5.0695 V (178.2 N) while a pulse is on, with a standard
    deviation of 0.005 V, and nothing while it is off. `pulse_voltage` is given as stored; to simulate, take its timing
    and scale it by 5.0695 / 5. All pulses are positive.

    Args:
        path: a MAT-file, or a folder that holds `DATA_EMPS.mat` and `DATA_EMPS_PULSES.mat`; None looks for the data set
            by `twin.io.data.data_file`.
        record: "train" (DATA_EMPS) or "test" (DATA_EMPS_PULSES), the official split.

    Returns:
        The record of 24,841 samples with kp, kv and gtau.

    Raises:
        InputError: if the record name is unknown, or the file cannot be read, lacks a variable or is not sampled at
            1 kHz.
        DataNotFound: if no path is given and the data set is found nowhere.
    """
    if record not in _FILES:
        raise InputError(f"record must be 'train' or 'test', but is {record!r}. Choose one of the two.")
    file = data_file(_FILES[record]) if path is None else Path(path)
    if file.is_dir():
        file = file / Path(_FILES[record]).name
    variables = read_mat(file)

    def samples(name: str) -> np.ndarray:
        return pick_variable(variables, name, file).astype(np.float64)

    gtau = _constant(samples("gtau"), "gtau", file)
    channels = {
        "reference_position": samples("qg"),
        "position": samples("qm"),
        "voltage": samples("vir"),
        "force": gtau * samples("vir"),
    }
    units = {"reference_position": "m", "position": "m", "voltage": "V", "force": "N"}
    if record == "test":
        channels["pulse_voltage"] = samples("pulses_N")
        units["pulse_voltage"] = "V"
    return EmpsRecord(
        record=Record.create(_uniform_times(samples("t"), file), channels, units, name=f"EMPS {record}"),
        kp=_constant(samples("kp"), "kp", file),
        kv=_constant(samples("kv"), "kv", file),
        gtau=gtau,
    )


def _constant(value: np.ndarray, name: str, file: Path) -> float:
    if value.size != 1 or not np.isfinite(value).all():
        raise InputError(
            f"variable {name!r} of {str(file)!r} must be one finite number, but has shape {value.shape}. "
            "Check that it is the file of this data set."
        )
    return float(value)


def _uniform_times(recorded: np.ndarray, file: Path) -> np.ndarray:
    times = np.arange(recorded.size) * _SAMPLE_PERIOD
    stray = np.abs(recorded - times)
    # Written so that a NaN is refused, too.
    if not np.all(stray <= _JITTER_LIMIT):
        index = int(np.flatnonzero(~(stray <= _JITTER_LIMIT))[0])
        raise InputError(
            f"the times of {str(file)!r} must be k·0.001 s from 0 within 1 µs, but at index {index} the time is "
            f"{recorded[index]:g} s. Check that it is the original file, not a cut or resampled one."
        )
    return times
