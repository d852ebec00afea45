"""TOML files into typed sections, all problems of a file at once."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from clearway.base.brief import in_brief, one_line
from clearway.base.errors import InputError, naming
from clearway.io.toml_problems import name_place, problems_of, show_value

SMALLEST = 1e-30
LARGEST = 1e30
"""Of numbers in files of our own, in any unit."""
MOST_VALUES = 500_000
"""Of a file of our own, tables and lists too: what is larger is a map or a point cloud."""
MOST_PRINTED_PROBLEMS = 50
"""Problems of one file that are reported; of more, how many there are."""
SHORT_LIST = 20
SHORT_TABLE = 200
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
        strange = list(islice(_out_of_reason(data), MOST_PRINTED_PROBLEMS))
        if strange:
            raise InputError(source, strange)
    context = {"folder": folder}
    try:
        return model.model_validate(data, context=context)
    except ValidationError as error:
        count = error.error_count()
        problems = problems_of(error, data, model) if count <= MOST_PRINTED_PROBLEMS else []
    if count > MOST_PRINTED_PROBLEMS:  # each of millions would be put into words
        problems = _first_problems(data, model, context)[:MOST_PRINTED_PROBLEMS]
        problems.append(f"{count} problems in all")
    raise InputError(source, problems)


def each_parsed(
    source: str, place: str, values: object, model: type[Model]
) -> Iterator[tuple[Any, Model]]:
    """Entries of a list or table as `model` one by one, with numbers or keys: no long one is held
    twice.

    What is wrong is reported as by `parse_model` after the last one, or once there is much of it.
    """
    if not isinstance(values, (list, Mapping)):
        raise InputError(source, f"{place}: should be a list, got {show_value(values)}")
    problems: list[str] = []
    for key, value in values.items() if isinstance(values, Mapping) else enumerate(values):
        try:
            found = model.model_validate(value)
        except ValidationError as error:
            problems += _problems_of_entry(name_place([key], place), error, value, model)
            if len(problems) >= MOST_PRINTED_PROBLEMS:
                raise InputError(
                    source, [*problems[:MOST_PRINTED_PROBLEMS], "and perhaps more"]
                ) from None
        else:
            yield key, found
    if problems:
        raise InputError(source, problems)


def _problems_of_entry(
    place: str, error: ValidationError, value: object, model: type[BaseModel]
) -> list[str]:
    if error.error_count() <= MOST_PRINTED_PROBLEMS:
        return problems_of(error, value, model, place)
    return _first_problems(value, model, None, place)


def _first_problems(
    data: object, model: type[BaseModel], context: Any, root: str = ""
) -> list[str]:
    """Problems of the data with every long list and table cut short."""
    short = _shorten(data)
    if isinstance(data, Mapping) and isinstance(short, dict):
        short |= {key: _shorten(data[key]) for key in model.model_fields if key in data}
    try:
        model.model_validate(short, context=context)
    except ValidationError as error:
        return problems_of(error, short, model, root)
    return []


def _shorten(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _shorten(inner) for key, inner in islice(value.items(), SHORT_TABLE)}
    if isinstance(value, (list, tuple)):
        return [_shorten(inner) for inner in value[:SHORT_LIST]]
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
    with naming(path, "read"):
        content = Path(path).read_bytes()
    if not content:
        raise InputError(str(path), "the file is empty (0 bytes)")
    return parse_toml(str(path), content)


def parse_toml(source: str, content: bytes) -> dict[str, Any]:
    """Plain tables of TOML text; InputError naming the source where it is none."""
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as cause:
        raise InputError(source, f"no TOML file: byte {cause.start} is not UTF-8 text") from cause
    except tomllib.TOMLDecodeError as cause:
        raise InputError(source, f"no valid TOML: {cause}") from cause
    except RecursionError as cause:
        raise InputError(source, "no valid TOML: nested too deeply") from cause
    except ValueError as cause:  # whole numbers of thousands of digits
        raise InputError(source, f"no valid TOML: {_too_long(cause)}") from cause


def _too_long(cause: ValueError) -> str:
    """What is wrong, without what Python advises its programmers to call."""
    digits = re.search(r"value has (\d+) digits", str(cause))
    return f"a number of {digits[1]} digits" if digits else str(cause)


def _out_of_reason(value: object, parts: tuple[int | str, ...] = ()) -> Iterator[str]:
    """Places of finite numbers whose squares or inverses a float cannot hold."""
    if isinstance(value, (int, float)):
        said_elsewhere = isinstance(value, float) and not math.isfinite(value)
        if value and not said_elsewhere and not SMALLEST <= abs(value) <= LARGEST:
            yield (
                f"{name_place(parts)}: should be 0, or between {SMALLEST:g} and {LARGEST:g} in size"
            )
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _out_of_reason(inner, (*parts, key))
    elif isinstance(value, (list, tuple)):
        for number, inner in enumerate(value):
            yield from _out_of_reason(inner, (*parts, number))
