"""MATLAB files in, by SciPy: the numeric variables of a version 4 to 7 MAT-file."""

import os

import numpy as np

from twin._checks import InputError
from twin.io._files import existing_file


def read_mat(path: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """Read the numeric variables of a MAT-file.

    Rows and columns become vectors and single numbers 0-d arrays; the number type of the file is kept. Structs, cells,
    text and MATLAB objects are left out.

    Args:
        path: a MAT-file, version 4 to 7.

    Returns:
        Arrays by variable name.

    Raises:
        InputError: if the file does not exist, is empty, truncated or no MAT-file, or has version 7.3.
    """
    import scipy.io  # a quarter of a second to import

    file = existing_file(path, "MAT-file")
    try:
        variables = scipy.io.loadmat(file, appendmat=False)
    except NotImplementedError as error:
        raise InputError(
            f"MAT-file {str(file)!r} has version 7.3 (HDF5), which cannot be read yet. "
            "Save it again in MATLAB with save(..., '-v7')."
        ) from error
    except Exception as error:  # a damaged file makes SciPy raise nearly anything: zlib, struct, type and value errors
        raise InputError(
            f"MAT-file {str(file)!r} cannot be read ({type(error).__name__}: {error}): it is truncated, damaged or "
            "no MAT-file. Copy or export it again and compare its size with the original."
        ) from error
    return {
        name: value.reshape(()) if value.size == 1 else value.ravel() if 1 in value.shape else value
        for name, value in variables.items()
        if isinstance(name, str) and not name.startswith("__")
        if isinstance(value, np.ndarray) and value.dtype.kind in "biufc"
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
