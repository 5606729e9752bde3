"""Results over outputs and parameters as tables, and outputs looked up by name."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from twin._checks import InputError

if TYPE_CHECKING:
    import pandas as pd


def long_table(outputs: Sequence[str], names: Sequence[str], columns: Mapping[str, np.ndarray]) -> "pd.DataFrame":
    """Table with one row per output and parameter.

    Args:
        outputs: names of the outputs.
        names: names of the parameters.
        columns: arrays (outputs, names) by the columns' titles.
    """
    import pandas as pd

    rows = pd.MultiIndex.from_product([outputs, names], names=["output", "parameter"])
    return pd.DataFrame({title: np.ravel(array) for title, array in columns.items()}, index=rows)


def shown_html(table: "pd.DataFrame", title: str, facts: str) -> str:
    """A table as it stands in a notebook.

    Args:
        table: table.
        title: what it is.
        facts: one line about it.
    """
    body = table.to_html(float_format=lambda x: f"{x:.4g}", max_rows=60)
    return f"<div><p><b>{title}</b>: {facts}.</p>{body}</div>"


def shown_text(table: "pd.DataFrame", title: str, facts: str) -> str:
    """A table as it is printed.

    Args:
        table: table.
        title: what it is.
        facts: one line about it.
    """
    return f"{table.to_string(float_format=lambda x: f'{x:.4g}', max_rows=60)}\n{title}: {facts}."


def number_of(output: str | int, outputs: Sequence[str]) -> int:
    """Number of an output.

    Args:
        output: its name, or its number.
        outputs: names of the outputs.

    Raises:
        InputError: no such output.
    """
    if isinstance(output, str) and output in outputs:
        return list(outputs).index(output)
    if isinstance(output, int | np.integer) and -len(outputs) <= output < len(outputs):
        return int(output) % len(outputs)
    shown = ", ".join(outputs[:8]) + (", ..." if len(outputs) > 8 else "")
    raise InputError(f"No output {output!r}; there are {len(outputs)}: {shown}.")
