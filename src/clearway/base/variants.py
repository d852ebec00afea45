"""Variants by name: the one place where the names of a kind are written down.

Help texts, choices in files, colours and pages of the documentation are made from it. Where a kind
takes functions of users, these are named `module:name`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from clearway.base.errors import ClearwayError
from clearway.base.own_code import OWN_CODE_FORM, callable_own, is_own_code, load_own, locate_own
from clearway.base.suggest import did_you_mean

V = TypeVar("V")
Fit = Callable[[str, Any], V]
"""(kind and name, what a user's module has) -> a variant that tells its errors; or OwnCodeError."""


class Variants(Mapping[str, V], Generic[V]):
    """The variants of one kind by name, in the order in which they are reported."""

    def __init__(self, kind: str, built_in: Mapping[str, V], fit: Fit[V] | None = None) -> None:
        """fit: makes a variant of what `module:name` gives; None where own ones have no place."""
        self.kind = kind
        self.built_in = dict(built_in)
        self._fit = fit
        self._own: dict[str, V] = {}

    def __getitem__(self, name: str) -> V:
        return self.built_in[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.built_in)

    def __len__(self) -> int:
        return len(self.built_in)

    def __repr__(self) -> str:
        return f"Variants({self.kind}: {', '.join(self)})"

    @property
    def takes_own(self) -> bool:
        """Whether `module:name` has a place here."""
        return self._fit is not None

    def find(self, name: str, folder: Path | None = None) -> V:
        """The variant of a name, or a user's own; raises ClearwayError listing the valid ones.

        folder: where modules are looked for before the current one.
        """
        given: object = name
        if not isinstance(given, str):
            shown = type(given).__name__
            raise ClearwayError(f"{self.kind}: valid names are {self.choices}, got {shown}")
        if name in self.built_in:
            return self.built_in[name]
        if self._fit is None or not is_own_code(name):
            near = did_you_mean(name, self.built_in)
            valid = f"valid {self.kind}s are {self.choices}"
            raise ClearwayError(f"{self.kind} {name!r}{near}: {valid}")
        place = locate_own(name, folder)
        if place not in self._own:
            label = f"{self.kind} {name}"
            self._own[place] = self._fit(label, load_own(self.kind, name, folder))
        return self._own[place]

    def locate(self, name: str, folder: Path | None = None) -> str:
        """The name itself, of a user's own one with its file: it is found again from anywhere.

        Errors as of `find`.
        """
        self.find(name, folder)
        return locate_own(name, folder) if name not in self.built_in else name

    def about(self, name: str) -> str:
        """What a variant is, in a line: the first of its documentation."""
        found: Any = self.built_in[name]
        found = found.func if isinstance(found, partial) else found
        text = getattr(found, "about", None) or inspect.getdoc(found) or ""
        return str(text).strip().partition("\n")[0]

    @property
    def choices(self) -> str:
        """What is valid, in words."""
        own = [f"your own as {OWN_CODE_FORM}"] if self.takes_own else []
        return join_choices([*self.built_in, *own])


def fitting(*takes: str) -> Fit[Any]:
    """Functions that take these arguments by place, as they are."""
    return lambda label, found: callable_own(label, found, takes)


def join_choices(names: list[str]) -> str:
    """a, b or c."""
    *first, last = names
    return f"{', '.join(first)} or {last}" if first else last
