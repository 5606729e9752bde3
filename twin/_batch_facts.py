"""What a study depends on, and what of it was changed since it began."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from twin._checks import InputError
from twin._fingerprint import function_facts, function_name, platform, samples_digest, versions
from twin.store import Store

_NAMED = 3
"""Changed parts of a function that a message names."""


def facts_of(
    fn: Callable[..., Any],
    retry: Callable[..., Any] | None,
    samples: Any,
    count: int,
    order: np.ndarray,
    seed: int | None,
    mode: str,
) -> dict[str, Any]:
    """What a study depends on, for its manifest."""
    parts, packages = function_facts(fn)
    second = None
    if retry is not None:
        retry_parts, more = function_facts(retry)
        second = {"name": function_name(retry), "parts": retry_parts}
        packages |= more
    return {
        "function": {"name": function_name(fn), "mode": mode, "parts": parts},
        "retry": second,
        "samples": {"count": count, "digest": samples_digest(samples)},
        "order": samples_digest(order),
        "seed": None if seed is None else int(seed),
        "dtype": "float64",
        "platform": platform(),
        "versions": {**versions(), **packages},
    }


def require_same(store: Store, facts: dict[str, Any]) -> None:
    """Raise unless the study in a folder is the one that is to go on.

    Args:
        store: the study.
        facts: those of the one that is to go on.

    Raises:
        InputError: it is another one; the message says what was changed.
    """
    changed = list(_changes(store.manifest, facts))
    if changed:
        raise InputError(
            f"{store.folder} holds another study: {'; '.join(changed)}. "
            "Give another folder as store, or undo the change."
        )


def _changes(old: dict[str, Any], new: dict[str, Any]) -> Iterator[str]:
    for key, what in (("function", "the function"), ("retry", "the function of the second try")):
        yield from _changes_of_function(what, old[key] or {}, new[key] or {})
    was, now = old["samples"], new["samples"]
    if was["count"] != now["count"]:
        yield f"there were {was['count']:,} samples and are {now['count']:,} now"
    elif was != now:
        yield "the names or values of the samples were changed"
    elif old["order"] != new["order"]:
        yield "difficulty was changed, and with it the order of the samples"
    for key, what in (("seed", "seed"), ("dtype", "dtype"), ("platform", "the platform")):
        if old[key] != new[key]:
            yield f"{what} was {old[key]} and is {new[key]} now"
    for name, version in new["versions"].items():
        if old["versions"].get(name) != version:
            yield f"{name} was {old['versions'].get(name, 'not used')} and is {version} now"


def _changes_of_function(what: str, was: dict[str, Any], now: dict[str, Any]) -> Iterator[str]:
    if was.get("name") != now.get("name"):
        yield f"{what} was {was.get('name', 'none')} and is {now.get('name', 'none')} now"
        return
    if was.get("mode") != now.get("mode"):
        yield f"mode was {was['mode']} and is {now['mode']} now"
    old, new = was.get("parts", {}), now.get("parts", {})
    parts = sorted(part for part in old.keys() | new.keys() if old.get(part) != new.get(part))
    if parts:
        more = f" and {len(parts) - _NAMED} more parts" if len(parts) > _NAMED else ""
        yield f"{what} {now['name']} was changed: {', '.join(parts[:_NAMED])}{more}"
