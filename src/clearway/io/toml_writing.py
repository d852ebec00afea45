"""Plain values and models into TOML that reads back as the same values."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel


def write_toml(data: BaseModel | Mapping[str, Any], path: str | Path) -> None:
    """Write a model or plain tables, such that `tomllib` reads the same values back.

    Values: text, whole and real numbers, booleans, lists or tuples of values, tables. A None is
    left out, since TOML has none; paths become text.
    """
    Path(path).write_text(dump_toml(data), encoding="utf-8", newline="\n")


def dump_toml(data: BaseModel | Mapping[str, Any]) -> str:
    """The TOML text that `write_toml` writes."""
    tables = data.model_dump(exclude_none=True) if isinstance(data, BaseModel) else data
    return "\n".join(_table_lines(tables, ())).lstrip("\n") + "\n"


def _table_lines(table: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    """Lines of one table: its plain values first, then its tables, as TOML demands."""
    later: list[tuple[str, Any]] = []
    for key, value in table.items():
        if value is None:
            continue
        if isinstance(value, Mapping) or _is_table_array(value):
            later.append((key, value))
        else:
            yield f"{key_text(key)} = {_value(value)}"
    for key, value in later:
        inner = (*path, key)
        name = ".".join(key_text(part) for part in inner)
        brackets, tables = ("[{}]", [value]) if isinstance(value, Mapping) else ("[[{}]]", value)
        for one in tables:
            yield ""
            yield brackets.format(name)
            yield from _table_lines(one, inner)


def _is_table_array(value: object) -> bool:
    return (
        isinstance(value, (list, tuple))
        and len(value) > 0
        and all(isinstance(one, Mapping) for one in value)
    )


def key_text(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)


def _value(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case int():
            return str(int(value))
        case float():
            return repr(float(value))
        case str() | Path():
            return _text(str(value))
        case Mapping():
            pairs = (f"{key_text(k)} = {_value(v)}" for k, v in value.items() if v is not None)
            return "{" + ", ".join(pairs) + "}"
        case list() | tuple():
            return "[" + ", ".join(_value(one) for one in value) + "]"
    raise TypeError(f"no TOML value: {value!r}")


def _text(text: str) -> str:
    """A basic TOML string: JSON's escapes, and those of the control characters it lets pass."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
