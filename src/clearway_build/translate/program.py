"""The source of clearway as the translator sees it: loops, named tuples, constants, by their names.

Nothing of it is imported: building needs Python and NumPy alone.
"""

from __future__ import annotations

import ast
import builtins
import hashlib
import importlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

LIBRARIES = ("numpy", "math", "heapq")
"""Modules whose functions and constants loops may use."""


class NotTranslatableError(Exception):
    """What stands outside of the subset, with its file and line."""


@dataclass(frozen=True, eq=False)
class Kernel:
    """A loop: a function that is compiled."""

    module: str
    tree: ast.FunctionDef

    @property
    def name(self) -> str:
        return self.tree.name

    @property
    def parameters(self) -> list[ast.arg]:
        return self.tree.args.args


@dataclass(frozen=True, eq=False)
class Record:
    """A named tuple."""

    module: str
    tree: ast.ClassDef

    @property
    def name(self) -> str:
        return self.tree.name

    @property
    def fields(self) -> dict[str, ast.expr]:
        found = [each for each in self.tree.body if isinstance(each, ast.AnnAssign)]
        return {
            each.target.id: each.annotation for each in found if isinstance(each.target, ast.Name)
        }


@dataclass(frozen=True, eq=False)
class Assigned:
    """A name that a module assigns: a constant, or another name for a type."""

    module: str
    expression: ast.expr


