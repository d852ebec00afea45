"""Where the paper's equations and definitions are computed, by tags in docstrings and comments.

`python -m tools.equations` prints the page, with `--write` into docs/equations.md. A tag is
"(4.22)" or "def. 20", in a docstring or comment of src/clearway; ranges do not count, so that
whoever greps for a number finds its place.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from tools.paper_tags import WITHOUT_COUNTERPART, titles

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "src" / "clearway"
PAGE = ROOT / "docs" / "equations.md"
TAG = re.compile(r"\([3-6]\.\d{1,2}\)|\bdef\. \d{1,2}", re.IGNORECASE)

HEAD = """\
<!-- Made by `python -m tools.equations --write` from docstrings and comments. -->

# The paper in the code

Where each numbered equation and definition of the paper is computed, or why it is not. Every place
carries the tag as it stands here, so `grep -rn "(4.22)" src` or `grep -rn "def. 20" src` finds it.
Where the code reads an equation otherwise than it is printed, the docstring there says how.
"""


@cache
def places() -> dict[str, list[tuple[str, str]]]:
    """By tag: file below src/clearway and qualified name, empty for the module itself, in order."""
    found: dict[str, list[tuple[str, str]]] = defaultdict(list)
    for path in sorted(SOURCE.rglob("*.py")):
        text = path.read_text()
        if not TAG.search(text):  # taking a file apart takes long
            continue
        name = path.relative_to(SOURCE).as_posix()
        owners = _owners(ast.parse(text))
        for line, words in _remarks(text):
            owner = next((qualified for low, high, qualified in owners if low <= line <= high), "")
            for match in TAG.finditer(words):
                at = line + words.count("\n", 0, match.start())
                inner = next((q for low, high, q in owners if low <= at <= high), owner)
                tag = match.group().replace("Def.", "def.")
                if (name, inner) not in found[tag]:
                    found[tag].append((name, inner))
    return dict(found)


def _owners(tree: ast.Module) -> list[tuple[int, int, str]]:
    """First line, last line and qualified name of every function and class, innermost first."""
    owners: list[tuple[int, int, str]] = []

    def visit(node: ast.AST, above: str) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                name = f"{above}{child.name}"
                visit(child, f"{name}.")
                owners.append((child.lineno, child.end_lineno or child.lineno, name))
            else:
                visit(child, above)

    visit(tree, "")
    return owners


def _remarks(text: str) -> Iterator[tuple[int, str]]:
    """First line and text of every comment, and of every string that stands alone."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            segment = ast.get_source_segment(text, node)
            if isinstance(node.value.value, str) and segment is not None:
                yield node.lineno, segment


def page() -> str:
    """The page: every tag in the paper's order, with its places or its reason."""
    found = places()
    lines = [HEAD]
    for heading, is_definition in (("Definitions", True), ("Equations", False)):
        lines += [f"## {heading}", "", "| | what | where |", "|---|---|---|"]
        for tag, title in titles().items():
            if tag.startswith("def.") == is_definition:
                lines.append(f"| {tag} | {title} | {_where(tag, found)} |")
        lines.append("")
    return "\n".join(lines)


def _where(tag: str, found: dict[str, list[tuple[str, str]]]) -> str:
    if tag in found:
        return ", ".join(
            f"[{path}](../src/clearway/{path})" + (f" `{name}`" if name else "")
            for path, name in found[tag]
        )
    return f"no counterpart: {WITHOUT_COUNTERPART[tag]}" if tag in WITHOUT_COUNTERPART else "?"


def main() -> None:
    """Print the page, or write it."""
    if "--write" in sys.argv[1:]:
        PAGE.write_text(page())
    else:
        print(page(), end="")


if __name__ == "__main__":
    main()
