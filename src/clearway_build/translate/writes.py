"""Which of the arrays that a loop is given it writes to: those may be no copies, nor read only.

A path is a parameter and the fields that lead to an array. Arrays that a called loop returns are
taken for new ones.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any

from clearway_build.translate.program import Kernel, Record
from clearway_build.translate.scopes import part_for

Path = tuple[str, ...]
Views = dict[Path, Path]
"""Where the fields of a value come from; () stands for the value itself."""


class Writes:
    """Of one loop, with those of the loops that it calls.

    Where arrays in records are changed in place as a whole (`+=`), only those of a parameter count.
    """

    def __init__(
        self,
        kernel: Kernel,
        known: dict[Kernel, set[Path]],
        meaning: Callable[[ast.expr], Any],
    ) -> None:
        self.known, self.meaning = known, meaning
        self.views: dict[str, Views] = {each.arg: {(): (each.arg,)} for each in kernel.parameters}
        self.found: set[Path] = set()
        before = -1
        while before != len(self.found) + sum(map(len, self.views.values())):
            before = len(self.found) + sum(map(len, self.views.values()))
            for node in ast.walk(kernel.tree):
                self._look(node)

    def _look(self, node: ast.AST) -> None:
        if isinstance(node, ast.Assign):
            for target in node.targets:
                self._assigned(target, node.value)
        elif isinstance(node, ast.For):
            self._assigned(node.target, node.iter)
        elif isinstance(node, ast.AugAssign):
            self._written(node.target)
        elif isinstance(node, ast.Call):
            self._called(node)

    def _assigned(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple):
            for each in target.elts:
                name = each.id if isinstance(each, ast.Name) else ""
                part = part_for(target, value, name) if name else None
                self._assigned(each, part if part is not None else value)
        elif isinstance(target, ast.Name):
            self.views.setdefault(target.id, {}).update(self._views(value))
        else:
            self._written(target)

    def _written(self, target: ast.expr) -> None:
        if isinstance(target, ast.Subscript):
            self.found |= set(self._views(target.value).values())
        elif isinstance(target, ast.Name):  # In place, where it is an array.
            views = self.views.get(target.id, {})
            self.found |= {each for each in views.values() if each[0] == target.id}

    def _called(self, node: ast.Call) -> None:
        function = self.meaning(node.func)
        if isinstance(node.func, ast.Attribute) and node.func.attr in ("sort", "fill"):
            self.found |= set(self._views(node.func.value).values())
        if not isinstance(function, Kernel):
            return
        names = [each.arg for each in function.parameters]
        given = dict(zip(names, node.args, strict=False))
        given |= {each.arg: each.value for each in node.keywords if each.arg}
        for path in self.known.get(function, ()):
            if path[0] in given:
                for at, origin in self._views(given[path[0]]).items():
                    rest = path[1:]
                    if rest[: len(at)] == at:
                        self.found.add(origin + rest[len(at) :])

    def _views(self, node: ast.expr) -> Views:
        if isinstance(node, ast.Name):
            return self.views.get(node.id, {})
        if isinstance(node, ast.Subscript):
            return self._views(node.value)
        if isinstance(node, ast.IfExp):
            return self._views(node.body) | self._views(node.orelse)
        if isinstance(node, ast.Attribute):
            found: Views = {}
            for at, origin in self._views(node.value).items():
                if at == ():
                    found[()] = (*origin, node.attr)
                elif at[0] == node.attr:
                    found[at[1:]] = origin
            return found
        if isinstance(node, ast.Call):
            record = self.meaning(node.func)
            if isinstance(record, Record):
                given = dict(zip(record.fields, node.args, strict=False))
                given |= {each.arg: each.value for each in node.keywords if each.arg}
                return {
                    (field, *at): origin
                    for field, value in given.items()
                    for at, origin in self._views(value).items()
                }
        return {}
