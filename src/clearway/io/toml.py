"""TOML files into typed sections, all problems of a file at once; and plain values into TOML."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence, Sized
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from clearway.base.brief import in_brief, one_line
from clearway.base.errors import InputError, naming
from clearway.base.suggest import did_you_mean

SMALLEST, LARGEST = 1e-30, 1e30
"""Of numbers in files of our own, in any unit."""
MOST_VALUES = 500_000
"""Of a file of our own, tables and lists too: what is larger is a map or a point cloud."""
TOLD = 50
"""Problems of one file that are told; of more, how many there are."""
SHORT_LIST, SHORT_TABLE = 20, 200
"""Entries that are looked at again where nearly all are wrong."""


class Section(BaseModel):
    """A table of a file: no unknown keys, no guessed types, no NaN or infinity."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    def __repr__(self) -> str:
        given = (n for n in type(self).model_fields if n in self.model_fields_set)
        return one_line(type(self).__name__, (f"{n}={in_brief(getattr(self, n))}" for n in given))

    __str__ = __repr__


Model = TypeVar("Model", bound=BaseModel)


def read_model(path: str | Path, model: type[Model]) -> Model:
    """The TOML file as `model`; modules that it names are looked for beside it.

    Raises InputError with one line for each problem in the file: the key's path, what is wrong,
    what was given and what is valid.
    """
    return parse_model(str(path), read_toml(path), model, Path(path).parent)


def parse_model(
    source: str, data: Mapping[str, Any], model: type[Model], folder: Path | None = None
) -> Model:
    """Plain tables as `model`; `source` names them in the InputError.

    folder: where modules that they name are looked for before the current one.
    """
    if issubclass(model, Section):
        refuse_many(source, data, "so many obstacles as a map or a point cloud of its own")
        strange = list(islice(_out_of_reason(data), TOLD))
        if strange:
            raise InputError(source, strange)
    context = {"folder": folder}
    try:
        return model.model_validate(data, context=context)
    except ValidationError as error:
        count = error.error_count()
        problems = _problems(error, data, model) if count <= TOLD else []
    if count > TOLD:  # each of millions would be put into words
        problems = _first_problems(data, model, context)[:TOLD]
        problems.append(f"{count} problems in all")
    raise InputError(source, problems)


def each_parsed(
    source: str, place: str, values: object, model: type[Model]
) -> Iterator[tuple[Any, Model]]:
    """Entries of a list or table as `model` one by one, with numbers or keys: no long one is held
    twice.

    What is wrong is told as by `parse_model` after the last one, or once there is much of it.
    """
    if not isinstance(values, (list, Mapping)):
        raise InputError(source, f"{place}: should be a list, got {_shown(values)}")
    problems: list[str] = []
    for key, value in values.items() if isinstance(values, Mapping) else enumerate(values):
        try:
            found = model.model_validate(value)
        except ValidationError as error:
            problems += _problems_of_entry(_place([key], place), error, value, model)
            if len(problems) >= TOLD:
                raise InputError(source, [*problems[:TOLD], "and perhaps more"]) from None
        else:
            yield key, found
    if problems:
        raise InputError(source, problems)


def _problems_of_entry(
    place: str, error: ValidationError, value: object, model: type[BaseModel]
) -> list[str]:
    if error.error_count() <= TOLD:
        return _problems(error, value, model, place)
    return _first_problems(value, model, None, place)


def _first_problems(
    data: object, model: type[BaseModel], context: Any, root: str = ""
) -> list[str]:
    """Problems of the data with every long list and table cut short."""
    short = _shortened(data)
    if isinstance(data, Mapping) and isinstance(short, dict):
        short |= {key: _shortened(data[key]) for key in model.model_fields if key in data}
    try:
        model.model_validate(short, context=context)
    except ValidationError as error:
        return _problems(error, short, model, root)
    return []


