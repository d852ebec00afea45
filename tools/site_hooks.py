"""Hooks of the documentation's site: links that lead out of docs/, changelog, order of search."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).resolve().parent.parent
LINK = re.compile(r"(\]\()([^)\s:#]+)((?:#[^)\s]*)?\))")
CHANGELOG = "changelog.md"
# How much a page counts in a search, by its place in the navigation.
BOOSTS = {"Start": 4.0, "Tutorials": 2.0, "Background": 0.5, "Project": 0.25}
# Pages that answer what strangers search for. Results are out of the search by their own heads.
BOOSTED = {
    "index.md": 2.0,
    "safety.md": 10.0,
    "tutorials/own-drone.md": 10.0,
    "px4.md": 4.0,
}


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """Return the text of a page with its links made to lead somewhere on the site, or out of it."""
    source = page.file.src_uri
    section = page.ancestors[-1].title if page.ancestors else ""
    boost = BOOSTED.get(source, BOOSTS.get(section, 1.0))
    page.meta.setdefault("search", {"boost": boost})
    here = posixpath.dirname(source)
    if source == CHANGELOG:
        markdown, here = (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8"), ".."
    return LINK.sub(lambda found: _link(found, here, config), markdown)


def _link(found: re.Match[str], here: str, config: Any) -> str:
    target = posixpath.normpath(posixpath.join("docs", here, found[2]))
    if target == "CHANGELOG.md":
        away = posixpath.relpath(CHANGELOG, here if here != ".." else ".")
        return f"{found[1]}{away}{found[3]}"
    if target.startswith("docs/"):
        inside = posixpath.relpath(target, "docs" if here == ".." else posixpath.join("docs", here))
        return f"{found[1]}{inside}{found[3]}"
    if not (REPOSITORY / target).exists():
        return found[0]  # The strict build reports it.
    kind = "tree" if (REPOSITORY / target).is_dir() else "blob"
    return f"{found[1]}{config['repo_url']}/{kind}/main/{target}{found[3]}"
