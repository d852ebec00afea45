"""Tuples of arrays that are taken apart on the way into compiled code, and made again there."""

from typing import NamedTuple

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from clearway.avoidance.escape_chains import chain_keeps
from clearway.base.by_leaf import by_leaf
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray


class Inner(NamedTuple):
    """Two leaves."""

    along: FloatArray
    share: float


class Outer(NamedTuple):
    """Tuples between leaves."""

    first: FloatArray
    inner: Inner
    count: int
    again: Inner


@compiled
def told_apart(before: float, outer: Outer, alone: Inner, after: FloatArray) -> FloatArray:
    """Each leaf to another digit."""
    return np.array(
        [
            before,
            outer.first[0],
            outer.inner.along.sum(),
            outer.inner.share,
            outer.count,
            outer.again.along.sum(),
            outer.again.share,
            alone.along.sum(),
            alone.share,
            after[-1],
        ]
    )


def arguments(dtype: type = np.float64) -> tuple[float, Outer, Inner, FloatArray]:
    def ones(count: int) -> FloatArray:
        return np.ones(count, dtype=dtype)

    outer = Outer(2.0 * ones(1), Inner(ones(3), 4.0), 5, Inner(ones(6), 7.0))
    return 1.0, outer, Inner(ones(8), 9.0), 10.0 * ones(2)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_every_leaf_comes_to_the_place_that_it_was_taken_from(dtype):
    expected = np.arange(1.0, 11.0)
    np.testing.assert_array_equal(by_leaf(told_apart)(*arguments(dtype)), expected)
    np.testing.assert_array_equal(told_apart(*arguments(dtype)), expected)


def test_arrays_that_nobody_may_write_are_read_like_any_other() -> None:
    fixed = arguments()
    for array in (fixed[1].first, fixed[2].along, fixed[3]):
        array.setflags(write=False)
    np.testing.assert_array_equal(by_leaf(told_apart)(*fixed), np.arange(1.0, 11.0))


def test_an_argument_too_few_is_an_error() -> None:
    with pytest.raises(TypeError):
        by_leaf(told_apart)(*arguments()[:-1])


def test_it_is_told_like_the_loop_and_is_none() -> None:
    assert chain_keeps.__name__ == "chain_keeps"
    assert chain_keeps.__doc__
    assert not isinstance(chain_keeps, Dispatcher)


def test_what_is_not_compiled_stays_what_it_is() -> None:
    def loop(inner: Inner) -> float:
        return inner.share

    assert by_leaf(loop) is loop
