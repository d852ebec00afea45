"""Hooks of the documentation's site: links that lead out of docs/, changelog, public names."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).resolve().parent.parent
LINK = re.compile(r"(\]\()([^)\s:#]+)((?:#[^)\s]*)?\))")
CHANGELOG, PYTHON = "changelog.md", "python.md"
FROM = re.compile(r"^    from (clearway\S+) import (.+)$", re.MULTILINE)


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """The text of a page with its links made to lead somewhere on the site, or out of it."""
    here = posixpath.dirname(page.file.src_uri)
    if page.file.src_uri == CHANGELOG:
        markdown, here = (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8"), ".."
    if page.file.src_uri == PYTHON:
        markdown += "".join(f"\n::: {name}\n" for name in public_names())
    return LINK.sub(lambda found: _link(found, here, config), markdown)


def public_names() -> list[str]:
    """Whole paths of all public names, by name."""
    text = (REPOSITORY / "src" / "clearway" / "__init__.py").read_text(encoding="utf-8")
    found = [(name, room) for room, names in FROM.findall(text) for name in names.split(", ")]
    return [f"{room}.{name}" for name, room in sorted(found, key=lambda one: one[0].lower())]


def _link(found: re.Match[str], here: str, config: Any) -> str:
    target = posixpath.normpath(posixpath.join("docs", here, found[2]))
    if target == "CHANGELOG.md":
        away = posixpath.relpath(CHANGELOG, here if here != ".." else ".")
        return f"{found[1]}{away}{found[3]}"
    if target.startswith("docs/"):
        inside = posixpath.relpath(target, "docs" if here == ".." else posixpath.join("docs", here))
        return f"{found[1]}{inside}{found[3]}"
    if not (REPOSITORY / target).exists():
        return found[0]  # told by the strict build
    kind = "tree" if (REPOSITORY / target).is_dir() else "blob"
    return f"{found[1]}{config['repo_url']}/{kind}/main/{target}{found[3]}"
