"""XML as a tree of plain values with line numbers: names without namespaces, and no entities.

By expat alone. A document that declares entities is refused: they can grow without bound, or name
other files.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NoReturn
from xml.parsers import expat

MOST_ELEMENTS = 2_000_000
DEEPEST = 100


@dataclass(slots=True, eq=False)
class Element:
    """One element of a document."""

    name: str
    """Without its namespace."""
    line: int
    attributes: dict[str, str]
    text: str = ""
    """What stands in it before its first child, and between children, without blanks around."""
    children: list[Element] = field(default_factory=list)

    def child(self, name: str) -> Element | None:
        """The first child of a name."""
        return next((one for one in self.children if one.name == name), None)

    def read_text(self, name: str) -> str:
        """Text of the first child of a name; empty where there is none."""
        found = self.child(name)
        return "" if found is None else found.text

    def every(self, *names: str) -> Iterator[Element]:
        """Elements of these names below it, in the order of the document, none within another."""
        for one in self.children:
            if one.name in names:
                yield one
            else:
                yield from one.every(*names)


def parse_xml(content: bytes) -> Element:
    """The root of a document. Raises ValueError with line and column where it is none."""
    root = Element("", 0, {})
    open_elements, texts, count = [root], [[""]], 0
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MOST_ELEMENTS or len(open_elements) > DEEPEST:
            raise ValueError(
                f"line {parser.CurrentLineNumber}: more than {MOST_ELEMENTS:,} elements, or deeper "
                f"than {DEEPEST}"
            )
        plain = {_local(key): value for key, value in attributes.items()}
        one = Element(_local(name), parser.CurrentLineNumber, plain)
        open_elements[-1].children.append(one)
        open_elements.append(one)
        texts.append([])

    def end(_name: str) -> None:
        open_elements.pop().text = "".join(texts.pop()).strip()

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = lambda words: texts[-1].append(words)
    parser.EntityDeclHandler = _refuse_entity
    try:
        parser.Parse(content, True)
    except expat.ExpatError as cause:
        raise ValueError(
            f"line {cause.lineno} column {cause.offset + 1}: {expat.ErrorString(cause.code)}"
        ) from cause
    return root.children[0]


def _local(name: str) -> str:
    return name.rpartition(" ")[2].rpartition(":")[2]


def _refuse_entity(name: str, *_: Any) -> NoReturn:
    raise ValueError(f"it declares an entity ({name[:40]!r}); none are taken")
