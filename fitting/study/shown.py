"""Tables as text."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.result import Estimate, FitResult

if TYPE_CHECKING:
    import pandas as pd

_LEAST_DIGITS, _MOST_DIGITS = 5, 15


def shown(table: "pd.DataFrame | pd.Series") -> str:
    """A table with five digits.

    Args:
        table: the table.
    """
    digits: Any = "{:.5g}".format
    return table.to_string(float_format=digits)


def shown_estimates(result: FitResult) -> str:
    """The estimates of a fit, each with the digits that its standard error supports.

    Args:
        result: the fit.
    """
    table = result.to_dataframe()[["unit", "estimate", "standard error", "95 % from", "95 % to", "remark"]]
    for path in table.index:
        error = float(table.at[path, "standard error"])
        digits = _LEAST_DIGITS
        if np.isfinite(error) and error > 0:
            sizes = [abs(float(table.at[path, one])) for one in ("estimate", "95 % from", "95 % to")]
            span = np.floor(np.log10(max(*sizes, error))) - np.floor(np.log10(error))
            digits = int(np.clip(span + 2, _LEAST_DIGITS, _MOST_DIGITS))
        table = table.astype({one: object for one in ("estimate", "standard error", "95 % from", "95 % to")})
        for one in ("estimate", "95 % from", "95 % to"):
            table.at[path, one] = f"{float(table.at[path, one]):.{digits}g}"
        table.at[path, "standard error"] = f"{error:.2g}"
    return table.to_string()


def shown_derived(derived: Mapping[str, Estimate]) -> list[str]:
    """A line for each quantity that follows from the estimates.

    Args:
        derived: quantities by name.
    """
    errors = {
        name: f", standard error {one.standard_error:.2g}" if np.isfinite(one.standard_error) else ""
        for name, one in derived.items()
    }
    return [f"{name} {one.value:.5g} {one.unit}{errors[name]}" for name, one in derived.items()]
