"""Packages that are taken away for a test, to see which extra is named."""

from __future__ import annotations

import sys

import pytest


def without(monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    """Let a package be absent, with the modules of it that are loaded already."""
    loaded = [name for name in sys.modules if name.startswith(f"{package}.")]
    for name in (package, *loaded):
        monkeypatch.setitem(sys.modules, name, None)
