"""What compares the core with its Python finds whatever differs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from checked_core import Book, CheckedLoop, DiffersError


class Pair(NamedTuple):
    """Two arrays, as loops take them."""

    first: Any
    second: Any


def fill(pair: Pair, value: float) -> float:
    pair.first[:] = value
    return float(pair.second.sum())


def checked(core: Callable[..., Any]) -> CheckedLoop:
    """`fill` as if a core had been made of it."""
    loop = CheckedLoop(fill, core, Book("numba"))  # type: ignore[arg-type]
    loop.reference = fill
    return loop


def test_what_is_equal_passes_and_is_written_once() -> None:
    shared = np.arange(4.0)
    loop = checked(fill)
    assert loop(Pair(shared[:2], shared[1:]), np.nan) is not None
    np.testing.assert_array_equal(shared, [np.nan, np.nan, 2.0, 3.0])
    assert loop.__name__ == "fill"


WRONG: dict[str, Callable[[Pair, float], object]] = {
    "another result": lambda pair, value: fill(pair, value) + 1e-16 + 1e-15,
    "a zero of another sign": lambda pair, value: -fill(pair, value),
    "a result of another kind": lambda pair, value: int(fill(pair, value)),
    "an array not written": lambda pair, _: float(pair.second.sum()),
    "an array written beyond": lambda pair, value: fill(Pair(pair.second, pair.second), value),
    "an error": lambda pair, value: fill(pair.first, value),
}


@pytest.mark.parametrize("why", WRONG)
def test_what_differs_is_found(why: str) -> None:
    with pytest.raises(DiffersError, match="fill"):
        checked(WRONG[why])(Pair(np.ones(2), np.zeros(2)), 0.0)
