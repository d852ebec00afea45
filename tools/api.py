"""The page of the public names, from their docstrings.

`python -m tools.api` prints it, with `--write` into docs/api.md.
"""

from __future__ import annotations

import ast
import dataclasses
import enum
import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from textwrap import dedent
from typing import Any, NamedTuple

from pydantic import BaseModel

import clearway

PAGE = Path(__file__).resolve().parent.parent / "docs" / "api.md"
HEAD = """\
<!-- Made by `python -m tools.api --write`: change the docstrings in src/clearway instead. -->

# The public names

`import clearway as cw` gives these, and they are the promise: they change with a line in the
[changelog](../CHANGELOG.md) only. Lengths are metres, times seconds, angles radians unless a name
says otherwise. World and body have z up; roll, pitch, yaw are in that order, **pitch positive nose
down**, yaw positive left. `[n, 3]` is the shape of an array. What cannot be used raises
`ClearwayError`, a `ValueError`, that names place, cause and valid choices. Examples run as printed,
in the folder `examples/scenes`.
"""
GROUPS = {
    "Files": ("read_scan", "read_scans", "read_mission", "read_traffic", "read_map"),
    "What is done with them": (
        "assess",
        "fly",
        "simulate",
        "decide",
        "build_reach_set",
        "air_picture",
        "draw_assessment",
        "draw_flight",
    ),
}
"""The functions in the order of use; classes follow by name."""


def page() -> str:
    """The whole page."""
    functions = [name for names in GROUPS.values() for name in names]
    rest = [name for name in clearway.__all__ if name not in functions and name != "__version__"]
    parts = [HEAD]
    for title, names in {**GROUPS, "Values": tuple(rest)}.items():
        parts += [f"\n## {title}\n", *(part for name in names for part in _told(name))]
    return "".join(parts)


def _told(name: str) -> Iterator[str]:
    value = getattr(clearway, name)
    yield f"\n### `{name}`\n\n```text\n{_signature(name, value)}\n```\n\n{_doc(value)}"
    if isinstance(value, type) and not issubclass(value, BaseException):
        yield _fields(value)
        yield _methods(name, value)


def _signature(name: str, value: Any) -> str:
    """As the source has it, a line an argument where it is long."""
    try:
        signature = inspect.signature(value)
    except ValueError:
        return name
    if isinstance(value, type) and issubclass(value, BaseException | BaseModel):
        return f"class {name}"
    signature = signature.replace(
        parameters=[
            parameter.replace(default=_Plain(parameter.default))
            if parameter.default is not inspect.Parameter.empty
            else parameter
            for parameter in signature.parameters.values()
        ]
    )
    text = str(signature).replace("'", "")
    if isinstance(value, type):
        text = text.removesuffix(" -> None")
    if len(name) + len(text) <= 96:
        return f"{name}{text}"
    inside, _, after = text[1:].rpartition(")")
    arguments = re.split(r", (?=[\w*]+(?:: | =|,|$)|\*)", inside)
    return f"{name}(\n" + "".join(f"    {one},\n" for one in arguments) + f"){after}"


@dataclasses.dataclass(frozen=True)
class _Plain:
    """A default as it is written."""

    value: object

    def __repr__(self) -> str:
        if isinstance(self.value, enum.Enum):
            return str(self.value)
        text = re.sub(r" at 0x\w+", "", repr(self.value))
        return "..." if text.startswith("<") else text.replace("'", '"')


SECTION = re.compile(r"^(\w+)\n-+\n", re.MULTILINE)
"""The heading of a section, as NumPy writes it."""


class Docstring(NamedTuple):
    """A docstring taken apart."""

    prose: str
    sections: dict[str, str]
    """Text by heading, such as Parameters."""

    @classmethod
    def of(cls, value: Any) -> Docstring:
        prose, *rest = SECTION.split(inspect.getdoc(value) or "")
        return cls(prose.strip(), dict(zip(rest[::2], rest[1::2], strict=True)))

    def entries(self, heading: str) -> dict[str, str]:
        """What a section lists: names, or types, with their meanings in one line."""
        found: dict[str, list[str]] = {}
        for line in self.sections.get(heading, "").splitlines():
            if line and not line.startswith(" "):
                found[line] = meaning = []
            elif line:
                meaning.append(line.strip())
        return {name: " ".join(meaning) for name, meaning in found.items()}


