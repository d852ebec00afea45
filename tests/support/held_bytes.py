"""How much memory a value holds: arrays and objects that can be reached from it, each once."""

from __future__ import annotations

import sys
from functools import partial
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

NOT_HELD = (type, ModuleType, FunctionType, BuiltinFunctionType, MethodType)


def held_bytes(value: object, besides: dict[int, object] | None = None) -> int:
    """Bytes that a value holds, but for what is in `besides`, which takes all that was counted."""
    known = {} if besides is None else besides
    waiting, total = [value], 0
    while waiting:
        one = waiting.pop()
        if id(one) in known or isinstance(one, NOT_HELD):
            continue
        known[id(one)] = one
        if isinstance(one, np.ndarray):
            total += 0 if isinstance(one.base, np.ndarray) else one.nbytes
            waiting += [one.base] if isinstance(one.base, np.ndarray) else []
            continue
        total += sys.getsizeof(one)
        waiting += _inside(one)
    return total


def _inside(one: Any) -> list[Any]:
    if isinstance(one, dict):
        return [*one.keys(), *one.values()]
    if isinstance(one, partial):
        return [one.func, *one.args, *one.keywords.values()]
    if isinstance(one, (str, bytes, bytearray, int, float)):
        return []
    items = list(one) if isinstance(one, (list, tuple, set, frozenset)) else []
    if hasattr(one, "maxlen"):
        items += list(one)
    slots = [s for kind in type(one).__mro__ for s in getattr(kind, "__slots__", ())]
    held = [getattr(one, slot) for slot in slots if isinstance(slot, str) and hasattr(one, slot)]
    return [*items, *held, *getattr(one, "__dict__", {}).values()]
