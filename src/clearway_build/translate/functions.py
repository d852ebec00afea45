"""Whole loops in C++: their statements, and where they declare what."""

from __future__ import annotations

import ast

from clearway_build.translate.expressions import Expressions
from clearway_build.translate.kinds import Kinds, identifier
from clearway_build.translate.program import Kernel, Program
from clearway_build.translate.scopes import part_for

SMALL = 120
"""Nodes of the syntax tree."""


class Function(Expressions):
    """One loop; `text` is its definition, `head` its declaration."""

    def __init__(self, program: Program, kinds: Kinds, kernel: Kernel) -> None:
        super().__init__(program, kinds, kernel)
        self.lines: list[str] = []
        self.depth = 1
        self.count = 0
        module = kernel.module
        self.returned = kinds.of(module, kernel.tree.returns)
        self.parameters = [kinds.of(module, each.annotation) for each in kernel.parameters]
        self.body(kernel.tree.body)
        listed = ", ".join(
            self._parameter(kind, each.arg)
            for kind, each in zip(self.parameters, kernel.parameters, strict=True)
        )
        inline = "RT_INLINE" if self._is_small() else "static"
        self.head = f"{inline} {self.returned} {identifier(kernel.name)}({listed})"
        if self.makes_arrays and not self._returns_arrays():
            self.lines.insert(0, "  const rt::Scope scope;")

    @property
    def is_generic(self) -> bool:
        """Whether arrays of any type do, which Python cannot call."""
        return "auto" in [self.returned, *self.parameters]

    @property
    def text(self) -> str:
        return "\n".join([f"{self.head} {{", *self.lines, "}"])

    def _parameter(self, kind: str, name: str) -> str:
        by_value = not kind.startswith(("::", "std::tuple")) or self.scopes.is_assigned(name)
        return f"{kind} {identifier(name)}" if by_value else f"const {kind}& {identifier(name)}"

    def _is_small(self) -> bool:
        """Whether it is written into whoever calls it; the compiler decides about larger ones."""
        nodes = [each for statement in self.kernel.tree.body for each in ast.walk(statement)]
        return len(nodes) <= SMALL and not any(isinstance(n, ast.For | ast.While) for n in nodes)

    def _returns_arrays(self) -> bool:
        """Whether what it returns may lie in memory that it took."""
        return self.returned == "auto" or "::" in self.returned.replace("std::tuple", "")

    # --- Variables

    def _type_of(self, name: str) -> str:
        """The type of a variable that is declared before it is assigned."""
        statement = self.scopes.typed_by[name]
        if isinstance(statement, ast.AnnAssign):
            return self.kinds.of(self.kernel.module, statement.annotation)
        if isinstance(statement, ast.For):
            if _is_range(statement.iter):
                return "i64"
            target, counted = statement.target, statement.iter
            if _is_enumerate(counted):
                assert isinstance(counted, ast.Call)
                assert isinstance(target, ast.Tuple)
                if self._picked(target.elts[0], name, name):
                    return "i64"
                target, counted = target.elts[1], counted.args[0]
            if isinstance(counted, ast.Tuple):
                value = self.visit(counted.elts[0])
            else:
                value = f"rt::get({self.visit(counted)}, i64{{0}})"
            return self._decayed(self._picked(target, value, name))
        if isinstance(statement, ast.Assign):
            value = self.visit(statement.value)
            for target in statement.targets:
                part = part_for(target, statement.value, name)
                if part is not None:
                    return self._decayed(self.visit(part))
                picked = self._picked(target, value, name)
                if picked:
                    return self._decayed(picked)
        raise self.fail(statement, f"{name} is changed before it has a value")

    def _decayed(self, expression: str) -> str:
        return f"std::decay_t<decltype({expression})>"

    def _picked(self, target: ast.expr, value: str, name: str) -> str:
        """The part of an unpacked value that goes to a name."""
        if isinstance(target, ast.Name):
            return value if target.id == name else ""
        if isinstance(target, ast.Tuple):
            for number, each in enumerate(target.elts):
                found = self._picked(each, f"rt::sub<{number}>({value})", name)
                if found:
                    return found
        return ""

    # --- Statements

    def write(self, line: str) -> None:
        self.lines.append("  " * self.depth + line)

    def fresh(self) -> str:
        self.count += 1
        return f"t{self.count}_"

    def body(self, statements: list[ast.stmt]) -> None:
        for statement in statements:
            for name in self.scopes.before.get(id(statement), ()):
                self.write(f"{self._type_of(name)} {identifier(name)}{{}};")
            self.visit(statement)

    def block(self, statements: list[ast.stmt]) -> None:
        self.depth += 1
        self.body(statements)
        self.depth -= 1

    def visit_Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):
            self.write(f"{self.visit(node.value)};")

    def visit_Pass(self, _: ast.Pass) -> None:
        pass

    def visit_Delete(self, _: ast.Delete) -> None:
        pass

    def visit_Break(self, _: ast.Break) -> None:
        self.write("break;")

    def visit_Continue(self, _: ast.Continue) -> None:
        self.write("continue;")

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is None or (
            isinstance(node.value, ast.Constant) and node.value.value is None
        ):
            self.write("return;")
        else:
            value = self.visit(node.value)
            generic = self.returned == "auto"
            self.write(f"return {value if generic else f'rt::to<{self.returned}>({value})'};")

    def assign(self, target: ast.expr, value: str, statement: ast.stmt) -> None:
        if isinstance(target, ast.Name) and self.scopes.is_dropped(target.id):
            self.write(f"static_cast<void>({value});")
        elif isinstance(target, ast.Name):
            name = identifier(target.id)
            if self.scopes.declared_by.get(target.id) is statement:
                self.write(f"auto {name} = {value};")
            else:
                self.write(f"{name} = rt::to<std::decay_t<decltype({name})>>({value});")
        elif isinstance(target, ast.Subscript):
            self.write(
                f"rt::store(rt::at({self.visit(target.value)}, {self.indices(target)}), {value});"
            )
        elif isinstance(target, ast.Tuple):
            whole = self.fresh()
            self.write(f"auto {whole} = {value};")
            for number, each in enumerate(target.elts):
                self.assign(each, f"rt::sub<{number}>({whole})", statement)
        else:
            raise self.fail(statement, "such a target is not in the subset")

    def visit_Assign(self, node: ast.Assign) -> None:
        for target in node.targets:
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                names = [self.fresh() for _ in node.value.elts]
                for name, each in zip(names, node.value.elts, strict=True):
                    self.write(f"auto {name} = {self.visit(each)};")
                for name, each in zip(names, target.elts, strict=True):
                    self.assign(each, name, node)
            else:
                self.assign(target, self.visit(node.value), node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is None:
            return
        kind = self.kinds.of(self.kernel.module, node.annotation)
        self.assign(node.target, f"rt::to<{kind}>({self.visit(node.value)})", node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        target = node.target
        if isinstance(target, ast.Name):
            before: ast.expr = ast.copy_location(ast.Name(target.id, ast.Load()), node)
        elif isinstance(target, ast.Subscript):
            before = ast.copy_location(ast.Subscript(target.value, target.slice, ast.Load()), node)
        else:
            raise self.fail(node, "such a target is not in the subset")
        after = self.visit(ast.copy_location(ast.BinOp(before, node.op, node.value), node))
        if isinstance(target, ast.Name):
            self.write(f"rt::update({identifier(target.id)}, {after});")
        else:
            self.assign(target, after, node)

    def visit_If(self, node: ast.If) -> None:
        self.write(f"if ({self.visit(node.test)}) {{")
        self.block(node.body)
        if node.orelse:
            self.write("} else {")
            self.block(node.orelse)
        self.write("}")

    def visit_While(self, node: ast.While) -> None:
        if node.orelse:
            raise self.fail(node, "loops have no else")
        self.write(f"while ({self.visit(node.test)}) {{")
        self.block(node.body)
        self.write("}")

    def visit_For(self, node: ast.For) -> None:
        if node.orelse:
            raise self.fail(node, "loops have no else")
        index, counted = self.fresh(), node.iter
        enumerated = _is_enumerate(counted)
        if _is_range(counted):
            assert isinstance(counted, ast.Call)
            self._range(node, index, [self.visit(each) for each in counted.args])
            return
        if enumerated:
            assert isinstance(counted, ast.Call)
            counted = counted.args[0]
        values = self.fresh()
        self.write("{")
        self.depth += 1
        if isinstance(counted, ast.Tuple):
            self.write(f"const auto {values} = std::array{{{self.listed(counted.elts)}}};")
            value = f"{values}[static_cast<std::size_t>({index})]"
        else:
            self.write(f"const auto {values} = {self.visit(counted)};")
            value = f"rt::get({values}, {index})"
        self.write(f"for (i64 {index} = 0; {index} < rt::len({values}); ++{index}) {{")
        self.depth += 1
        if enumerated:
            assert isinstance(node.target, ast.Tuple)
            self.assign(node.target.elts[0], index, node)
            self.assign(node.target.elts[1], value, node)
        else:
            self.assign(node.target, value, node)
        self.body(node.body)
        self.depth -= 1
        self.write("}")
        self.depth -= 1
        self.write("}")

    def _range(self, node: ast.For, index: str, bounds: list[str]) -> None:
        low, high = ("i64{0}", bounds[0]) if len(bounds) == 1 else bounds[:2]
        step, sign, end = "1", "<", self.fresh()
        if len(bounds) == 3:
            assert isinstance(node.iter, ast.Call)
            known = self.constant(node.iter.args[2])
            if not isinstance(known, int):
                raise self.fail(node, "the step of a range is a constant")
            step, sign = str(known), "<" if known > 0 else ">"
        self.write(
            f"for (i64 {index} = rt::integer({low}), {end} = rt::integer({high}); "
            f"{index} {sign} {end}; {index} += {step}) {{"
        )
        self.depth += 1
        self.assign(node.target, index, node)
        self.body(node.body)
        self.depth -= 1
        self.write("}")


def _is_range(node: ast.expr) -> bool:
    return (
        isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "range"
    )


def _is_enumerate(node: ast.expr) -> bool:
    return isinstance(node, ast.Call) and ast.unparse(node.func) == "enumerate"
