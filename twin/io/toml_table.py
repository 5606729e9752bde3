"""One table of a TOML file, read key by key with checks."""

from collections.abc import Sequence
from typing import Any

from twin._checks import InputError
from twin.io.quantity import Quantity, parse_quantity
from twin.io.toml_document import Key, TomlDocument, unknown


class TomlTable:
    """A table whose entries are asked for by their kind; each error names file, line and key."""

    def __init__(self, document: TomlDocument, key: Key, known: Sequence[str], *, required: bool = False):
        """The table.

        Args:
            document: the file.
            key: where the table stands; it may be missing, as if it were empty.
            known: keys that it may have.
            required: whether it must be there.

        Raises:
            InputError: no table, or an unknown key.
        """
        self.document, self.key = document, key
        self.data = document.table(key, required=required)
        document.check_keys(key, known)

    def __contains__(self, name: str) -> bool:
        return name in self.data

    def error(self, name: str, message: str) -> InputError:
        """An error about one key.

        Args:
            name: the key; empty for the table itself.
            message: what is wrong and what to do.
        """
        return self.document.error((*self.key, name) if name else self.key, message)

    def text(self, name: str, default: str | None = None, *, choices: Sequence[str] | None = None) -> str:
        """A text.

        Args:
            name: the key.
            default: what it is if it is not given; None if it must be.
            choices: what it may be.

        Raises:
            InputError: missing, no text, or none of the choices.
        """
        found = self._get(name, default)
        if not isinstance(found, str) or not found.strip():
            raise self.error(name, f"must be text in quotes, but is {found!r}.")
        if choices is not None and found not in choices:
            raise self.error(name, unknown("choice", found, choices))
        return found

    def texts(self, name: str, default: Sequence[str] | None = None) -> tuple[str, ...]:
        """A list of texts; one text counts as a list of one.

        Args:
            name: the key.
            default: what it is if it is not given; None if it must be.

        Raises:
            InputError: missing, or anything else.
        """
        found = self._get(name, default)
        found = [found] if isinstance(found, str) else found
        if not isinstance(found, list | tuple) or not all(isinstance(one, str) for one in found):
            raise self.error(name, f"must be a list of texts, but is {found!r}.")
        return tuple(found)

    def integer(self, name: str, default: int | None = None, *, least: int = 1) -> int:
        """A whole number.

        Args:
            name: the key.
            default: what it is if it is not given; None if it must be.
            least: the smallest allowed.

        Raises:
            InputError: missing, no whole number, or too small.
        """
        found = self._get(name, default)
        if isinstance(found, bool) or not isinstance(found, int) or found < least:
            raise self.error(name, f"must be a whole number of at least {least}, but is {found!r}.")
        return found

    def flag(self, name: str, default: bool) -> bool:
        """True or false.

        Args:
            name: the key.
            default: what it is if it is not given.

        Raises:
            InputError: anything else.
        """
        found = self._get(name, default)
        if not isinstance(found, bool):
            raise self.error(name, f"must be true or false, without quotes, but is {found!r}.")
        return found

    def quantity(
        self, name: str, default: Any = None, *, units: Sequence[str] | None = None, positive: bool = False
    ) -> Quantity:
        """A number with its unit.

        Args:
            name: the key.
            default: what it is if it is not given, as it would be written; None if it must be.
            units: units of the dimensions that it may have; None for any.
            positive: whether it must be above zero.

        Raises:
            InputError: missing, or no quantity of that dimension.
        """
        found = self._get(name, default)
        try:
            quantity = parse_quantity(found, units, name=name)
        except InputError as error:
            raise self.error(name, str(error)) from error
        if positive and not quantity.value > 0:
            raise self.error(name, f"must be positive, but is {found!r}.")
        return quantity

    def table(self, name: str) -> dict[str, Any]:
        """A table below; empty if it is not given.

        Args:
            name: the key.

        Raises:
            InputError: anything else.
        """
        return self.document.table((*self.key, name))

    def _get(self, name: str, default: Any) -> Any:
        if name in self.data:
            return self.data[name]
        if default is None:
            raise self.error("", f"needs the key {name!r}. Add it.")
        return default
