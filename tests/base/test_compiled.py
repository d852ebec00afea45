"""Loops that borrow arrays: what they return, and whatever they call, holds none."""

import importlib
import os
import re
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numba
import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from clearway.base.compiled import plain
from repository import REPOSITORY

SOURCE = REPOSITORY / "src"
FILES = (  # Folders of compiled code may go meanwhile, which `rglob` does not take.
    Path(folder, name)
    for folder, _, names in os.walk(SOURCE / "clearway")
    for name in names
    if name.endswith(".py")
)
WITH_LOOPS = sorted(
    ".".join(path.relative_to(SOURCE).with_suffix("").parts)
    for path in FILES
    if re.search(r"^@(borrowing|inlined)$", path.read_text(), re.MULTILINE)
)
pytestmark = pytest.mark.skipif(
    bool(numba.config.DISABLE_JIT), reason="numba is told to compile nothing"
)


def holds_no_array(kind: Any) -> bool:
    """Whether a value of a type is made of numbers alone."""
    if hasattr(kind, "_fields"):
        return all(map(holds_no_array, get_type_hints(kind).values()))
    if get_origin(kind) is tuple:
        return all(map(holds_no_array, get_args(kind)))
    return kind in (int, float, bool, np.uint64, None, type(None))


def returned(loop: Dispatcher) -> Any:
    """The type that a loop says it returns."""
    function = loop.py_func
    return eval(function.__annotations__["return"], function.__globals__)


@pytest.mark.parametrize("module", WITH_LOOPS)
def test_no_array_comes_out_of_a_loop_that_counts_no_references(module):
    """One that did would be freed too early, and one that it got from elsewhere never."""
    borrowing = [
        loop
        for loop in vars(importlib.import_module(module)).values()
        if isinstance(loop, Dispatcher) and loop.targetoptions["_nrt"] is False
    ]
    assert borrowing
    for loop in borrowing:
        assert holds_no_array(returned(loop)), loop
        known = loop.py_func.__globals__
        called = [known.get(name) for name in loop.py_func.__code__.co_names]
        for other in (each for each in called if isinstance(each, Dispatcher)):
            assert holds_no_array(returned(other)), f"{loop} calls {other}"


def test_arrays_of_one_kind_are_handed_on_as_they_are() -> None:
    whole = np.zeros(4)
    assert plain(whole) is whole
    fixed = np.ones(4)
    fixed.setflags(write=False)
    for other in (fixed, np.ones(8)[::2], np.ones(4, dtype=np.float32)):
        assert plain(other).flags.carray
        np.testing.assert_array_equal(plain(other), np.ones(4))
        assert plain(other).dtype == np.float64
