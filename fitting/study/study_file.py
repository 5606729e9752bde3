"""A study file: model, free parameters, data and what is asked, in one TOML file."""

import dataclasses
import functools
import os
from typing import Any

from fitting.study.free_parameters import free_parameters
from twin.io.model_table import build_model
from twin.io.toml_document import TomlDocument
from twin.io.toml_table import TomlTable
from twin.parameters import ParameterSpace
from twin.stepping import AbstractStepping

TABLES = ("study", "model", "free", "data", "stepping")
"""Tables of every study; those of the commands are named as they are."""
COMMANDS = ("fit", "rank", "sweep", "simulate", "frf", "modes", "identify")
"""Tables of the commands."""


@dataclasses.dataclass(frozen=True)
class StudyFile:
    """A study as it was written; its parts are built and checked when they are asked for."""

    document: TomlDocument
    """The file."""
    title: str
    """What the study is called."""
    seed: int
    """Seed of whatever is drawn."""

    @functools.cached_property
    def model(self) -> Any:
        """The model, at the values of the file.

        Raises:
            InputError: see `twin.io.model_table.build_model`.
        """
        return build_model(self.document)

    @functools.cached_property
    def space(self) -> ParameterSpace:
        """The free parameters.

        Raises:
            InputError: see `free_parameters`.
        """
        return free_parameters(self.document, self.model)

    @functools.cached_property
    def stepping(self) -> AbstractStepping | None:
        """How time is stepped; None for what suits the model.

        Raises:
            InputError: see `twin.io.model_table.build_model`.
        """
        return (
            build_model(self.document, ("stepping",), kind=AbstractStepping)
            if "stepping" in self.document.data
            else None
        )

    def table(self, *key: str, known: tuple[str, ...], required: bool = False) -> TomlTable:
        """One table of the file.

        Args:
            key: where it stands.
            known: keys that it may have.
            required: whether it must be there.

        Raises:
            InputError: no table, or an unknown key.
        """
        return TomlTable(self.document, key, known, required=required)


def read_study(path: str | os.PathLike[str]) -> StudyFile:
    """Read a study file.

    Args:
        path: a TOML file; `drivetwin new` writes one to begin with.

    Returns:
        The study. Its model, parameters and data are built when they are asked for.

    Raises:
        InputError: a file that cannot be read (with the line), or an unknown table.
    """
    document = TomlDocument(path)
    document.check_keys((), (*TABLES, *COMMANDS))
    head = TomlTable(document, ("study",), ("title", "seed"))
    return StudyFile(document, head.text("title", document.file.stem), head.integer("seed", 1))
