"""What the models that read files say of themselves: in docstrings, of fields too."""

from __future__ import annotations

import ast
import inspect
from textwrap import dedent

from pydantic import BaseModel


def purpose_of(model: type[BaseModel]) -> str:
    """The first line of a table's docstring, without the table's name."""
    text = inspect.getdoc(model) or ""
    _, _, purpose = text.partition(": ")
    return purpose[:1].upper() + purpose[1:]


def meanings_of(model: type[BaseModel]) -> dict[str, str]:
    """Docstrings of the fields, which Python itself does not keep; inherited ones too."""
    meanings: dict[str, str] = {}
    for ancestor in reversed(model.__mro__):
        if not issubclass(ancestor, BaseModel) or ancestor is BaseModel:
            continue
        (definition,) = ast.parse(dedent(inspect.getsource(ancestor))).body
        assert isinstance(definition, ast.ClassDef)
        body = definition.body
        for field, after in zip(body, [*body[1:], None], strict=True):
            if not isinstance(field, ast.AnnAssign) or not isinstance(field.target, ast.Name):
                continue
            if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                meanings[field.target.id] = " ".join(str(after.value.value).split())
    return meanings
