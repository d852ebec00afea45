"""Sequences that keep little: their items are made when somebody asks for them."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar, overload

import numpy as np

from clearway.base.arrays import FloatArray

S = TypeVar("S")
T = TypeVar("T")


class Made(Sequence[T], Generic[S, T]):
    """Items of another sequence, each made into something else whenever it is asked for."""

    def __init__(self, of: Sequence[S], make: Callable[[S], T]) -> None:
        self._of, self._make = of, make

    def __len__(self) -> int:
        return len(self._of)

    @overload
    def __getitem__(self, at: int) -> T: ...

    @overload
    def __getitem__(self, at: slice) -> Made[S, T]: ...

    def __getitem__(self, at: int | slice) -> T | Made[S, T]:
        if isinstance(at, slice):
            return Made(self._of[at], self._make)
        return self._make(self._of[at])

    def __eq__(self, other: object) -> bool:
        """Whether another sequence has equal items."""
        if not isinstance(other, Sequence) or len(self) != len(other):
            return NotImplemented if not isinstance(other, Sequence) else False
        return all(one == two for one, two in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]


class TimedPlaces(Sequence[tuple[float, FloatArray]]):
    """Times and places [3] of a track, which grows; four numbers each."""

    def __init__(self) -> None:
        self._numbers = array("d")

    def append(self, at: tuple[float, FloatArray]) -> None:
        """Add a time and a place [3]."""
        time_s, place_m = at
        self._numbers.append(time_s)
        self._numbers.extend(place_m.tolist())

    @property
    def rows(self) -> FloatArray:
        """[n, 4] time and place."""
        return np.array(self._numbers, dtype=np.float64).reshape(-1, 4)

    def __len__(self) -> int:
        return len(self._numbers) // 4

    @overload
    def __getitem__(self, at: int) -> tuple[float, FloatArray]: ...

    @overload
    def __getitem__(self, at: slice) -> Sequence[tuple[float, FloatArray]]: ...

    def __getitem__(
        self, at: int | slice
    ) -> tuple[float, FloatArray] | Sequence[tuple[float, FloatArray]]:
        numbers = range(len(self))[at]
        if isinstance(numbers, range):
            return tuple(self[number] for number in numbers)
        time_s, *place_m = self._numbers[4 * numbers : 4 * numbers + 4]
        return time_s, np.array(place_m)
