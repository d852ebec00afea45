"""Expressions of loops in C++."""

from __future__ import annotations

import ast
import math
from typing import Any

import numpy as np

from clearway_build.translate.kinds import Kinds, identifier, qualified
from clearway_build.translate.program import (
    Kernel,
    NotTranslatableError,
    Program,
    Record,
    is_library,
)
from clearway_build.translate.scopes import Scopes

OPERATORS: dict[type, str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.LShift: "<<",
    ast.RShift: ">>",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
FUNCTIONS: dict[type, str] = {
    ast.Div: "divide",
    ast.FloorDiv: "floor_divide",
    ast.Mod: "modulo",
    ast.BitAnd: "bit_and",
    ast.BitOr: "bit_or",
    ast.BitXor: "bit_xor",
}
CASTS = {
    np.int64: "i64",
    np.int32: "i32",
    np.uint32: "u32",
    np.uint64: "u64",
    np.uint8: "u8",
    np.int8: "i8",
    np.int16: "i16",
    np.float64: "f64",
    np.bool_: "bool",
    int: "i64",
    float: "f64",
    bool: "bool",
}
"""Types that values are turned into, or that arrays are made of."""
RENAMED = {
    "arccos": "acos",
    "arcsin": "asin",
    "arctan": "atan",
    "arctan2": "atan2",
    "fabs": "absolute",
    "abs": "absolute",
}
_PLAIN = """
sqrt cos sin tan acos asin atan atan2 exp expm1 log log1p erf floor ceil rint isnan isinf
isfinite hypot copysign nextafter gcd absolute sum mean max min any all count_nonzero sort
partition flatnonzero cumsum diff append linspace cross empty_like heappush heappop
"""
PLAIN = frozenset(_PLAIN.split())
"""Functions of numpy, math and heapq that `numbers.hpp` has under the same name."""
METHODS = {
    "sum": "sum",
    "max": "max",
    "min": "min",
    "any": "any",
    "all": "all",
    "mean": "mean",
    "copy": "copy",
    "ravel": "ravel",
    "reshape": "reshape",
    "append": "append",
    "sort": "sort_in_place",
    "fill": "fill",
}
_MAKES = """
empty zeros ones full array arange linspace copy astype sort argsort partition flatnonzero
cumsum diff append cross empty_like sum_of_rows
"""
MAKES = frozenset(_MAKES.split())
"""Calls that take memory of the arena."""


def literal(value: Any) -> str:
    """A constant; arrays are tables of static memory."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, np.uint64):
        return f"u64{{{int(value)}ULL}}"
    if isinstance(value, int | np.integer):
        if value >= 1 << 63:
            return f"u64{{{int(value)}ULL}}"
        return f"i64{{{int(value)}}}"
    if isinstance(value, float | np.floating):
        number = float(value)
        if math.isnan(number):
            return "std::numeric_limits<f64>::quiet_NaN()"
        if math.isinf(number):
            return f"{'-' if number < 0 else ''}std::numeric_limits<f64>::infinity()"
        return f"f64{{{number.hex()}}}"
    if isinstance(value, tuple):
        return f"std::make_tuple({', '.join(literal(each) for each in value)})"
    if isinstance(value, np.ndarray):
        kind = CASTS[value.dtype.type]
        values = ", ".join(literal(each) for each in value.ravel().tolist())
        sizes = "".join(f", i64{{{n}}}" for n in value.shape)
        table = f"static const {kind} values[] = {{{values}}};"
        return f"([] {{ {table} return rt::table(values{sizes}); }}())"
    raise TypeError(f"{type(value).__name__} is no constant of the core")


class Expressions(ast.NodeVisitor):
    """Of one loop; `visit` gives an expression of C++."""

    def __init__(self, program: Program, kinds: Kinds, kernel: Kernel) -> None:
        self.program, self.kinds, self.kernel = program, kinds, kernel
        self.scopes = Scopes(kernel.tree)
        self.called: list[Kernel] = []
        self.makes_arrays = False

    def fail(self, node: ast.AST, why: str) -> NotTranslatableError:
        path = self.program.path(self.kernel.module)
        return NotTranslatableError(f"{path}:{getattr(node, 'lineno', 0)}: {why}")

    def generic_visit(self, node: ast.AST) -> Any:
        raise self.fail(node, f"{type(node).__name__} is not in the subset of compiled loops")

    def meaning(self, node: ast.expr) -> Any:
        """What a name or attribute stands for that is no value of the loop; None for a value."""
        if isinstance(node, ast.Name) and not self.scopes.is_local(node.id):
            return self.program.resolve(self.kernel.module, node.id)
        if isinstance(node, ast.Attribute):
            owner = self.meaning(node.value)
            if owner is not None and is_library(owner):
                return getattr(owner, node.attr, None)
        return None

    def constant(self, node: ast.expr) -> Any:
        """The value of an expression without variables; None where it has any."""
        names = [each.id for each in ast.walk(node) if isinstance(each, ast.Name)]
        if any(self.scopes.is_local(name) for name in names):
            return None
        if any(isinstance(each, ast.Call | ast.BinOp) for each in ast.walk(node)):
            return None
        try:
            return self.program.evaluate(self.kernel.module, node)
        except NotTranslatableError:
            return None

    # --- Values

    def visit_Constant(self, node: ast.Constant) -> str:
        return literal(node.value)

    def visit_Name(self, node: ast.Name) -> str:
        if self.scopes.is_local(node.id):
            return identifier(node.id)
        return self._known(node, self.program.constant(self.kernel.module, node.id))

    def _known(self, node: ast.expr, value: Any) -> str:
        try:
            return literal(value)
        except TypeError as error:
            raise self.fail(node, str(error)) from None

    def visit_Attribute(self, node: ast.Attribute) -> str:
        found = self.meaning(node)
        if found is not None:
            return self._known(node, found)
        value = self.visit(node.value)
        if node.attr in ("shape", "size"):
            return f"rt::{node.attr}_of({value})"
        if node.attr == "T":
            return f"rt::transposed({value})"
        return f"{value}.{identifier(node.attr)}"

    def visit_Tuple(self, node: ast.Tuple) -> str:
        if any(isinstance(each, ast.Starred) for each in node.elts):
            return f"std::tuple_cat({self._groups(node.elts)})"
        return f"std::make_tuple({self.listed(node.elts)})"

    def visit_List(self, node: ast.List) -> str:
        return f"rt::list_of({self.listed(node.elts)})"

    def listed(self, nodes: list[ast.expr]) -> str:
        return ", ".join(self.visit(each) for each in nodes)

    def _groups(self, nodes: list[ast.expr]) -> str:
        return ", ".join(
            f"rt::parts_of({self.visit(each.value)})"
            if isinstance(each, ast.Starred)
            else f"std::make_tuple({self.visit(each)})"
            for each in nodes
        )

    # --- Operators

    def visit_UnaryOp(self, node: ast.UnaryOp) -> str:
        value = self.visit(node.operand)
        if isinstance(node.op, ast.Invert):
            return f"rt::invert({value})"
        return f"({'!' if isinstance(node.op, ast.Not) else '-'}({value}))"

    def visit_BinOp(self, node: ast.BinOp) -> str:
        left = self.visit(node.left)
        if isinstance(node.op, ast.Pow):
            power = self.constant(node.right)
            if isinstance(power, int) and power > 0:
                return f"rt::power<{power}>({left})"
            return f"rt::power({left}, {self.visit(node.right)})"
        right = self.visit(node.right)
        if type(node.op) in FUNCTIONS:
            return f"rt::{FUNCTIONS[type(node.op)]}({left}, {right})"
        if type(node.op) in OPERATORS:
            return f"({left} {OPERATORS[type(node.op)]} {right})"
        raise self.fail(node, f"the operator {type(node.op).__name__} is not in the subset")

    def visit_Compare(self, node: ast.Compare) -> str:
        parts, left = [], self.visit(node.left)
        for operator, comparator in zip(node.ops, node.comparators, strict=True):
            if isinstance(operator, ast.In | ast.NotIn) and isinstance(comparator, ast.Tuple):
                found = " || ".join(f"({left} == {self.visit(each)})" for each in comparator.elts)
                parts.append(f"({found})" if isinstance(operator, ast.In) else f"(!({found}))")
                continue
            if type(operator) not in OPERATORS:
                raise self.fail(node, f"{type(operator).__name__} is not in the subset")
            right = self.visit(comparator)
            parts.append(f"({left} {OPERATORS[type(operator)]} {right})")
            left = right
        return parts[0] if len(parts) == 1 else f"({' && '.join(parts)})"

    def visit_BoolOp(self, node: ast.BoolOp) -> str:
        word = " && " if isinstance(node.op, ast.And) else " || "
        return f"({word.join(f'static_cast<bool>({self.visit(each)})' for each in node.values)})"

    def visit_IfExp(self, node: ast.IfExp) -> str:
        return f"({self.visit(node.test)} ? {self.visit(node.body)} : {self.visit(node.orelse)})"

    # --- Parts

    def visit_Slice(self, node: ast.Slice) -> str:
        if node.step is not None:
            raise self.fail(node, "slices have no step")
        low = f"rt::integer({self.visit(node.lower)})" if node.lower else "0"
        high = f"rt::integer({self.visit(node.upper)})" if node.upper else "0"
        given = f"{str(node.lower is not None).lower()}, {str(node.upper is not None).lower()}"
        return f"rt::Slice{{{low}, {high}, {given}}}"

    def indices(self, node: ast.Subscript) -> str:
        index = node.slice
        return self.listed(index.elts) if isinstance(index, ast.Tuple) else self.visit(index)

    def visit_Subscript(self, node: ast.Subscript) -> str:
        value = self.visit(node.value)
        is_shape = isinstance(node.value, ast.Attribute) and node.value.attr == "shape"
        if is_shape and isinstance(node.slice, ast.Slice) and node.slice.lower is not None:
            return f"rt::tail<{self.constant(node.slice.lower)}>({value})"
        if not isinstance(node.slice, ast.Slice | ast.Tuple):
            known = self.constant(node.slice)
            if isinstance(known, int) and not isinstance(known, bool):
                return f"rt::sub<{known}>({value})"
        return f"rt::get({value}, {self.indices(node)})"

    # --- Calls

    def visit_Call(self, node: ast.Call) -> str:
        found = self.meaning(node.func)
        if found is None and isinstance(node.func, ast.Attribute):
            return self._method(node, node.func)
        if isinstance(found, Kernel):
            self.called.append(found)
            names = [each.arg for each in found.parameters]
            return self._call(qualified(found.module, found.name), node, names)
        if isinstance(found, Record):
            return self._call(
                f"{qualified(found.module, found.name)}::make", node, list(found.fields)
            )
        if found in (np.empty, np.zeros, np.ones, np.full):
            return self._array(node, found.__name__)
        if isinstance(found, type) and found in CASTS:
            kind, value = CASTS[found], self.visit(node.args[0])
            return f"rt::integer({value})" if kind == "i64" else f"static_cast<{kind}>({value})"
        return self._function(node, found)

    def _call(self, name: str, node: ast.Call, parameters: list[str]) -> str:
        given = {each.arg: each.value for each in node.keywords}
        rest = [given[each] for each in parameters[len(node.args) :] if each in given]
        arguments = [*node.args, *rest]
        if any(isinstance(each, ast.Starred) for each in arguments):
            return (
                f"std::apply([](const auto&... each) {{ return {name}(each...); }}, "
                f"std::tuple_cat({self._groups(arguments)}))"
            )
        return f"{name}({self.listed(arguments)})"

    def _method(self, node: ast.Call, function: ast.Attribute) -> str:
        value = self.visit(function.value)
        self.makes_arrays |= function.attr in MAKES
        if function.attr == "astype":
            return f"rt::astype<{self.element(node.args[0])}>({value})"
        if function.attr in METHODS:
            rest = "".join(f", {self.visit(each)}" for each in node.args)
            return f"rt::{METHODS[function.attr]}({value}{rest})"
        raise self.fail(node, f"the method {function.attr} is not in the subset")

    def element(self, node: ast.expr | None) -> str:
        """The type of an array's elements by what is given as its dtype."""
        if node is None:
            return "f64"
        if isinstance(node, ast.Attribute) and node.attr == "dtype":
            return f"typename std::decay_t<decltype({self.visit(node.value)})>::value"
        found = self.meaning(node)
        if found in CASTS:
            return CASTS[found]
        raise self.fail(node, f"{ast.unparse(node)} is no type of elements")

    def _array(self, node: ast.Call, name: str) -> str:
        self.makes_arrays = True
        given = {each.arg: each.value for each in node.keywords}
        shape, dtype, value = node.args[0], given.get("dtype"), ""
        if name == "full":
            value = f"{self.visit(node.args[1])}, "
            if dtype is None:
                kind = CASTS.get(type(self.constant(node.args[1])), "f64")
                return f"rt::full<{kind}>({value}{self._shape(shape)})"
        elif len(node.args) > 1:
            dtype = node.args[1]
        return f"rt::{name}<{self.element(dtype)}>({value}{self._shape(shape)})"

    def _shape(self, node: ast.expr) -> str:
        return self.listed(node.elts) if isinstance(node, ast.Tuple) else self.visit(node)

    def _function(self, node: ast.Call, found: Any) -> str:
        arguments = node.args
        if found is len:
            known = self.constant(arguments[0])
            if isinstance(known, tuple):
                return literal(len(known))
            return f"rt::len({self.visit(arguments[0])})"
        if found in (min, max) and len(arguments) > 1:
            return f"rt::{'least' if found is min else 'most'}({self.listed(arguments)})"
        if found is abs:
            return f"rt::absolute({self.visit(arguments[0])})"
        if found is divmod:
            a, b = (self.visit(each) for each in arguments)
            return f"std::make_tuple(rt::floor_divide({a}, {b}), rt::modulo({a}, {b}))"
        name = RENAMED.get(getattr(found, "__name__", ""), getattr(found, "__name__", ""))
        keywords = {each.arg: each.value for each in node.keywords}
        self.makes_arrays |= name in MAKES
        if name == "sum" and set(keywords) == {"axis"}:
            self.makes_arrays = True
            return f"rt::sum_of_rows({self.visit(arguments[0])})"
        if name == "argsort":
            return f"rt::argsort({self.visit(arguments[0])})"
        if name == "arange":
            kind = self.element(keywords["dtype"]) if "dtype" in keywords else "i64"
            return f"rt::arange<{kind}>({self.listed(arguments)})"
        if name == "array":
            inner = arguments[0]
            values = inner.elts if isinstance(inner, ast.List | ast.Tuple) else [inner]
            made = f"rt::array({self.listed(values)})"
            if "dtype" in keywords:
                return f"rt::astype<{self.element(keywords['dtype'])}>({made})"
            return made
        if name in PLAIN and not keywords:
            return f"rt::{name}({self.listed(arguments)})"
        raise self.fail(node, f"the call {ast.unparse(node)[:60]} is not in the subset")
