"""Loops translated to C++ do what their Python does, bit for bit; what cannot be is named."""

from __future__ import annotations

import importlib.util
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway_build.build import build_core
from clearway_build.errors import BuildError
from clearway_build.translate import NotTranslatableError, write_sources

SOURCE = Path(__file__).parents[2] / "src" / "clearway"
CONSTRUCTS = Path(__file__).parent / "constructs.py"
"""Loops with every construct of the subset, between plain Python and the core."""


def checkout(folder: Path, loops: str) -> Path:
    """A folder with a package that has some loops."""
    base = folder / "src" / "clearway" / "base"
    base.mkdir(parents=True)
    for path in (base, base.parent):
        (path / "__init__.py").write_text("")
    (base / "arrays.py").write_text((SOURCE / "base" / "arrays.py").read_text())
    (base / "compiled.py").write_text("def compiled(function):\n    return function\n")
    (base.parent / "constructs.py").write_text(loops)
    return folder


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    root = checkout(tmp_path_factory.mktemp("checkout"), CONSTRUCTS.read_text())
    built = build_core(root, flavour="checked")
    spec = importlib.util.spec_from_file_location("constructs_core._core", built.path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def plain() -> Iterator[ModuleType]:
    """The same loops as Python runs them."""
    spec = importlib.util.spec_from_file_location("clearway.constructs", CONSTRUCTS)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    before = dict(sys.modules)
    sys.modules["clearway.constructs"] = module
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("clearway.base.compiled.compiled", lambda function: function)
        spec.loader.exec_module(module)
        yield module
    for name in set(sys.modules) - set(before):
        if name == "clearway.constructs":
            del sys.modules[name]


def both(core: ModuleType, plain: ModuleType, name: str, *arguments: Any) -> tuple[Any, Any]:
    """What the core and Python make of the same; arrays they write to are compared too."""
    mine = [np.copy(each) if isinstance(each, np.ndarray) else each for each in arguments]
    with np.errstate(all="ignore"):
        expected = getattr(plain, name)(*mine)
    found = getattr(core, f"clearway.constructs.{name}")(*arguments)
    for one, other in zip(arguments, mine, strict=True):
        assert bits(one) == bits(other)
    return found, expected


def bits(value: Any) -> Any:
    """What tells values apart to the last bit."""
    if isinstance(value, tuple):
        return tuple(bits(each) for each in value)
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    return float(value).hex() if value is not None else None


FLOATS = st.floats(-1e6, 1e6)
SOME = st.lists(FLOATS, min_size=1, max_size=12).map(lambda values: np.array(values))
INTS = st.integers(-1000, 1000)


@pytest.mark.parametrize("name", ["arithmetic", "functions", "comparisons"])
@given(FLOATS, FLOATS.filter(lambda y: abs(y) > 1e-3))
@settings(max_examples=60, deadline=None)
def test_numbers(core: ModuleType, plain: ModuleType, name: str, x: float, y: float) -> None:
    found, expected = both(core, plain, name, x, y)
    assert bits(found) == bits(expected)


@pytest.mark.parametrize("name", ["whole_numbers", "branches", "counting"])
@given(INTS, INTS.filter(bool))
@settings(max_examples=60, deadline=None)
def test_whole_numbers(core: ModuleType, plain: ModuleType, name: str, a: int, b: int) -> None:
    found, expected = both(core, plain, name, a, b)
    assert bits(found) == bits(expected)


@pytest.mark.parametrize(
    "name", ["in_place", "slices", "reductions", "made", "records", "masks", "generic"]
)
@given(SOME)
@settings(max_examples=60, deadline=None)
def test_arrays(core: ModuleType, plain: ModuleType, name: str, values: np.ndarray) -> None:
    found, expected = both(core, plain, name, values)
    assert bits(found) == bits(expected)


@pytest.mark.parametrize("name", ["table", "columns"])
@given(st.integers(1, 5), st.integers(1, 5), st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_two_dimensions(
    core: ModuleType, plain: ModuleType, name: str, rows: int, columns: int, seed: int
) -> None:
    values = np.random.default_rng(seed).normal(size=(rows, columns))
    found, expected = both(core, plain, name, values)
    assert bits(found) == bits(expected)


def test_arguments_by_name_and_of_another_type(core: ModuleType, plain: ModuleType) -> None:
    slices = getattr(core, "clearway.constructs.slices")
    whole = np.arange(8)
    expected = plain.slices(whole.astype(np.float64))
    assert bits(slices(values=whole)) == bits(expected)
    assert bits(slices(np.arange(16.0)[::2] / 2)) == bits(expected)


@pytest.mark.parametrize(
    ("arguments", "named", "words"),
    [
        ((), {}, "takes (values,)"),
        ((np.zeros(2),), {"other": 1}, "takes (values,)"),
        ((np.zeros((2, 2)),), {}, "argument values: wants a contiguous array of float64 with 1"),
        ((np.zeros(2, dtype=np.complex128),), {}, "complex128"),
        (([0.0],), {}, "not list"),
    ],
)
def test_wrong_arguments_are_named(
    core: ModuleType, arguments: tuple[Any, ...], named: dict[str, Any], words: str
) -> None:
    with pytest.raises(TypeError) as caught:
        getattr(core, "clearway.constructs.slices")(*arguments, **named)
    assert words in str(caught.value)


def test_what_is_written_is_no_copy_and_not_read_only(core: ModuleType) -> None:
    in_place = getattr(core, "clearway.constructs.in_place")
    sealed = np.zeros(3)
    sealed.setflags(write=False)
    with pytest.raises(TypeError, match="is written, but read only"):
        in_place(sealed)
    with pytest.raises(TypeError, match="not an array of int64"):
        in_place(np.zeros(3, dtype=np.int64))


def test_what_is_returned_of_an_argument_is_its_memory(core: ModuleType) -> None:
    values = np.arange(6.0)
    whole, rest = getattr(core, "clearway.constructs.handed_on")(values)
    assert whole is values
    rest[0] = 7.0
    assert values[2] == 7.0


def test_an_index_out_of_bounds_is_an_error_where_indices_are_checked(core: ModuleType) -> None:
    with pytest.raises(IndexError, match="index 3 is out of bounds for size 3"):
        getattr(core, "clearway.constructs.picked_at")(np.zeros(3), 3)


def test_a_negative_size_is_an_error(core: ModuleType) -> None:
    with pytest.raises(ValueError, match="negative dimensions"):
        getattr(core, "clearway.constructs.of_size")(-1)


def test_memory_of_temporaries_is_given_back(core: ModuleType) -> None:
    of_size = getattr(core, "clearway.constructs.of_size")
    for _ in range(200):
        assert of_size(2_000_000) == 2_000_000  # Kept, they would be 3 GB.


HEAD = """
import numpy as np
from clearway.base.arrays import FloatArray, Floats
from clearway.base.compiled import compiled


@compiled
"""


@pytest.mark.parametrize(
    ("loop", "words"),
    [
        ("def f(x: float) -> float:\n    with x:\n        return x", "With is not in the subset"),
        ("def f(x: float) -> float:\n    return (lambda: x)()", "the call (lambda: x)()"),
        ("def f(x: float) -> float:\n    return np.fft(x)", "np.fft(x) is not in the subset"),
        ("def f(x: Floats) -> float:\n    return x.std()", "the method std is not in the subset"),
        ("def f(x: Floats) -> Floats:\n    return x[::2]", "slices have no step"),
        ("def f(x: FloatArray) -> float:\n    return x[0]", "FloatArray is no type of the core"),
        ("def f(x: float) -> float:\n    return x @ x", "the operator MatMult is not"),
        ("def f(x: float) -> float:\n    for k in range(3):\n        x = x\n    else:\n"
         "        x = 1.0\n    return x", "loops have no else"),
        ("def f(x: float) -> float:\n    return unknown(x)", "unknown: no loop, named tuple"),
    ],
)  # fmt: skip
def test_what_is_not_in_the_subset_is_named_with_its_place(
    tmp_path: Path, loop: str, words: str
) -> None:
    root = checkout(tmp_path, HEAD + loop)
    with pytest.raises(NotTranslatableError) as caught:
        write_sources(root / "src", tmp_path / "out")
    assert words in str(caught.value)
    assert "constructs.py" in str(caught.value)


def test_a_number_that_loses_its_fraction_does_not_compile(tmp_path: Path) -> None:
    loop = "def f(x: float) -> int:\n    n = 1\n    n = x\n    return n"
    with pytest.raises(BuildError, match="a float is no int"):
        build_core(checkout(tmp_path, HEAD + loop))


@pytest.mark.parametrize(
    "whole", [False, pytest.param(True, marks=pytest.mark.nightly)], ids=["constructs", "all loops"]
)
def test_translation_is_the_same_every_time(whole: bool, tmp_path: Path) -> None:
    source = SOURCE.parent
    if not whole:
        source = checkout(tmp_path / "checkout", CONSTRUCTS.read_text()) / "src"
    one, other = (
        [path.read_text() for path in write_sources(source, tmp_path / name)]
        for name in ("one", "other")
    )
    assert one == other
    assert math.inf > len("".join(one)) > 0
