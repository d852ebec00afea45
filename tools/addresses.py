"""The project's addresses: `python -m tools.addresses --write` takes them to where else they stand.

An owner fills them in under `[project.urls]` of pyproject.toml, and nowhere else.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
PLACES = (
    ("README.md", "Repository", r"^git clone (\S+) clearway$"),
    ("mkdocs.yml", "Repository", r"^repo_url: (\S+)$"),
    ("mkdocs.yml", "Documentation", r"^site_url: (\S+)$"),
    ("CITATION.cff", "Repository", r'^repository-code: "(\S+)"$'),
    ("CITATION.cff", "Documentation", r'^url: "(\S+)"$'),
)
"""A file, the address that it has, and the one line where it stands."""


def filled_in(top: Path = REPOSITORY) -> dict[str, str]:
    """Each file's text with the addresses of pyproject.toml.

    :param top: folder of the checkout.
    :raises ValueError: If a file has no such line, or more than one.
    """
    addresses = tomllib.loads((top / "pyproject.toml").read_text("utf-8"))["project"]["urls"]
    texts: dict[str, str] = {}
    for name, which, line in PLACES:
        text = texts.get(name) or (top / name).read_text("utf-8")
        found = list(re.finditer(line, text, re.MULTILINE))
        if len(found) != 1:
            raise ValueError(f"{name} has {len(found)} lines like {line}, not one")
        start, end = found[0].span(1)
        texts[name] = text[:start] + addresses[which] + text[end:]
    return texts


def main() -> None:
    for name, text in filled_in().items():
        if (REPOSITORY / name).read_text("utf-8") == text:
            continue
        print(name)
        if "--write" in sys.argv[1:]:
            (REPOSITORY / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
