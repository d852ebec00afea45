"""Calls of the compiled core, each made a second time by the Python that it was made from.

    python tests/support/checked_core.py numba fly static-obstacles    # a command of clearway
    CLEARWAY_CHECKED=numba pytest -p checked_core tests/obstacles      # tests, as a plugin

Each loop that Python calls is called with copies of its arguments too, compiled by numba or as
plain Python. Results, errors and arrays written must be equal: by numba to the bit, but for the
payload of NaN; by Python to a part in 10^12, since NumPy adds in another order.
"""

from __future__ import annotations

import functools
import os
import sys
from collections import Counter
from collections.abc import Callable
from types import FunctionType
from typing import Any, Literal

import numpy as np

Reference = Literal["numba", "python"]
UNFILLED = {"clearway.obstacles.near_cells.near_cells"}
"""Loops that return room for others to fill: whatever was there before is in it."""
CHECKED = "CLEARWAY_CHECKED"
"""Of the environment: the reference of the first calls in every process that loads this module."""
WITHIN = {"numba": 0.0, "python": 1e-12}
"""Of numbers, how far they may be apart, as a share of them where they are above 1."""


class DiffersError(AssertionError):
    """The core gives something else than the Python that it was made from."""


class CheckedLoop:
    """A function of the core, compared at each of its first calls."""

    def __init__(self, function: FunctionType, core: Callable[..., Any], book: Book) -> None:
        functools.update_wrapper(self, function)
        self._function, self._core, self._book = function, core, book
        self.name = f"{function.__module__}.{function.__name__}"
        self.reference: Callable[..., Any] | None = None

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        if self._book.calls[self.name] >= self._book.most_calls:
            return self._core(*arguments, **named)
        self._book.calls[self.name] += 1
        given = (arguments, named)
        again: Any = _copied(given, {})
        answer = _outcome(self._core, *given)
        expected = _outcome(self._book.reference_of(self), *again)
        if self.name not in UNFILLED:
            self._book.compare(self.name, "result", answer, expected)
        self._book.compare(self.name, "argument", given, again)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def made_of(self, known: dict[str, Any]) -> FunctionType:
        """Its Python, with other globals."""
        function = self._function
        return FunctionType(
            function.__code__, known, function.__name__, function.__defaults__, function.__closure__
        )


class Book:
    """All checked loops, their references, and how often each was compared."""

    def __init__(self, reference: Reference, most_calls: int = sys.maxsize) -> None:
        self.calls: Counter[str] = Counter()
        self.most_calls = most_calls
        self._reference = reference
        self._loops: list[CheckedLoop] = []
        self._known: dict[str, dict[str, Any]] = {}

    def open(self) -> None:
        """Check whatever is decorated from now on; before any other import of clearway."""
        import clearway.base.compiled as module

        bound = module.compiled

        def checked(function: Any) -> Any:
            return self.add(CheckedLoop(function, bound(function), self))

        module.compiled = checked  # type: ignore[assignment]

    def add(self, loop: CheckedLoop) -> CheckedLoop:
        """Compare a loop from now on."""
        self._loops.append(loop)
        return loop

    def reference_of(self, loop: CheckedLoop) -> Callable[..., Any]:
        """The same loop by numba or Python, which calls such loops alone."""
        if loop.reference is None:
            self._refer()
        assert loop.reference is not None
        return loop.reference

    def compare(self, name: str, where: str, one: Any, other: Any) -> None:
        """Raise DiffersError where a value is not the other."""
        if isinstance(one, tuple | dict):
            equal = isinstance(other, type(one)) and len(one) == len(other)
            named = one if isinstance(one, dict) else getattr(one, "_asdict", lambda: {})()
            parts = list(named) or range(len(one))
            if equal:
                pairs = ((_values(one)), (_values(other)))
                for part, mine, theirs in zip(parts, *pairs, strict=True):
                    self.compare(name, f"{where}.{part}", mine, theirs)
        elif isinstance(one, Exception) or isinstance(other, Exception):
            equal = type(one) is type(other)
        else:
            within = WITHIN[self._reference]
            equal = _kind(one) is _kind(other) and _are_equal(one, other, within)
        if not equal:
            raise DiffersError(f"{name}: {where} is {_in_words(one, other)} by its Python")

    def _refer(self) -> None:
        """Give every loop a reference: its function, in globals where all loops are references."""
        for loop in self._loops:
            if loop.reference is None:
                known = self._known.setdefault(loop.__module__, {})
                made = loop.made_of(known)
                loop.reference = _by_numba(made) if self._reference == "numba" else made
        for name, known in self._known.items():
            for key, value in vars(sys.modules[name]).items():
                known[key] = value.reference if isinstance(value, CheckedLoop) else value


