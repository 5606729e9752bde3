"""Tables as text."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd


def shown(table: "pd.DataFrame | pd.Series") -> str:
    """A table with five digits.

    Args:
        table: the table.
    """
    digits: Any = "{:.5g}".format
    return table.to_string(float_format=digits)
