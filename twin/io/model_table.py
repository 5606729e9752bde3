"""From a table of a TOML file to a model: types by name, their arguments as quantities with units, tables as parts.

    [model]
    type = "SampledLoop"
    period = "1 ms"
    [model.plant]
    type = "ServoAxis"
    mass = "80 kg"
    friction = { type = "CoulombViscousFriction", coulomb = "10 N", viscous = "100 N s/m", width = "1 mm/s" }

A part that is like another one is written `train_2 = { like = "train_1" }`, with what differs. `set` changes numbers
deeper in the model by their paths. The keys are the dotted paths that parameters are named by.
"""

import copy
import inspect
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import numpy as np

from twin._checks import InputError
from twin.io.class_fields import FieldFacts, facts_of
from twin.io.model_types import default_type, type_named, unit_of_leaf
from twin.io.quantity import parse_quantity
from twin.io.toml_document import Key, TomlDocument, unknown
from twin.paths import get_leaf, set_leaves

_OWN = ("type", "like", "set")


def build_model(document: TomlDocument, key: Key = ("model",), *, kind: Any = None) -> Any:
    """Build what a table describes.

    Args:
        document: the file.
        key: where the table stands.
        kind: class of which it must be, None for any.

    Returns:
        A drive, loop, law, reference or whatever the type is.

    Raises:
        InputError: naming file, line and key: unknown type or argument, one that is missing, a quantity without a unit
            or of another dimension, values that the type refuses.
    """
    return _Builder(document, key).build(key, kind)


class _Builder:
    def __init__(self, document: TomlDocument, root: Key):
        self.document, self.root = document, root

    def build(self, key: Key, kind: Any) -> Any:
        table = self._with_likes(key, self.document.table(key, required=True))
        return self._of_table(key, table, kind)

    def _of_table(self, key: Key, table: Mapping[str, Any], kind: Any) -> Any:
        document = self.document
        named = table.get("type")
        if named is not None and not isinstance(named, str):
            raise document.error((*key, "type"), f'must be the name of a type, such as "ServoAxis", but is {named!r}.')
        try:
            made = default_type(kind) if named is None else type_named(named, kind)
            if made is None:
                raise InputError("needs a type: " + unknown("type", "", _choices(kind)).partition("; ")[2])
        except InputError as error:
            raise document.error((*key, "type") if named else key, str(error)) from error
        facts = facts_of(made)
        for name in table:
            if name not in facts and name not in _OWN:
                raise document.error((*key, name), f"{made.__name__}: {unknown('key', name, facts)}")
        for name, one in facts.items():
            if one.required and name not in table:
                told = f": {one.text}" if one.text else ""
                raise document.error(key, f"{made.__name__} needs the key {name!r}{told} Add it.")
        arguments = {name: self._value((*key, name), table[name], facts[name]) for name in table if name not in _OWN}
        try:
            model = made(**arguments)
        except InputError as error:
            raise document.error(key, f"{made.__name__}: {error}") from error
        except (TypeError, ValueError, AttributeError) as error:
            raise document.error(
                key, f"{made.__name__} cannot be made of these values ({error}). Check the keys of this table."
            ) from error
        return self._with_changes(key, model, table)

    def _value(self, key: Key, written: Any, facts: FieldFacts) -> Any:
        if isinstance(written, dict) and "values" in written and set(written) <= {"values", "unit"}:
            return self._vector(key, written, facts)
        if isinstance(written, dict):
            return self._of_table(key, self._with_likes(key, written), _kind(facts.type))
        if isinstance(written, list) and written and all(isinstance(one, dict) for one in written):
            return tuple(self._of_table((*key, i), one, _inner(facts.type)) for i, one in enumerate(written))
        if facts.static or facts.type is bool:
            return tuple(written) if isinstance(written, list) else written
        if isinstance(written, list):
            return np.asarray([self._quantity((*key, i), one, facts) for i, one in enumerate(written)])
        return self._quantity(key, written, facts)

    def _vector(self, key: Key, written: Mapping[str, Any], facts: FieldFacts) -> np.ndarray:
        unit = written.get("unit", "1")
        flat = written["values"]
        numbers = isinstance(flat, list) and flat and all(isinstance(v, int | float) for v in flat)
        if not numbers or not isinstance(unit, str):
            raise self.document.error(key, 'must be like { values = [1.0, 2.0], unit = "N" }.')
        listed = [f"{value} {unit}" for value in np.ravel(written["values"]).tolist()]
        found = np.asarray([self._quantity(key, one, facts) for one in listed])
        return found.reshape(np.shape(written["values"]))

    def _quantity(self, key: Key, written: Any, facts: FieldFacts) -> float:
        try:
            return parse_quantity(written, facts.units, name=facts.name).value
        except InputError as error:
            told = f" It is: {facts.text}" if facts.text else ""
            raise self.document.error(key, f"{error}{told}") from error

    def _with_changes(self, key: Key, model: Any, table: Mapping[str, Any]) -> Any:
        changes = table.get("set", {})
        if not isinstance(changes, dict):
            raise self.document.error((*key, "set"), 'must be a table of paths and quantities, "spring.k" = "5 N/m".')
        values = {}
        for path, written in changes.items():
            try:
                get_leaf(model, path)
                values[path] = parse_quantity(written, unit_of_leaf(model, path), name=path).value
            except InputError as error:
                raise self.document.error((*key, "set", path), str(error)) from error
        if not values:
            return model
        changed = set_leaves(model, values)
        check_model(changed, lambda message: self.document.error((*key, "set"), message))
        return changed

    def _with_likes(self, key: Key, table: Mapping[str, Any]) -> Mapping[str, Any]:
        """The table with what it is like filled in."""
        if "like" not in table:
            return table
        seen, found = set(), dict(table)
        while isinstance(like := found.pop("like", None), str):
            if like in seen:
                raise self.document.error((*key, "like"), f"goes round in a circle over {like!r}.")
            seen.add(like)
            other: Any = self.document.table(self.root)
            for name in like.split("."):
                other = other.get(name) if isinstance(other, dict) else None
            if not isinstance(other, dict):
                raise self.document.error((*key, "like"), f"there is no table {like!r} in [{self.root[0]}].")
            found = _merged(copy.deepcopy(other), found)
        return found