def _doc(value: Any) -> str:
    """The docstring, its sections as lists and its examples as code."""
    docstring = Docstring.of(value)
    parts = [docstring.prose]
    for heading in docstring.sections:
        if heading == "Examples":
            parts.append(docstring.sections[heading].strip())
        else:
            entries = docstring.entries(heading).items()
            listed = "\n".join(f"- `{name}`: {meaning}" for name, meaning in entries)
            parts.append(f"**{heading}**\n\n{listed}")
    return re.sub(
        r"(?:^>>> .*\n?(?:^(?!>>> |\n).+\n?|^>>> .*\n?)*)+",
        lambda example: f"```pycon\n{example[0].rstrip()}\n```\n",
        "\n\n".join(parts) + "\n",
        flags=re.MULTILINE,
    )


def _fields(value: type) -> str:
    """A table of fields with their docstrings, which Python itself does not keep."""
    rows = [(name, kind, text) for name, (kind, text) in _documented(value).items()]
    if not rows:
        return ""
    lines = ["\n| field | type | meaning |", "| --- | --- | --- |"]
    lines += [f"| `{n}` | `{k.replace(' | None', ' or None')}` | {t} |" for n, k, t in rows]
    return "\n".join(lines) + "\n"


def _documented(value: type) -> dict[str, tuple[str, str]]:
    """Type and meaning of every field, inherited ones first."""
    found: dict[str, tuple[str, str]] = {}
    for ancestor in reversed(value.__mro__):
        if not ancestor.__module__.startswith("clearway"):
            continue
        (definition,) = ast.parse(dedent(inspect.getsource(ancestor))).body
        assert isinstance(definition, ast.ClassDef)
        body = definition.body
        for field, after in zip(body, [*body[1:], None], strict=True):
            if not isinstance(field, ast.AnnAssign) or not isinstance(field.target, ast.Name):
                continue
            told = ""
            if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                told = " ".join(str(after.value.value).split())
            if not field.target.id.startswith("_"):
                found[field.target.id] = (ast.unparse(field.annotation), told.replace("|", "\\|"))
    return found


def _methods(name: str, value: type) -> str:
    """Public methods and properties in their order, each with its first line and its sections."""
    lines, fields = [], _documented(value)
    for ancestor in value.__mro__:
        if not ancestor.__module__.startswith("clearway"):
            continue
        for key, found in vars(ancestor).items():
            told = (inspect.getdoc(found) or "").split("\n\n")[0].replace("\n", " ")
            if key.startswith("_") or not told or key in fields:
                continue
            if isinstance(found, property) or hasattr(found, "attrname"):
                lines.append(f"- `{name}.{key}`: {told}\n")
            elif callable(getattr(value, key)):
                signature = _signature(f"{name}.{key}", getattr(value, key))
                signature = re.sub(r",?\n(?=\))|(?<=\()\n    ", "", signature)
                signature = re.sub(r"\n    ", " ", signature)
                signature = re.sub(r"(?<=\()self(?:, )?", "", signature)
                lines.append(f"- `{signature}`: {told}\n{_listed(found)}")
    return ("\n" + "".join(lines)) if lines else ""


def _listed(method: Any) -> str:
    """The sections of a method as a list below its line."""
    docstring = Docstring.of(method)
    lines = [f"`{name}`: {meaning}" for name, meaning in docstring.entries("Parameters").items()]
    lines += [f"Returns: {meaning}" for meaning in docstring.entries("Returns").values()]
    lines += [
        f"Raises `{name}`: {meaning}" for name, meaning in docstring.entries("Raises").items()
    ]
    return "".join(f"    - {line}\n" for line in lines)


def main() -> None:
    if sys.argv[1:] == ["--write"]:
        PAGE.write_text(page(), encoding="utf-8")
    elif sys.argv[1:]:
        raise SystemExit("python -m tools.api [--write]")
    else:
        sys.stdout.write(page())


if __name__ == "__main__":
    main()
