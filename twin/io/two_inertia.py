"""The two-inertia bench: two motors coupled by a shaft, one of them excited by multisine currents.

Data of the Hori-Fujimoto Lab (T. Beauduin, W. Ohnishi), published with FdiTools under the MIT licence.
"""

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from twin._checks import InputError
from twin.io.data import data_file
from twin.io.mat import pick_variable, read_mat
from twin.record import Record

_FILES = {"A": "two_inertia_bench/MultisineTypeA.mat", "B": "two_inertia_bench/MultisineTypeB.mat"}
_MICROSECOND = 1e-6
# The designed lines stand ten orders of magnitude above the rest of the reference's spectrum.
_EXCITED_ABOVE = 1e-3
# channel: (variable, sign, unit); the load's encoder counts against the motor's.
_CHANNELS = {
    "current": ("iq_adx", 1.0, "A"),
    "motor_angle": ("theta_mx", 1.0, "rad"),
    "load_angle": ("theta_my", -1.0, "rad"),
    "motor_speed": ("omega_max", 1.0, "rad/s"),
    "load_speed": ("omega_may", -1.0, "rad/s"),
    "bus_voltage": ("vdc_adx", 1.0, "V"),
}


class TwoInertiaRecord(NamedTuple):
    """One record of the bench with the layout of its periodic excitation."""

    record: Record
    """Channels `current` [A], `motor_angle`, `load_angle` [rad], `motor_speed`, `load_speed` [rad/s] and
    `bus_voltage` [V]; motor and load count in the same direction."""
    period_samples: int
    """Samples in one period of the excitation (2500, that is 1 s)."""
    periods: int
    """Periods in the record (20); the first begins at rest and holds the transient."""
    excited_frequencies: Float[np.ndarray, " lines"]
    """Frequencies of the excited lines [Hz]: A 11 to 250 in steps of 1, B 13 to 249 in steps of 4."""


def read_two_inertia(path: str | os.PathLike[str] | None = None, record: str = "A") -> TwoInertiaRecord:
    """Read one of the two multisine records of the bench.

    The recorded angles have opposite signs (below resonance their ratio is -1), so the load's angle and speed are
    negated. Both recorded speeds are the derivative of the angle behind a first-order low-pass at 20.4 Hz: they lag by
    28° at 11 Hz already. Their ratio is sound; for anything else differentiate the angles. The first period
    is a transient from rest and contains a current spike; leave it out.

    Args:
        path: a MAT-file, or a folder that holds `MultisineTypeA.mat` and `MultisineTypeB.mat`; None looks for the data
            set by `twin.io.data.data_file`.
        record: "A" (Schroeder phases, every line) or "B" (random phases, odd-odd lines).

    Returns:
        The record of 20 periods of 2500 samples at 2.5 kHz, with the layout of the excitation.

    Raises:
        InputError: if the record name is unknown, the file cannot be read, lacks a variable, is not uniformly sampled
            or holds no whole number of periods.
        DataNotFound: if no path is given and the data set is found nowhere.
    """
    if record not in _FILES:
        raise InputError(f"record must be 'A' or 'B', but is {record!r}. Choose one of the two.")
    file = data_file(_FILES[record]) if path is None else Path(path)
    if file.is_dir():
        file = file / Path(_FILES[record]).name
    variables = read_mat(file)

    def samples(name: str) -> np.ndarray:
        return pick_variable(variables, name, file).astype(np.float64)

    rate = float(samples("fs"))
    excitation = samples("ref")
    times = _uniform_times(samples("time"), rate, file)
    if times.size % excitation.size:
        raise InputError(
            f"{str(file)!r} holds {times.size} samples, which is no whole number of periods of {excitation.size}. "
            "Check that it is the original file, not a cut one."
        )
    return TwoInertiaRecord(
        record=Record.create(
            times,
            {channel: sign * samples(variable) for channel, (variable, sign, _) in _CHANNELS.items()},
            {channel: unit for channel, (_, _, unit) in _CHANNELS.items()},
            name=f"two-inertia bench {record}",
        ),
        period_samples=excitation.size,
        periods=times.size // excitation.size,
        excited_frequencies=_excited_lines(excitation) * rate / excitation.size,
    )


def _excited_lines(excitation: np.ndarray) -> np.ndarray:
    amplitude = np.abs(np.fft.rfft(excitation))
    return np.flatnonzero(amplitude > _EXCITED_ABOVE * amplitude.max()).astype(np.float64)


def _uniform_times(recorded: np.ndarray, rate: float, file: Path) -> np.ndarray:
    times = np.arange(recorded.size) / rate
    if not np.all(np.abs(recorded * _MICROSECOND - times) < _MICROSECOND):
        raise InputError(
            f"the times of {str(file)!r} must be k/{rate:g} s from 0 within 1 µs, but are not. "
            "Check that it is the original file, not a cut or resampled one."
        )
    return times