def check_model(model: Any, error: Any) -> None:
    """Let every part of a model check its values again, as it does when it is made.

    Args:
        model: a model whose numbers were changed.
        error: from a message to the error to raise.

    Raises:
        InputError: made by `error`.
    """
    parts = [model, *_parts(model)]
    for part in parts:
        check = getattr(part, "__check_init__", None)
        if check is None:
            continue
        try:
            check()
        except InputError as problem:
            raise error(str(problem)) from problem


def _parts(model: Any) -> list[Any]:
    found = []
    for value in vars(model).values() if isinstance(model, eqx.Module) else ():
        inner = value if isinstance(value, tuple | list) else [value]
        for one in inner:
            if isinstance(one, eqx.Module):
                found += [one, *_parts(one)]
    return found


def _merged(below: dict[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    for name, value in above.items():
        both = isinstance(value, dict) and isinstance(below.get(name), dict) and "type" not in value
        below[name] = _merged(below[name], value) if both else value
    return below


def _kind(annotation: Any) -> Any:
    """The class that an annotation asks for, also where None is allowed beside it."""
    if inspect.isclass(annotation):
        return annotation
    classes = [one for one in getattr(annotation, "__args__", ()) if inspect.isclass(one) and one is not type(None)]
    return classes[0] if len(classes) == 1 else None


def _inner(annotation: Any) -> Any:
    """The class of the entries of a tuple."""
    inner = [one for one in getattr(annotation, "__args__", ()) if inspect.isclass(one)]
    return inner[0] if inner else None


def _choices(kind: Any) -> list[str]:
    from twin.io.model_types import types_of

    return sorted(types_of(kind))
