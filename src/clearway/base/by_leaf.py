"""Compiled loops called from Python with tuples of arrays, each array handed over by itself.

numba looks at every array of every tuple to tell which code to run, and at named tuples far longer
than at what stands by itself: three times as long for a hundred arrays in ten of them, which comes
to a tenth of many a loop. So the tuples are taken apart here, and made again in compiled code.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from functools import wraps
from typing import Any, TypeVar, cast, get_type_hints

from clearway.base.compiled import compiled

Function = TypeVar("Function", bound=Callable[..., Any])


def by_leaf(loop: Function) -> Function:
    """A loop that is called with the same, positional arguments, but for other compiled code.

    Arguments that are said to be named tuples are taken apart as far as they hold others: of
    another kind with as many fields, each would be taken for the one in its place.
    """
    if not hasattr(loop, "py_func"):  # Where numba is told to compile nothing.
        return loop
    function: Any = loop
    made: Callable[..., Any] | None = None

    @wraps(function.py_func)
    def call(*arguments: Any) -> Any:
        nonlocal made
        if made is None:  # Not before: modules that are still loading know not all types.
            made = _taken_apart(loop)
        return made(*arguments)

    return cast(Function, call)


def _taken_apart(loop: Any) -> Callable[..., Any]:
    """What takes the arguments apart, and calls what makes them again for the loop."""
    function = loop.py_func
    kinds, names = get_type_hints(function), list(inspect.signature(function).parameters)
    leaves = (f"leaf_{number}" for number in range(10_000))
    known: dict[str, Any] = {"loop": loop, "__name__": function.__module__}
    again = ", ".join(_made_again(kinds[name], leaves, known) for name in names)
    count = int(next(leaves).removeprefix("leaf_"))
    taken = ", ".join(f"leaf_{number}" for number in range(count))
    name = f"{function.__name__}_by_leaf"
    file = function.__code__.co_filename  # By which compiled code is kept.
    known["by_leaf"] = compiled(_defined(name, taken, f"loop({again})", known, file))
    apart = ", ".join(_apart(kinds[name], name) for name in names)
    return _defined("taken_apart", ", ".join(names), f"by_leaf({apart})", known, file)


def _is_named(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")


def _fields(kind: Any) -> Iterator[tuple[str, Any]]:
    """Names and types."""
    types = get_type_hints(kind)
    return ((name, types[name]) for name in kind._fields)


def _made_again(kind: Any, leaves: Iterator[str], known: dict[str, Any]) -> str:
    """An argument in terms of leaves; `known` is told of all types that it is made of."""
    if not _is_named(kind):
        return next(leaves)
    known[kind.__name__] = kind
    fields = ", ".join(_made_again(each, leaves, known) for _, each in _fields(kind))
    return f"{kind.__name__}({fields})"


def _apart(kind: Any, value: str) -> str:
    """The leaves of an argument."""
    if not _is_named(kind):
        return value
    fields = list(_fields(kind))
    if not any(_is_named(each) for _, each in fields):
        return f"*{value}"
    return ", ".join(_apart(each, f"{value}.{name}") for name, each in fields)


def _defined(
    name: str, arguments: str, returned: str, known: dict[str, Any], file: str
) -> Callable[..., Any]:
    """A function of one line, as if it stood in a file."""
    exec(compile(f"def {name}({arguments}):\n    return {returned}", file, "exec"), known)
    return cast(Callable[..., Any], known[name])
