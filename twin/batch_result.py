"""The results of a batch: outputs by name, and what became of each sample."""

import dataclasses
import hashlib
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from twin._checks import InputError

if TYPE_CHECKING:
    import pandas as pd

STATUS = ("waiting", "done", "not_finite", "raised", "sample_is_nan")
"""What became of a sample, by its number: not computed yet; computed; computed, but an output is NaN or infinite; the
function raised; not computed, as the sample itself holds NaN."""
WAITING, DONE, NOT_FINITE, RAISED, SAMPLE_IS_NAN = range(len(STATUS))


@dataclasses.dataclass(frozen=True, repr=False)
class BatchResult:
    """Outputs of a function at many samples, in the order of the samples. Shows itself as a short table."""

    outputs: Mapping[str, np.ndarray]
    """Outputs by name, each (samples, ...). Samples that failed hold NaN, or zero where an output is a whole number.
    Read from the disk when asked for, where the study has a store."""
    status: np.ndarray
    """What became of each sample: numbers into `STATUS` (samples,)."""
    seconds: np.ndarray
    """Wall time of each sample [s] (samples,); the time of a chunk shared out among the samples computed together."""
    messages: dict[int, str]
    """What the samples that raised said, by number."""
    samples: Mapping[str, np.ndarray]
    """The samples, by name."""

    def __getitem__(self, name: str) -> np.ndarray:
        """One output (samples, ...).

        Raises:
            InputError: there is no output of that name.
        """
        if name not in self.outputs:
            raise InputError(f"The batch has no output {name!r}; it has {', '.join(self.outputs) or 'none yet'}.")
        return self.outputs[name]

    @property
    def value(self) -> np.ndarray:
        """The output of a function that returns one array."""
        return self["value"]

    @property
    def success(self) -> np.ndarray:
        """Which samples have finite outputs (samples,)."""
        return self.status == DONE

    @property
    def message(self) -> str:
        """How many samples there are, and what became of those that failed."""
        counts = Counter(self.status.tolist())
        parts = [f"{counts[DONE]:,} of {len(self.status):,} samples computed"]
        words = {
            WAITING: "wait",
            NOT_FINITE: "have an output that is NaN or infinite",
            RAISED: "raised",
            SAMPLE_IS_NAN: "hold NaN themselves",
        }
        parts += [f"{counts[status]:,} {text}" for status, text in words.items() if counts[status]]
        first = min(self.messages, default=None)
        told = "" if first is None else f" The first that raised, number {first}: {self.messages[first]}"
        return "; ".join(parts) + "." + told

    @property
    def digest(self) -> str:
        """Digest of all outputs and of what became of each sample: equal for equal results, to the last bit."""
        sha = hashlib.sha256(np.ascontiguousarray(self.status).tobytes())
        for name, values in sorted(self.outputs.items(), key=lambda item: item[0]):
            sha.update(f"{name} {values.dtype.str} {values.shape}".encode())
            sha.update(np.ascontiguousarray(values).tobytes())
        return sha.hexdigest()

    def to_dataframe(self) -> "pd.DataFrame":
        """Table with one row for each sample: its values, the outputs that are single numbers or short vectors, and
        what became of it."""
        import pandas as pd

        columns = {**_columns(self.samples), **_columns(self.outputs)}
        columns["status"] = np.asarray(STATUS)[self.status]
        columns["seconds"] = self.seconds
        return pd.DataFrame(columns, index=pd.RangeIndex(len(self.status), name="sample"))

    def _repr_html_(self) -> str:
        return f"<div><p>{self.message}</p>{self._shown().to_html(float_format=_short)}</div>"

    def __repr__(self) -> str:
        return f"{self._shown().to_string(float_format=_short)}\n{self.message}"

    def _shown(self) -> "pd.DataFrame":
        import pandas as pd

        rows = []
        for name, values in self.outputs.items():
            good = values[self.success]
            row = [name, str(values.shape[1:] or "number")]
            numbers = good.size > 0 and good.dtype.kind in "fiu"
            rows.append([*row, *([good.min(), np.median(good), good.max()] if numbers else [np.nan] * 3)])
        return pd.DataFrame(rows, columns=["output", "shape", "least", "median", "greatest"]).set_index("output")


def statuses(values: Mapping[str, np.ndarray], good: np.ndarray, raised: Mapping[int, str]) -> np.ndarray:
    """What became of the samples of a chunk.

    Args:
        values: outputs by name (rows, ...).
        good: which samples were to be computed.
        raised: messages of those that raised, by row.
    """
    status = np.full(len(good), DONE, dtype=np.int8)
    for value in values.values():
        if value.dtype.kind in "fc":
            status[~np.isfinite(value.reshape(len(good), -1)).all(axis=1)] = NOT_FINITE
    status[list(raised)] = RAISED
    status[~good] = SAMPLE_IS_NAN
    return status


def was_computed(status: np.ndarray) -> np.ndarray:
    """Which samples have outputs, finite or not."""
    return np.isin(status, (DONE, NOT_FINITE))


def _columns(arrays: Mapping[str, np.ndarray], longest: int = 12) -> dict[str, np.ndarray]:
    columns = {}
    for name, values in arrays.items():
        if values.ndim == 1:
            columns[name] = values
        elif values.ndim == 2 and values.shape[1] <= longest:
            columns |= {f"{name}.{i}": values[:, i] for i in range(values.shape[1])}
    return columns


def _short(number: float) -> str:
    return f"{number:.6g}"


def blank(count: int, like: np.ndarray) -> np.ndarray:
    """Outputs of samples not computed yet: NaN, or zero for whole numbers."""
    return np.full((count, *like.shape[1:]), np.nan if like.dtype.kind in "fc" else 0, dtype=like.dtype)
