"""Reads the YAML files of parameters that ROS 2 users know, without ROS."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from clearway.base.errors import InputError, MissingExtraError
from clearway.ros2.parameters import NODE, NodeParameters, list_problems, parameters_of

MOST_BYTES = 1 << 20
DEEPEST = 20
"""Namespaces within each other."""
VALUES = "ros__parameters"


def read_parameters(path: Path, node: str = NODE, namespace: str = "") -> NodeParameters:
    """Return the parameters that a file has for a node; InputError names what is wrong with them.

    Sections count as in ROS: the node's full name, wildcards (`/**`, `/*/clearway`), namespaces
    within each other, dotted names; later sections go before earlier ones.
    """
    full = "/".join(["", *namespace.strip("/").split("/"), node]).replace("//", "/")
    found: dict[str, Any] = {}
    try:
        for name, values in _sections(_load(path), ""):
            if _is_of(name, full):
                merge(found, values)
    except RecursionError as cause:
        raise InputError(str(path), "no YAML: nested too deeply") from cause
    if not found:
        raise InputError(str(path), f"no {VALUES} of {full} or /**")
    try:
        return parameters_of(found, path.parent)
    except ValidationError as refused:
        raise InputError(str(path), list_problems(refused)) from refused


def merge(found: dict[str, Any], values: Mapping[Any, Any]) -> None:
    """Add nested values to others, dotted names as what they stand for."""
    for key, value in values.items():
        first, _, rest = str(key).partition(".")
        given = {rest: value} if rest else value
        if not isinstance(given, Mapping):
            found[first] = given
            continue
        if not isinstance(found.get(first), dict):
            found[first] = {}
        merge(found[first], given)


def _load(path: Path) -> object:
    try:
        from ruamel.yaml import YAML
        from ruamel.yaml.error import YAMLError
    except ImportError as cause:
        raise MissingExtraError("reading ROS 2 parameters", "ros2") from cause
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError(str(path), f"is no parameter file: more than {MOST_BYTES} bytes")
        return YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except OSError as cause:
        raise InputError(str(path), f"cannot be read: {cause.strerror or cause}") from cause
    except (YAMLError, UnicodeDecodeError, ValueError, RecursionError) as cause:
        first = str(cause).strip().splitlines()[0] if str(cause) else type(cause).__name__
        raise InputError(str(path), f"no YAML: {first}") from cause


def _sections(tree: object, within: str, depth: int = 0) -> Iterator[tuple[str, Mapping[Any, Any]]]:
    """Names of nodes, and the values that stand below them."""
    if not isinstance(tree, Mapping) or depth > DEEPEST:
        return
    for key, below in tree.items():
        if key == VALUES:
            if isinstance(below, Mapping):
                yield within, below
            continue
        yield from _sections(below, f"{within}/{str(key).strip('/')}", depth + 1)


def _is_of(name: str, full: str) -> bool:
    """Whether a name, in which * stands for one part and ** for any number, is that of a node."""
    parts = [part for part in name.split("/") if part]
    kinds = {"**": "(/[^/]+)*", "*": "/[^/]+"}
    return bool(re.fullmatch("".join(kinds.get(p, "/" + re.escape(p)) for p in parts), full))
