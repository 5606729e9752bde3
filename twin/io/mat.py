"""MATLAB files in: the numeric variables of a MAT-file of any version."""

import os
import warnings

import numpy as np

from twin._checks import InputError
from twin.io._files import existing_file
from twin.io.formats._mat_tree import mat_tree
from twin.io.measurement import READ_LIMIT


def read_mat(path: str | os.PathLike[str], *, limit: int | None = None) -> dict[str, np.ndarray]:
    """Read the numeric variables of a MAT-file.

    Rows and columns become vectors and single numbers 0-d arrays; the number type of the file is kept. Structs, cells,
    text and MATLAB objects are left out.

    Args:
        path: a MAT-file, version 4 to 7.3.
        limit: bytes that may be read; None allows 2 GB.

    Returns:
        Arrays by variable name.

    Raises:
        InputError: if the file does not exist, is empty, truncated or no MAT-file, or larger than the limit.
    """
    file = existing_file(path, "MAT-file")
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        variables = mat_tree(file, READ_LIMIT if limit is None else limit)
    return {
        name: value.reshape(()) if value.size == 1 else value.ravel() if 1 in value.shape else value
        for name, value in variables.items()
        if isinstance(value, np.ndarray) and not name.startswith("__")
    }


def pick_variable(variables: dict[str, np.ndarray], name: str, path: str | os.PathLike[str]) -> np.ndarray:
    """One variable of those read from a MAT-file.

    Args:
        variables: what `read_mat` returned.
        name: name of the variable.
        path: the file, for the message.

    Raises:
        InputError: if the file has no such variable; the message lists those it has.
    """
    if name not in variables:
        raise InputError(
            f"MAT-file {str(path)!r} has no variable {name!r}; it has {', '.join(sorted(variables)) or 'none'}. "
            "Check that it is the file of this data set, and complete."
        )
    return variables[name]
