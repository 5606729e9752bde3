"""Summaries as JSON files."""

import json
from pathlib import Path
from typing import Any

import numpy as np


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a summary; numbers that are not finite, which JSON has no word for, become null.

    Args:
        path: the file.
        content: dicts and lists of numbers and text.
    """
    path.write_text(as_json(content) + "\n", encoding="utf-8")


def as_json(content: dict[str, Any]) -> str:
    """The text that `write_json` writes.

    Args:
        content: dicts and lists of numbers and text.
    """
    return json.dumps(_without_nan(content), indent=2, allow_nan=False, ensure_ascii=False)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic):
        return _without_nan(value.tolist())
    if isinstance(value, Path):
        return str(value)
    return None if isinstance(value, float) and not np.isfinite(value) else value
