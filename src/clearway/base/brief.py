"""Values in one line, as `repr` shows them: what they are, and how much of it, never all of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Sized
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import Enum
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np

MOST_CHARACTERS = 180
MOST_OF_TEXT = 40
FEW = 3
"""Numbers of an array that are shown one by one."""


def brief(value: Any) -> str:
    """One line about a dataclass or named tuple: the fields that differ from their defaults.

    Arrays show their shape, collections their length, other values their type. Serves as
    `__repr__ = brief` in the class.
    """
    if is_dataclass(value):
        told = [field for field in fields(value) if field.repr and not _usual(field, value)]
        pairs = [(field.name, getattr(value, field.name)) for field in told]
    else:
        pairs = list(zip(value._fields, value, strict=True))
    return one_line(type(value).__name__, (f"{name}={in_brief(inner)}" for name, inner in pairs))


def one_line(name: str, parts: Iterable[str]) -> str:
    """Name(part, part ...), cut where it would be too long."""
    inside = " ".join(", ".join(parts).split())
    room = MOST_CHARACTERS - len(name) - 2
    if len(inside) > room:
        inside = inside[: room - 4] + " ..."
    return f"{name}({inside})"


def runs(names: Sequence[str]) -> str:
    """Names in a row with repeats counted: 2 x Left, 8 x Straight."""
    counted = ((name, len(list(group))) for name, group in groupby(names))
    return ", ".join(name if count == 1 else f"{count} x {name}" for name, count in counted)


def in_brief(value: Any) -> str:
    """A value within the line of another."""
    match value:
        case Enum():
            return value.name.lower()
        case bool() | int() | None:
            return str(value)
        case float():
            return f"{value:g}"
        case str():
            return repr(value if len(value) <= MOST_OF_TEXT else value[: MOST_OF_TEXT - 4] + " ...")
        case np.ndarray():
            return _array(value)
        case partial():
            return in_brief(value.func)
        case Mapping() | tuple() | list() | set() | frozenset() if not hasattr(value, "_fields"):
            return _collection(value)
    return getattr(value, "__name__", type(value).__name__)


def _array(values: np.ndarray[Any, Any]) -> str:
    if values.ndim == 1 and values.size <= FEW and values.dtype.kind in "biuf":
        return "[" + ", ".join(f"{number:g}" for number in values) + "]"
    return "[" + " x ".join(map(str, values.shape)) + "]"


def _collection(values: Sized) -> str:
    if isinstance(values, tuple) and 0 < len(values) <= FEW:
        return "(" + ", ".join(in_brief(one) for one in values) + ")"
    return f"{len(values)} of {type(values).__name__}"


def _usual(field: Field[Any], value: object) -> bool:
    """Whether a field has its default, as far as looking tells."""
    inner = getattr(value, field.name)
    if field.default is not MISSING:
        usual = field.default
    elif field.default_factory is not MISSING:
        usual = field.default_factory()
    else:
        return False
    if isinstance(usual, np.ndarray) or isinstance(inner, np.ndarray):
        return bool(np.array_equal(np.asarray(usual), np.asarray(inner)))
    try:
        return inner is usual or bool(type(inner) is type(usual) and inner == usual)
    except ValueError:  # Arrays within.
        return False
