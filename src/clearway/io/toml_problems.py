"""What is wrong with a TOML file, in words of the file: a line a place, with what is valid."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence, Sized
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from clearway.base.suggest import did_you_mean
from clearway.io.toml_writing import key_text


def problems_of(
    error: ValidationError, data: object, model: type[BaseModel], root: str = ""
) -> list[str]:
    """One line a place; the alternatives of a union, which pydantic lists apart, are joined.

    root: where in the file the data stand.
    """
    by_place: dict[str, list[str]] = {}
    given: dict[str, str] = {}
    for item in error.errors(include_url=False):
        if _follows_from_others(item):
            continue
        parts = _path_in_file(item, data)
        place = name_place(parts, root)
        message = _message(item, model)
        if message not in by_place.setdefault(place, []):
            by_place[place].append(message)
        if item["type"] not in ("missing", "extra_forbidden", "value_error"):
            given[place] = f", got {show_value(item['input'])}"
    return [
        (f"{place}: " if place else "")
        + " or ".join(messages).replace(" or should be", " or")
        + given.get(place, "")
        for place, messages in by_place.items()
    ]


def _follows_from_others(item: Any) -> bool:
    """Whether a list only lacks entries because they are wrong themselves, which is stated
    there."""
    given = item["input"]
    short = item["type"] == "too_short" and isinstance(given, Sized)
    return short and item["ctx"]["actual_length"] < len(given)


def _path_in_file(item: Any, data: Any) -> list[int | str]:
    """Where in the file an error is: its location without the names of union members."""
    parts: list[int | str] = []
    location = item["loc"]
    for n, part in enumerate(location):
        missing = item["type"] == "missing" and n == len(location) - 1
        if isinstance(data, Mapping) and (part in data or missing):
            data = data.get(part)
            parts.append(part)
        elif isinstance(data, (list, tuple)) and isinstance(part, int):
            data = data[part] if part < len(data) else None
            parts.append(part)
    return parts


def name_place(parts: Sequence[int | str], root: str = "") -> str:
    text = root
    for part in parts:
        text += (
            f"[{part}]"
            if isinstance(part, int)
            else f".{key_text(part)}"
            if text
            else key_text(part)
        )
    return text


def _message(item: Any, model: type[BaseModel]) -> str:
    """What is wrong and what is valid, in words of the file instead of Python's."""
    kind = item["type"]
    if kind == "extra_forbidden":
        *table, key = item["loc"]
        return _unknown_key(str(key), sorted(_keys_at(model, table)))
    if kind == "missing":
        return "missing, but needed"
    message = str(item["msg"]).removeprefix("Value error, ")
    message = message.replace("Input should", "should").replace("String should", "should")
    message = message.replace(" after validation", "")
    if kind == "literal_error" and isinstance(item["input"], str):
        choices = re.findall(r"'([^']*)'", str(item["ctx"]["expected"]))
        message += did_you_mean(item["input"], choices)
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        message = "should be a table"
    return re.sub(r"(a valid )?(tuple|list)\b", "a list", message, flags=re.IGNORECASE)


def _unknown_key(key: str, valid: list[str]) -> str:
    return f"unknown key{did_you_mean(key, valid)}; valid keys: {', '.join(valid)}"


def _keys_at(model: type[BaseModel], table: Sequence[int | str]) -> set[str]:
    """Valid keys of the table at a location; of every member where it is a union."""
    models = [model]
    for part in table:
        fields = [
            member.model_fields[part]
            for member in models
            if isinstance(part, str) and part in member.model_fields
        ]
        if fields:
            models = [m for field in fields for m in sections_in(field.annotation)]
    return {field.alias or name for member in models for name, field in member.model_fields.items()}


def sections_in(annotation: object) -> Iterator[type[BaseModel]]:
    """Models that the type of a field mentions."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from sections_in(argument)


def show_value(value: object) -> str:
    try:
        text = json.dumps(value, ensure_ascii=False)
    except (TypeError, ValueError):
        text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
