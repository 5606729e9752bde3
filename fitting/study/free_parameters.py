"""The free parameters of a study file: bounds with units, scale, prior, ties.

[free]
"plant.mass" = { lower = "10 kg", upper = "1000 kg", scale = "log" }
"plant.friction.coulomb" = { lower = "0 N", upper = "200 N", prior = ["20 N", "5 N"] }
"""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

from twin._checks import InputError
from twin.io.model_types import unit_of_leaf
from twin.io.quantity import Quantity, parse_quantity
from twin.io.toml_document import Key, TomlDocument, unknown
from twin.io.toml_table import TomlTable
from twin.parameters import Parameter, ParameterSpace
from twin.paths import get_leaf, leaf_paths

_KEYS = ("lower", "upper", "scale", "size", "prior", "tied")


def free_parameters(document: TomlDocument, model: Any) -> ParameterSpace:
    """Read the table [free].

    Args:
        document: the study file.
        model: the model that the paths lead into.

    Raises:
        InputError: naming file, line and key: no parameter, an unknown path, bounds of another dimension or reversed, a
            start outside of them.
    """
    parameters = [_parameter(document, key, model) for key in _entries(document, ("free",))]
    if not parameters:
        raise document.error(
            ("free",),
            'no parameter is free. Add [free] with lines such as "mass" = { lower = "1 kg", upper = "9 kg" }.',
        )
    space = _checked(document, (), lambda: ParameterSpace(parameters))
    for parameter, key in zip(parameters, _entries(document, ("free",)), strict=True):
        _checked(document, key, lambda p=parameter: ParameterSpace([p]).check_start(model))
    return space


def free_text(space: ParameterSpace, data: Sequence[str], held: Sequence[str] = ()) -> str:
    """What a fit is asked, in a sentence.

    Args:
        space: the free parameters.
        data: names of the data sets.
        held: names of those held back.
    """
    fitted = [name for name in data if name not in held]
    told = f"Estimate {len(space)} parameters from {', '.join(fitted)}."
    return told + (f" Predict {', '.join(held)} with them." if held else "")


def without_prefix(space: ParameterSpace, prefix: str) -> ParameterSpace:
    """The space of a part of the model.

    Args:
        space: the free parameters of the whole.
        prefix: path of the part, with its dot.

    Raises:
        InputError: a parameter that is not in that part.
    """
    for parameter in space.parameters:
        if not all(path.startswith(prefix) for path in (parameter.path, *parameter.tied)):
            raise InputError(
                f"{parameter.path} is not in {prefix[:-1]!r}, which alone is searched. Remove it from [free]."
            )
    return ParameterSpace(
        dataclasses.replace(
            p, path=p.path.removeprefix(prefix), tied=tuple(path.removeprefix(prefix) for path in p.tied)
        )
        for p in space.parameters
    )


def _entries(document: TomlDocument, key: Key) -> Iterator[Key]:
    """Keys of the tables with bounds, also where a path was not quoted and became nested tables."""
    for name, value in document.table(key).items():
        if not isinstance(value, dict):
            raise document.error(
                (*key, name), f'must be a table such as {{ lower = "1 kg", upper = "9 kg" }}, but is {value!r}.'
            )
        nested = value and all(isinstance(inner, dict) for inner in value.values())
        if nested:
            yield from _entries(document, (*key, name))
        else:
            yield (*key, name)


def _parameter(document: TomlDocument, key: Key, model: Any) -> Parameter:
    path = ".".join(str(name) for name in key[1:])
    try:
        get_leaf(model, path)
    except InputError as error:
        there = leaf_paths(model)
        told = unknown("path", path, there) if path not in there else str(error)
        raise document.error(key, told) from error
    table = TomlTable(document, key, _KEYS)
    units = unit_of_leaf(model, path)
    lower, upper = _bound(table, "lower", units), _bound(table, "upper", units)
    given = [bound for bound in (lower, upper) if bound is not None]
    if len({bound.unit for bound in given if bound.value not in (0.0, float("inf"), float("-inf"))}) > 1:
        raise table.error("upper", f"has the unit {given[1].unit}, but lower has {given[0].unit}. Use one dimension.")
    # Zero is read in the first unit that the place may have: the other bound knows better.
    unit = next((bound.unit for bound in reversed(given) if bound.value != 0), given[0].unit if given else "")
    prior: tuple[float, float] | None = None
    if "prior" in table:
        pair = table.data["prior"]
        if not isinstance(pair, list) or len(pair) != 2:
            raise table.error("prior", f'must be a mean and a standard deviation, ["80 kg", "5 kg"], but is {pair!r}.')
        mean, deviation = (_quantity(document, (*key, "prior"), one, units).value for one in pair)
        prior = mean, deviation
    return _checked(
        document,
        key,
        lambda: Parameter(
            path,
            unit,
            -float("inf") if lower is None else lower.value,
            float("inf") if upper is None else upper.value,
            scale=table.text("scale", "linear", choices=("linear", "log")),
            size=table.quantity("size", units=units).value if "size" in table else None,
            prior=prior,
            tied=table.texts("tied", ()),
        ),
    )


def _bound(table: TomlTable, name: str, units: tuple[str, ...] | None) -> Quantity | None:
    return table.quantity(name, units=units) if name in table else None


def _quantity(document: TomlDocument, key: Key, written: Any, units: tuple[str, ...] | None) -> Quantity:
    return _checked(document, key, lambda: parse_quantity(written, units, name=str(key[-1])))


def _checked(document: TomlDocument, key: Key, make: Any) -> Any:
    try:
        return make()
    except InputError as error:
        if str(document.file) in str(error):
            raise
        raise document.error(key, str(error)) from error