def _shortened(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _shortened(inner) for key, inner in islice(value.items(), SHORT_TABLE)}
    if isinstance(value, (list, tuple)):
        return [_shortened(inner) for inner in value[:SHORT_LIST]]
    return value


def refuse_many(source: str, data: object, valid: str) -> None:
    """Raise InputError for a file of more values than any of its kind can need; valid: instead."""
    if _values_in(data) > MOST_VALUES:
        raise InputError(source, f"more than {MOST_VALUES:,} values in it; valid: {valid}")


def _values_in(data: object) -> int:
    """How many tables, lists and values there are, as far as that is allowed."""
    count, waiting = 0, [data]
    while waiting and count + len(waiting) <= MOST_VALUES:
        value = waiting.pop()
        count += 1
        if isinstance(value, Mapping):
            waiting.extend(value.values())
        elif isinstance(value, (list, tuple)):
            waiting.extend(value)
    return count + len(waiting)


def read_toml(path: str | Path) -> dict[str, Any]:
    """Plain tables of a TOML file; InputError with line and column where it is none."""
    try:
        with naming(path, "read"):
            text = Path(path).read_bytes().decode("utf-8-sig")
            tables = tomllib.loads(text)
    except UnicodeDecodeError as cause:
        raise InputError(
            str(path), f"no TOML file: byte {cause.start} is not UTF-8 text"
        ) from cause
    except tomllib.TOMLDecodeError as cause:
        raise InputError(str(path), f"no valid TOML: {cause}") from cause
    except RecursionError as cause:
        raise InputError(str(path), "no valid TOML: nested too deeply") from cause
    except ValueError as cause:  # whole numbers of thousands of digits
        if isinstance(cause, InputError):
            raise
        raise InputError(str(path), f"no valid TOML: {cause}") from cause
    return tables


def _out_of_reason(value: object, parts: tuple[int | str, ...] = ()) -> Iterator[str]:
    """Places of finite numbers whose squares or inverses a float cannot hold."""
    if isinstance(value, (int, float)):
        said_elsewhere = isinstance(value, float) and not math.isfinite(value)
        if value and not said_elsewhere and not SMALLEST <= abs(value) <= LARGEST:
            yield (f"{_place(parts)}: should be 0, or between {SMALLEST:g} and {LARGEST:g} in size")
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _out_of_reason(inner, (*parts, key))
    elif isinstance(value, (list, tuple)):
        for number, inner in enumerate(value):
            yield from _out_of_reason(inner, (*parts, number))


def _problems(
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
        place = _place(parts, root)
        message = _message(item, model)
        if message not in by_place.setdefault(place, []):
            by_place[place].append(message)
        if item["type"] not in ("missing", "extra_forbidden", "value_error"):
            given[place] = f", got {_shown(item['input'])}"
    return [
        (f"{place}: " if place else "")
        + " or ".join(messages).replace(" or should be", " or")
        + given.get(place, "")
        for place, messages in by_place.items()
    ]


def _follows_from_others(item: Any) -> bool:
    """Whether a list only lacks entries because they are wrong themselves, which is said there."""
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


def _place(parts: Sequence[int | str], root: str = "") -> str:
    text = root
    for part in parts:
        text += f"[{part}]" if isinstance(part, int) else f".{_key(part)}" if text else _key(part)
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


def _shown(value: object) -> str:
    try:
        text = json.dumps(value, ensure_ascii=False)
    except (TypeError, ValueError):
        text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


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
            yield f"{_key(key)} = {_value(value)}"
    for key, value in later:
        inner = (*path, key)
        name = ".".join(_key(part) for part in inner)
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


def _key(key: str) -> str:
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
            pairs = (f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None)
            return "{" + ", ".join(pairs) + "}"
        case list() | tuple():
            return "[" + ", ".join(_value(one) for one in value) + "]"
    raise TypeError(f"no TOML value: {value!r}")


def _text(text: str) -> str:
    """A basic TOML string: JSON's escapes, and those of the control characters it lets pass."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
