"""Where the variables of a loop are declared.

Python's belong to the whole function; those of C++ to a block, and their type is that of the first
value. A variable is declared where it is first assigned if all its uses are within that block, else
before the outermost loop or branch that holds them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field


@dataclass(eq=False)
class Block:
    """A list of statements, and the statement that it belongs to."""

    parent: Block | None
    owner: ast.stmt | None
    repeats: bool = False
    names: list[str] = field(default_factory=list)

    def line(self) -> list[Block]:
        """From the outermost block to this one."""
        before = self.parent.line() if self.parent else []
        return [*before, self]


@dataclass(eq=False)
class Use:
    """One occurrence of a variable."""

    block: Block
    statement: ast.stmt
    is_store: bool


class Scopes:
    """Of one function: what each statement declares, and what has to be declared before it."""

    def __init__(self, tree: ast.FunctionDef) -> None:
        self.parameters = {each.arg for each in tree.args.args}
        self.uses: dict[str, list[Use]] = {}
        self.blocks: dict[int, Block] = {}
        self.root = Block(None, None)
        self._walk(tree.body, self.root)
        self.declared_by: dict[str, ast.stmt] = {}
        """Variables that their first assignment declares."""
        self.before: dict[int, list[str]] = {}
        """Variables that are declared before a statement, by its id."""
        self.typed_by: dict[str, ast.stmt] = {}
        """The assignments by which those have their types."""
        self.hoisted_to: dict[str, ast.stmt] = {}
        self._place()

    def _walk(self, body: list[ast.stmt], block: Block) -> None:
        for statement in body:
            self.blocks[id(statement)] = block
            if isinstance(statement, ast.For):
                self._note(statement.iter, block, statement)
                inner = Block(block, statement, repeats=True)
                self._note(statement.target, inner, statement)
                self._walk(statement.body, inner)
            elif isinstance(statement, ast.While):
                self._note(statement.test, block, statement)
                self._walk(statement.body, Block(block, statement, repeats=True))
            elif isinstance(statement, ast.If):
                self._note(statement.test, block, statement)
                self._walk(statement.body, Block(block, statement))
                self._walk(statement.orelse, Block(block, statement))
            else:
                self._note(statement, block, statement)

    def _note(self, node: ast.AST, block: Block, statement: ast.stmt) -> None:
        for name, is_store in _in_order(node):
            self.uses.setdefault(name, []).append(Use(block, statement, is_store))

    def _place(self) -> None:
        variables = [
            name
            for name, uses in self.uses.items()
            if name not in self.parameters
            and any(use.is_store for use in uses)
            and not self.is_dropped(name)
        ]
        waiting = []
        for name in variables:
            uses = self.uses[name]
            first = uses[0]
            is_plain = first.is_store and first.block is _shared([use.block for use in uses])
            if is_plain and isinstance(first.statement, ast.Assign | ast.AnnAssign | ast.For):
                self.declared_by[name] = first.statement
            else:
                waiting.append(name)
        for name in waiting:
            if name not in self.typed_by:
                self._hoist(name, self._place_of(name))

    def _place_of(self, name: str) -> ast.stmt:
        """The statement before which a variable is declared that no single assignment declares."""
        uses = self.uses[name]
        block = _shared([use.block for use in uses])
        statement = self._within(uses[0].statement, block)
        if not _surely_assigns(statement, name):  # A value may come from the round before.
            line = block.line()
            outside = next((n for n, each in enumerate(line) if each.repeats), len(line))
            statement = self._within(statement, line[max(0, outside - 1)])
        return statement

    def _within(self, statement: ast.stmt, block: Block) -> ast.stmt:
        """The statement of a block that a statement is, or stands in."""
        while self.blocks[id(statement)] is not block:
            owner = self.blocks[id(statement)].owner
            assert owner is not None
            statement = owner
        return statement

    def _hoist(self, name: str, before: ast.stmt) -> None:
        """Declare a variable before a statement, after all that tells its type."""
        self.declared_by.pop(name, None)
        self.typed_by[name] = before  # Until it is known: it tells no type itself.
        stores = [use.statement for use in self.uses[name] if use.is_store]
        stores = [each for each in stores if not isinstance(each, ast.AugAssign)]

        def hidden(store: ast.stmt) -> list[str]:
            return [each for each in _telling(store, name) if not self._is_seen(each, before)]

        store = min(stores, key=lambda each: (name in _telling(each, name), len(hidden(each))))
        for needed in hidden(store):
            if not self._is_seen(needed, before):
                self._hoist(needed, before)
        self.typed_by[name] = store
        self.before.setdefault(id(before), []).append(name)
        self.hoisted_to[name] = before

    def _is_seen(self, name: str, before: ast.stmt) -> bool:
        """Whether a variable is declared where a statement begins."""
        if not self.is_assigned(name):
            return True
        line = self.blocks[id(before)].line()
        if name in self.hoisted_to:
            place = self.hoisted_to[name]
            return self.blocks[id(place)] in line and place.lineno <= before.lineno
        if name not in self.declared_by:
            return name in self.parameters
        place, block = self.declared_by[name], self.uses[name][0].block
        return block in line and place.lineno < before.lineno

    def is_local(self, name: str) -> bool:
        return name in self.parameters or any(use.is_store for use in self.uses.get(name, []))

    def is_dropped(self, name: str) -> bool:
        """Whether nobody looks at a variable."""
        return name.startswith("_") and all(use.is_store for use in self.uses[name])

    def is_assigned(self, name: str) -> bool:
        return any(use.is_store for use in self.uses.get(name, []))


def _surely_assigns(statement: ast.stmt, name: str) -> bool:
    """Whether nothing that follows a statement finds a variable without a new value."""
    if isinstance(statement, ast.Return | ast.Continue | ast.Break):
        return True
    if isinstance(statement, ast.If):
        return bool(statement.orelse) and all(
            any(_surely_assigns(each, name) for each in branch)
            for branch in (statement.body, statement.orelse)
        )
    if isinstance(statement, ast.Assign | ast.AnnAssign):
        return (name, True) in list(_in_order(statement))
    return False


def _telling(store: ast.stmt, name: str) -> list[str]:
    """The names of the expression by which an assignment tells the type of a variable."""
    if isinstance(store, ast.AnnAssign):
        return []
    if isinstance(store, ast.For):
        value: ast.expr = store.iter
        if isinstance(value, ast.Call) and ast.unparse(value.func) == "range":
            return []
    else:
        assert isinstance(store, ast.Assign)
        value = next(
            (
                part
                for part in (part_for(each, store.value, name) for each in store.targets)
                if part
            ),
            store.value,
        )
    return [each for each, is_store in _in_order(value) if not is_store]


def part_for(target: ast.expr, value: ast.expr, name: str) -> ast.expr | None:
    """The expression that goes to a name where a tuple of as many is unpacked."""
    if isinstance(target, ast.Name) and target.id == name:
        return value
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        for each, part in zip(target.elts, value.elts, strict=True):
            found = part_for(each, part, name)
            if found is not None:
                return found
    return None


def _shared(blocks: list[Block]) -> Block:
    """The innermost block that holds all of them."""
    lines = [block.line() for block in blocks]
    shared = lines[0][0]
    for level in zip(*lines, strict=False):
        if any(block is not level[0] for block in level):
            break
        shared = level[0]
    return shared


def _in_order(node: ast.AST) -> Iterator[tuple[str, bool]]:
    """Names in the order in which they are looked at: values before targets."""
    if isinstance(node, ast.Assign | ast.AnnAssign):
        if node.value is not None:
            yield from _in_order(node.value)
        for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
            yield from _in_order(target)
    elif isinstance(node, ast.AugAssign):
        yield from _in_order(node.value)
        if isinstance(node.target, ast.Name):
            yield node.target.id, False
        yield from _in_order(node.target)
    elif isinstance(node, ast.Name):
        yield node.id, isinstance(node.ctx, ast.Store)
    else:
        for child in ast.iter_child_nodes(node):
            yield from _in_order(child)
