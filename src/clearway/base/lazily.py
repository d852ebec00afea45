"""A sequence whose items are made when they are first asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar, overload

T = TypeVar("T", covariant=True)


class Lazily(Sequence[T]):
    """So many items, each made once by its number."""

    def __init__(self, count: int, make: Callable[[int], T]) -> None:
        self._make = make
        self._items: list[T | None] = [None] * count

    def __len__(self) -> int:
        return len(self._items)

    @overload
    def __getitem__(self, at: int) -> T: ...
    @overload
    def __getitem__(self, at: slice) -> Sequence[T]: ...
    def __getitem__(self, at: int | slice) -> T | Sequence[T]:
        if isinstance(at, slice):
            return tuple(self[n] for n in range(*at.indices(len(self))))
        number = range(len(self))[at]
        item = self._items[number]
        if item is None:
            item = self._items[number] = self._make(number)
        return item

    def has(self, at: int) -> bool:
        """Return whether an item is made already."""
        return self._items[at] is not None

    def iterate_made(self) -> Iterator[T]:
        """Return the items that are made already."""
        return (item for item in self._items if item is not None)
