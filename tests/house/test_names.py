"""One name, one meaning: no class of the package has the name of another."""

import ast
from collections import defaultdict
from pathlib import Path

import clearway


def test_no_class_name_twice():
    package = Path(clearway.__file__).parent
    places = defaultdict(list)
    for file in sorted(package.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(f"{file.relative_to(package)}:{node.lineno}")
    assert {name: found for name, found in places.items() if len(found) > 1} == {}
    assert len(places) > 300
