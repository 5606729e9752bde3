"""Results as one `.npz` file, without pickle: named arrays, and beside them the parameters and plain values as JSON."""

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace


@dataclasses.dataclass(frozen=True)
class NpzFile:
    """What files of one kind of result hold; the names are those of the result's attributes."""

    kind: str
    """What it is, for messages: "fit result"."""
    writer: str
    """Method that writes it, for messages."""
    version: int
    """Number of the format; files of another are refused."""
    arrays: Sequence[str]
    """Arrays."""
    plain: Sequence[str]
    """Numbers and texts."""

    def write(self, path: str | Path, result: Any) -> None:
        """Write a result.

        Args:
            path: file; the ending .npz is added if missing.
            result: an object with all attributes named, and its parameters as `space`.
        """
        parameters = [{f.name: getattr(p, f.name) for f in dataclasses.fields(p)} for p in result.space.parameters]
        head = {"format": self.version, "parameters": parameters}
        head |= {name: getattr(result, name) for name in self.plain}
        arrays = {name: getattr(result, name) for name in self.arrays}
        np.savez_compressed(path, head=np.asarray(json.dumps(head)), **arrays)

    def read(self, path: str | Path) -> dict[str, Any]:
        """Read what `write` wrote.

        Args:
            path: file; the ending .npz may be left out.

        Returns:
            The attributes by name.

        Raises:
            InputError: file missing, damaged, of another kind or of another version.
        """
        path = Path(path)
        if not path.exists() and path.with_name(f"{path.name}.npz").exists():
            path = path.with_name(f"{path.name}.npz")  # the ending that `write` added
        if not path.exists():
            raise InputError(f"{path} does not exist. Give the file that {self.writer} wrote.")
        try:
            with np.load(path, allow_pickle=False) as file:
                head = json.loads(str(file["head"]))
                arrays = {name: file[name] for name in self.arrays}
        except Exception as error:
            raise InputError(
                f"{path} is not a readable {self.kind} ({error}). Save it again by {self.writer}."
            ) from error
        if head.pop("format") != self.version:
            raise InputError(
                f"{path} was written by another version of drivetwin. Make the {self.kind} again, or use that version."
            )
        parameters = []
        for entry in head.pop("parameters"):
            prior = entry.pop("prior")
            parameters.append(Parameter(**entry, prior=None if prior is None else tuple(prior)))
        return {"space": ParameterSpace(parameters), **arrays, **head}
