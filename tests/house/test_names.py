"""One name, one meaning: classes, public functions, and constants that other files import."""

import ast
from collections import defaultdict
from pathlib import Path

import clearway

PACKAGE = Path(clearway.__file__).parent
TREES = {
    str(file.relative_to(PACKAGE)): ast.parse(file.read_text(encoding="utf-8"))
    for file in sorted(PACKAGE.rglob("*.py"))
}
COMMAND = "a command of `cli/` bears the command's name, which is that of the library's function"
IN_SEVERAL_FILES = {"main": "the entry point of a program", "assess": COMMAND, "fly": COMMAND}
"""Public functions whose names may stand in several files, each with the reason."""


def more_than_once(places):
    return {name: found for name, found in places.items() if len(found) > 1}


def test_no_class_name_twice():
    places = defaultdict(list)
    for file, tree in TREES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(f"{file}:{node.lineno}")
    assert more_than_once(places) == {}
    assert len(places) > 300


def test_no_public_function_name_in_two_files():
    places = defaultdict(set)
    for file, tree in TREES.items():
        for node in tree.body:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name[0] != "_":
                places[node.name].add(file)
    assert more_than_once(places).keys() == IN_SEVERAL_FILES.keys()
    assert len(places) > 1000


def test_no_imported_constant_has_two_values():
    """A constant that nobody imports is its file's own."""
    values = {}
    for file, tree in TREES.items():
        module = "clearway." + file.removesuffix(".py").replace("/", ".")
        for node in tree.body:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", 0)]
            for target in targets:
                if isinstance(target, ast.Name) and target.id[0] != "_":
                    values[module, target.id] = ast.unparse(node.value) if node.value else ""
    places = defaultdict(dict)
    for tree in TREES.values():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    if (node.module, alias.name) in values:
                        places[alias.name][values[node.module, alias.name]] = node.module
    assert more_than_once(places) == {}
    assert len(places) > 200
