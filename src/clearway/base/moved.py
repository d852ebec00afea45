"""Old paths of modules, answered for one version: by a table, imports find the new ones.

Nothing here imports what is heavy; a path is looked up when somebody asks for it.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec, spec_from_loader
from types import CodeType, ModuleType
from typing import Any

PACKAGE = "clearway"


def answer_old_paths(moved: Mapping[str, str]) -> None:
    """Let imports of old paths find the new ones, with a DeprecationWarning.

    moved: new path by old path, both without the package's name. What lies below an old path is
    looked for below the new one. Where the old path is now a package of other things, it keeps
    its own names and knows those of the old module besides.
    """
    finder = _Finder({f"{PACKAGE}.{old}": f"{PACKAGE}.{new}" for old, new in moved.items()})
    sys.meta_path.insert(0, finder)


class _Finder(MetaPathFinder):
    def __init__(self, moved: Mapping[str, str]) -> None:
        self._moved = moved

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        del target
        new = self._new_path(fullname) if fullname.startswith(f"{PACKAGE}.") else None
        if new is None:
            return None
        here = PathFinder.find_spec(fullname, path) if path else None
        if here is not None:
            return _widened(here, new) if fullname in self._moved else here
        there = find_spec(new)
        if there is None:
            return None
        is_package = there.submodule_search_locations is not None
        loader = _Moved(new)
        return spec_from_loader(fullname, loader, origin=there.origin, is_package=is_package)

    def _new_path(self, fullname: str) -> str | None:
        """By the longest old path that it lies at or below."""
        old = fullname
        while old != PACKAGE:
            if old in self._moved:
                return self._moved[old] + fullname.removeprefix(old)
            old = old.rpartition(".")[0]
        return None


class _Moved(Loader):
    """Makes a module that stands for another."""

    def __init__(self, new: str) -> None:
        self._new = new

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        del spec
        return None

    def exec_module(self, module: ModuleType) -> None:
        warnings.warn(_said(module.__name__, self._new), DeprecationWarning, stacklevel=2)
        there = import_module(self._new)
        module.__doc__ = there.__doc__
        module.__dict__["__getattr__"] = _names_of(module.__name__, self._new)
        module.__dict__["__dir__"] = lambda: dir(there)

    def get_code(self, fullname: str) -> CodeType | None:
        """What `python -m` runs; there the warning is the user's to see."""
        there = find_spec(self._new)
        if there is None or there.loader is None:
            raise ImportError(f"no module named {self._new}", name=self._new)
        said = _said(fullname, self._new)
        warnings.warn_explicit(said, DeprecationWarning, fullname, 1, module="__main__")
        code: CodeType | None = there.loader.get_code(self._new)  # type: ignore[attr-defined]
        return code


def _widened(here: ModuleSpec, new: str) -> ModuleSpec:
    """A package that knows the names of the module that once stood in its place, too."""
    loader: Any = here.loader
    run = loader.exec_module

    def run_and_widen(module: ModuleType) -> None:
        run(module)
        module.__dict__.setdefault("__getattr__", _names_of(here.name, new, warned=False))

    loader.exec_module = run_and_widen
    return here


def _names_of(old: str, new: str, *, warned: bool = True) -> Callable[[str], object]:
    """Module `__getattr__`: names of the module at the new path."""

    def named(name: str) -> object:
        if not name.startswith("__") and new != f"{old}.{name}":
            found = getattr(import_module(new), name, None)
            if found is not None:
                if not warned:
                    said = _said(f"{old}.{name}", f"{new}.{name}")
                    warnings.warn(said, DeprecationWarning, stacklevel=2)
                return found
        raise AttributeError(f"module {old!r} has no attribute {name!r}")

    return named


def _said(old: str, new: str) -> str:
    return f"{old} is now {new}; the old path goes with version 0.3"
