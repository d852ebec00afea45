"""Builds of a small checkout: what changes is compiled, what does not is kept."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.base import arrays
from clearway.base.core_file import STAMP, find_changed_sources
from clearway_build.build import build_core
from clearway_build.compiler import find_compiler
from clearway_build.errors import BuildError
from clearway_build.placed import place
from clearway_build.target import HERE
from small_tree import small_tree, write_loop


@pytest.fixture
def root(tmp_path: Path) -> Path:
    try:
        find_compiler(HERE)
    except BuildError as why:
        pytest.skip(str(why))
    return small_tree(tmp_path, Path(str(arrays.__file__)))


def loaded(core: Path, name: str) -> Any:
    """The loop of a core, loaded beside the one that flies."""
    copy = core.with_name(f"{name}.so")
    copy.write_bytes(core.read_bytes())
    spec = importlib.util.spec_from_file_location("_core", copy)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return getattr(module, "clearway.base.small.shifted")


def test_only_what_has_changed_is_built_again(root: Path) -> None:
    first = build_core(root)
    assert loaded(first.path, "first")(np.array([1.0, 2.0]), 0.5) == 4.0
    assert build_core(root).report == "core: as its sources"
    (root / "src" / "clearway" / "more.py").touch()
    assert " 0 of " in build_core(root).report
    write_loop(root, sign="-")
    again = build_core(root)
    assert " 0 of " not in again.report
    assert loaded(again.path, "again")(np.array([1.0, 2.0]), 0.5) == 2.0


def test_a_stamp_tells_which_source_has_changed(root: Path) -> None:
    base = place(root, build_core(root).path).parent
    loop, source = base / "small.py", root / "src"
    assert find_changed_sources(base / STAMP, source) == []
    loop.touch()
    assert find_changed_sources(base / STAMP, source) == []
    write_loop(root, sign="-")
    assert find_changed_sources(base / STAMP, source) == ["clearway/base/small.py"]
    loop.unlink()
    assert find_changed_sources(base / STAMP, source) == ["clearway/base/small.py"]
    (base / STAMP).unlink()
    assert find_changed_sources(base / STAMP, source) == []


def test_what_is_no_loop_for_the_core_is_named_with_its_line(root: Path) -> None:
    loop = write_loop(root)
    loop.write_text(loop.read_text().replace("total = 0.0", "total = {}"))
    with pytest.raises(BuildError, match=r"small\.py:10"):
        build_core(root)