class Program:
    """All modules below a folder that holds the package."""

    def __init__(self, source: Path) -> None:
        self.source = source
        self._names: dict[str, dict[str, ast.stmt]] = {}
        self._found: dict[tuple[str, str], Any] = {}
        self._values: dict[tuple[str, str], Any] = {}
        self._digests: dict[str, str] = {}
        self._used: set[Kernel] | None = None

    def path(self, module: str) -> Path:
        path = self.source.joinpath(*module.split("."))
        file = Path(f"{path}.py")
        return file if file.exists() else path / "__init__.py"

    def names(self, module: str) -> dict[str, ast.stmt]:
        """What a module defines or imports, by name."""
        if module not in self._names:
            content = self.path(module).read_bytes()
            self._digests[module] = hashlib.sha256(content).hexdigest()
            tree = ast.parse(content)
            self._names[module] = {
                name: statement for statement in tree.body for name in _defined(statement)
            }
        return self._names[module]

    def files(self) -> dict[Path, str]:
        """The files that were read so far, with the hashes of what they held then."""
        return {self.path(module): digest for module, digest in self._digests.items()}

    def kernels(self) -> Iterator[Kernel]:
        """All loops, in the order of their files."""
        for module in self._modules():
            if "base.compiled import" not in self.path(module).read_text(encoding="utf-8"):
                continue
            for statement in self.names(module).values():
                if _is_kernel(statement):
                    assert isinstance(statement, ast.FunctionDef)
                    yield self.resolve(module, statement.name)

    def _modules(self) -> Iterator[str]:
        for path in sorted(self.source.joinpath("clearway").rglob("*.py")):
            yield ".".join(path.relative_to(self.source).with_suffix("").parts)

    def used(self) -> set[Kernel]:
        """Loops that code calls which is none; those that a package hands on are public anyway."""
        if self._used is None:
            homes = {each.module for each in self.kernels()}
            words = re.compile("|".join(sorted(map(re.escape, homes), key=len, reverse=True)))
            self._used = set()
            for module in self._modules():
                text = self.path(module).read_text(encoding="utf-8")
                if module in homes or words.search(text):
                    self._used |= set(self._called_in(module))
        return self._used

    def _called_in(self, module: str) -> Iterator[Kernel]:
        names = self.names(module)
        kernels = {}
        for name, statement in names.items():
            if isinstance(statement, ast.FunctionDef | ast.ImportFrom):
                try:
                    found = self.resolve(module, name)
                except NotTranslatableError:
                    continue
                if isinstance(found, Kernel):
                    kernels[name] = found
        for statement in dict.fromkeys(names.values()) if kernels else ():
            if not _is_kernel(statement):
                for each in ast.walk(statement):
                    if isinstance(each, ast.Name) and each.id in kernels:
                        yield kernels[each.id]

    def resolve(self, module: str, name: str) -> Any:
        """What a name means in a module: a loop, a record, an assignment, or a library's object."""
        if (module, name) not in self._found:
            self._found[module, name] = self._resolved(module, name)
        return self._found[module, name]

    def _resolved(self, module: str, name: str) -> Any:
        statement = self.names(module).get(name)
        if isinstance(statement, ast.FunctionDef) and _is_kernel(statement):
            return Kernel(module, statement)
        if isinstance(statement, ast.ClassDef) and _is_record(statement):
            return Record(module, statement)
        if isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value is not None:
            return self._assigned(module, statement, name)
        if isinstance(statement, ast.ImportFrom):
            origin = next(
                each.name for each in statement.names if (each.asname or each.name) == name
            )
            if statement.module in LIBRARIES:
                return getattr(importlib.import_module(statement.module), origin)
            if str(statement.module).startswith("clearway."):
                return self.resolve(str(statement.module), origin)
        if isinstance(statement, ast.Import):
            origin = next(
                each.name for each in statement.names if (each.asname or each.name) == name
            )
            if origin in LIBRARIES:
                return importlib.import_module(origin)
        if statement is None and hasattr(builtins, name):
            return getattr(builtins, name)
        raise NotTranslatableError(f"{self.path(module)}: {name}: no loop, named tuple or constant")

    def _assigned(self, module: str, statement: ast.Assign | ast.AnnAssign, name: str) -> Assigned:
        assert statement.value is not None
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        for target in targets:
            if isinstance(target, ast.Name) and target.id == name:
                return Assigned(module, statement.value)
            if isinstance(target, ast.Tuple):
                for number, each in enumerate(target.elts):
                    if isinstance(each, ast.Name) and each.id == name:
                        index = ast.Constant(number)
                        part = ast.Subscript(statement.value, index, ast.Load())
                        return Assigned(
                            module, ast.fix_missing_locations(ast.copy_location(part, each))
                        )
        raise NotTranslatableError(f"{self.path(module)}:{statement.lineno}: {name}")

    def constant(self, module: str, name: str) -> Any:
        """The value of a name."""
        found = self.resolve(module, name)
        if not isinstance(found, Assigned):
            return found
        if (module, name) not in self._values:
            self._values[module, name] = self.evaluate(found.module, found.expression)
        return self._values[module, name]

    def evaluate(self, module: str, expression: ast.expr) -> Any:
        """The value of an expression of constants."""
        bound = {
            each.id
            for each in ast.walk(expression)
            if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)
        }
        names = {each.id for each in ast.walk(expression) if isinstance(each, ast.Name)} - bound
        known = {name: self.constant(module, name) for name in names}
        code = compile(ast.Expression(expression), str(self.path(module)), "eval")
        return eval(code, known)


def _defined(statement: ast.stmt) -> Iterator[str]:
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        yield statement.name
    elif isinstance(statement, ast.Import | ast.ImportFrom):
        yield from (each.asname or each.name for each in statement.names)
    elif isinstance(statement, ast.Assign | ast.AnnAssign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        for target in targets:
            yield from (each.id for each in ast.walk(target) if isinstance(each, ast.Name))
    elif isinstance(statement, ast.If | ast.Try):
        for each in statement.body:
            yield from _defined(each)


def _is_kernel(statement: ast.stmt | None) -> bool:
    return isinstance(statement, ast.FunctionDef) and any(
        isinstance(each, ast.Name) and each.id == "compiled" for each in statement.decorator_list
    )


def _is_record(statement: ast.ClassDef) -> bool:
    return any(isinstance(base, ast.Name) and base.id == "NamedTuple" for base in statement.bases)


def is_library(found: Any) -> bool:
    return isinstance(found, ModuleType)
