"""One name, one meaning: classes, public functions, and constants that other files import."""

import ast
import re
from collections import defaultdict
from pathlib import Path

import pytest

import clearway

PACKAGE = Path(clearway.__file__).parent
COMMAND = "a command of `cli/` bears the command's name, which is that of the library's function"
IN_SEVERAL_FILES = {"main": "the entry point of a program", "assess": COMMAND, "fly": COMMAND}
"""Public functions whose names may stand in several files, each with the reason."""


@pytest.fixture(scope="module")
def trees():
    """Every file of the package, parsed when a test asks: each process collects this module."""
    return {
        str(file.relative_to(PACKAGE)): ast.parse(file.read_text(encoding="utf-8"))
        for file in sorted(PACKAGE.rglob("*.py"))
    }


def more_than_once(places):
    return {name: found for name, found in places.items() if len(found) > 1}


def test_no_class_name_twice(trees):
    places = defaultdict(list)
    for file, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(f"{file}:{node.lineno}")
    assert more_than_once(places) == {}
    assert len(places) > 300


def test_no_public_function_name_in_two_files(trees):
    places = defaultdict(set)
    for file, tree in trees.items():
        for node in tree.body:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name[0] != "_":
                places[node.name].add(file)
    assert more_than_once(places).keys() == IN_SEVERAL_FILES.keys()
    assert len(places) > 1000


def test_no_imported_constant_has_two_values(trees):
    """A constant that nobody imports is its file's own."""
    values = {}
    for file, tree in trees.items():
        module = "clearway." + file.removesuffix(".py").replace("/", ".")
        for node in tree.body:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", 0)]
            for target in targets:
                if isinstance(target, ast.Name) and target.id[0] != "_":
                    values[module, target.id] = ast.unparse(node.value) if node.value else ""
    places = defaultdict(dict)
    for tree in trees.values():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    if (node.module, alias.name) in values:
                        places[alias.name][values[node.module, alias.name]] = node.module
    assert more_than_once(places) == {}
    assert len(places) > 200


IRREGULAR = re.compile(
    "begun|borne|brought|built|caught|chosen|dealt|done|drawn|driven|fallen|felt|flown|forbidden|"
    "forgotten|fought|frozen|given|gone|grown|heard|held|hidden|kept|known|laid|led|lost|made|meant|"
    "met|paid|said|seen|sent|shown|slept|sought|sold|spent|spun|stood|stuck|sunk|swept|taken|taught|"
    "thought|told|torn|understood|unseen|won|worn|woven|written"
)
"""Participles that are no verbs in the present as well, as `set`, `cut` or `read` are."""
NO_PARTICIPLE = re.compile("bleed|breed|embed|exceed|feed|ned|need|proceed|seed|shed|speed")


def begins_with_participle(name: str) -> bool:
    word = name.lstrip("_").split("_")[0]
    is_regular = word.endswith("ed") and not NO_PARTICIPLE.fullmatch(word)
    return is_regular or IRREGULAR.fullmatch(word) is not None


def function_names(tree: ast.AST) -> set[str]:
    """Functions and methods of a module; properties are values, decorators adjectives."""
    functions = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    return {
        function.name
        for function in functions
        if not any(
            re.search(r"property|\.setter", ast.unparse(one)) for one in function.decorator_list
        )
    }


def decorator_names(trees) -> set[str]:
    return {
        ast.unparse(getattr(one, "func", one))
        for tree in trees.values()
        for node in ast.walk(tree)
        for one in getattr(node, "decorator_list", ())
    }


def test_functions_begin_with_verbs_not_participles(trees):
    decorators = decorator_names(trees)
    found = {
        file: names
        for file, tree in trees.items()
        if (names := {n for n in function_names(tree) - decorators if begins_with_participle(n)})
    }
    assert found == {}


@pytest.mark.parametrize("name", ["told", "_flown", "placed_at", "seen_again", "coated"])
def test_participles_are_found(name):
    assert begins_with_participle(name)


@pytest.mark.parametrize("name", ["feed", "needs_map", "set_speed", "read", "ned_from_enu", "edge"])
def test_verbs_and_nouns_are_none(name):
    assert not begins_with_participle(name)


RANGE = re.compile(r"range\([-\d, ]+\)")


def constants_in_one_line(tree: ast.Module) -> list[str]:
    """`A, B = 1, 2`, or by `range`; what is unpacked of something computed is one thing."""
    return [
        ast.unparse(node.targets[0])
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Tuple)
        and (isinstance(node.value, ast.Tuple) or RANGE.fullmatch(ast.unparse(node.value)))
        and ast.unparse(node.targets[0]).isupper()
    ]


def test_constants_stand_one_a_line(trees):
    found = {file: names for file, tree in trees.items() if (names := constants_in_one_line(tree))}
    assert found == {}


@pytest.mark.parametrize("line", ["A, B = 1, 2", "LOW_M, HIGH_M = -1.0, 1.0", "A, B = range(2)"])
def test_several_in_one_line_are_found(line):
    assert constants_in_one_line(ast.parse(line))


@pytest.mark.parametrize("line", ["A = (1, 2)", "A, B = OTHERS", "a, b = 1, 2"])
def test_one_a_line_is_let_pass(line):
    assert constants_in_one_line(ast.parse(line)) == []
