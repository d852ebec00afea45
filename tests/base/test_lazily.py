"""Items made when they are first asked for."""

from __future__ import annotations

import pytest

from clearway.base.lazily import Lazily


def test_each_is_made_once_and_only_when_asked_for() -> None:
    asked: list[int] = []

    def make(number: int) -> str:
        asked.append(number)
        return f"item {number}"

    items = Lazily(4, make)
    assert len(items) == 4
    assert not asked
    assert items[2] is items[-2]
    assert asked == [2]
    assert items.has(2)
    assert not items.has(0)
    assert list(items.iterate_made()) == ["item 2"]
    assert items[1:3] == ("item 1", "item 2")
    assert list(items) == [f"item {n}" for n in range(4)]
    assert asked == [2, 1, 0, 3]
    with pytest.raises(IndexError):
        items[4]