def _by_numba(function: FunctionType) -> Callable[..., Any]:
    import numba

    made: Callable[..., Any] = numba.njit(error_model="numpy")(function)
    return made


def _outcome(function: Callable[..., Any], arguments: Any, named: Any) -> Any:
    try:
        return function(*arguments, **named)
    except Exception as problem:
        return problem


def _copied(value: Any, made: dict[int, bytearray]) -> Any:
    """A deep copy; arrays that share memory share it in the copy, and keep their layout."""
    if isinstance(value, np.ndarray):
        owner = value
        while isinstance(owner.base, np.ndarray):
            owner = owner.base
        if not (owner.flags.c_contiguous or owner.flags.f_contiguous):
            return value.copy()
        memory = made.setdefault(id(owner), bytearray(owner.tobytes(order="A")))
        offset = value.ctypes.data - owner.ctypes.data
        twin = np.ndarray(value.shape, value.dtype, memory, offset, value.strides)
        twin.setflags(write=value.flags.writeable)
        return twin
    if isinstance(value, tuple):
        parts = [_copied(one, made) for one in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if isinstance(value, dict):
        return {key: _copied(one, made) for key, one in value.items()}
    return value


def _values(parts: Any) -> Any:
    return parts.values() if isinstance(parts, dict) else parts


def _in_words(one: Any, other: Any) -> str:
    """Both values; of arrays, the first place where they differ."""
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray) and one.shape == other.shape:
        places = np.argwhere(~((one == other) | ((one != one) & (other != other))))
        if len(places):
            first = tuple(places[0].tolist())
            more = f"at {len(places)} of {one.size} places, first {first}: "
            return f"{more}{one[first]!r}, and {other[first]!r}"
    return f"{one!r}, and {other!r}"


def _kind(value: Any) -> type:
    """The kind of a number, whichever library made it."""
    kinds = ((bool, np.bool_), (int, np.integer), (float, np.floating))
    return next((kind for kind, its in kinds if isinstance(value, kind | its)), type(value))


def _are_equal(one: Any, other: Any, within: float) -> bool:
    """Whether two arrays or numbers are; a zero is not one of another sign."""
    one, other = np.asarray(one), np.asarray(other)
    if one.dtype != other.dtype or one.shape != other.shape:
        return False
    if one.dtype.kind != "f":
        return np.array_equal(one, other)
    equal = (one == other) & (np.signbit(one) == np.signbit(other))
    if within:
        with np.errstate(invalid="ignore"):
            equal |= np.abs(one - other) <= within * np.maximum(1.0, np.abs(one))
    return bool((equal | (np.isnan(one) & np.isnan(other))).all())


def main(arguments: list[str]) -> int:
    """Run a command, then print how many loops were compared, and how often."""
    book = Book(arguments[0])  # type: ignore[arg-type]
    book.open()
    from clearway.__main__ import main as run

    sys.argv = ["clearway", *arguments[1:]]
    ended = 0
    try:
        run()
    except SystemExit as end:
        ended = int(end.code or 0)
    print(f"{len(book.calls)} loops compared, {book.calls.total()} calls", file=sys.stderr)
    return ended


if CHECKED in os.environ:
    Book(os.environ[CHECKED], most_calls=20).open()  # type: ignore[arg-type]

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
