"""Clock times and dates of a text column as seconds."""

from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.io.formats._cells import CLOCK

_DAY = 86400.0


def clock_seconds(cells: Any, name: str, file: Path) -> tuple[np.ndarray, str]:
    """Seconds since the first of a column of clock times or dates.

    Args:
        cells: a pandas column of text.
        name: name of the column, for messages.
        file: the file, for messages.

    Returns:
        Seconds, NaN where a cell is empty, and the first cell.

    Raises:
        InputError: a cell that is no time.
    """
    import pandas

    held = cells.dropna()
    if held.empty:
        raise InputError(f"{str(file)!r} has no clock time in column {name!r}. Name another time column.")
    started = str(held.iloc[0]).strip()
    text = cells.astype("string").str.strip().str.replace(",", ".", regex=False)
    try:
        if CLOCK.fullmatch(started):
            text = text.where(text.str.count(":") == 2, text + ":00")
            seconds = pandas.to_timedelta(text).dt.total_seconds().to_numpy(dtype=np.float64, na_value=np.nan)
            seconds = _over_midnight(seconds)
        else:
            form = "ISO8601" if started[:4].isdigit() else "mixed"
            moments = pandas.to_datetime(text, format=form, dayfirst="." in started[:6], utc=True)
            first = moments.dropna().iloc[0]
            seconds = (moments - first).dt.total_seconds().to_numpy(dtype=np.float64, na_value=np.nan)
    except (ValueError, TypeError, OverflowError) as error:
        raise InputError(
            f"{str(file)!r} has a cell in column {name!r} that is no time like the first, {started!r}. Repair it, "
            "or name another time column."
        ) from error
    return seconds - seconds[np.flatnonzero(np.isfinite(seconds))[0]], started


def _over_midnight(seconds: np.ndarray) -> np.ndarray:
    seconds = seconds.copy()
    finite = np.isfinite(seconds)
    steps = np.diff(seconds[finite], prepend=seconds[finite][:1])
    seconds[finite] += _DAY * np.cumsum(steps < -_DAY / 2)
    return seconds
