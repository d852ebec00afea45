"""The table of dependencies' licences: `python -m tools.licences --write` makes docs/licences.md.

Of the packages that each extra names; what they bring along is not followed further than that.
"""

from __future__ import annotations

import re
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).resolve().parent.parent
PAGE = REPOSITORY / "docs" / "licences.md"
NAME = re.compile(r"[A-Za-z0-9_.-]+")
LONGEST = 40
REMARKS = {
    "pymavlink": "used unchanged; the LGPL asks to name it, and to allow another in its place",
    "ouster-sdk": "the maker's own terms hold for its data and firmware",
}
HEAD = """\
<!-- Made by `python -m tools.licences --write`. -->

# Licences of dependencies

clearway is under the Apache License 2.0 and contains none of these packages: whoever installs it
gets them from their makers. Each says its licence itself; the table repeats that.

| package | for | licence, as it says | remark |
| --- | --- | --- | --- |
"""


def page() -> str:
    """The whole page; a package that is not installed is told as such."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    wanted: dict[str, list[str]] = {}
    for extra, names in [
        ("core", project["dependencies"]),
        *project["optional-dependencies"].items(),
    ]:
        for one in names:
            found = NAME.match(one)
            assert found is not None
            wanted.setdefault(found[0].lower(), []).append(extra)
    rows = [
        f"| {name} | {', '.join(extras)} | {licence_of(name)} | {REMARKS.get(name, '')} |"
        for name, extras in sorted(wanted.items())
    ]
    return HEAD + "\n".join(rows) + "\n"


def licence_of(name: str) -> str:
    """What a package says: its expression, else its classifier, else its field."""
    try:
        about: Any = metadata(name)  # Its type knows no `get`, which it has.
    except PackageNotFoundError:
        return "(not installed where this page was made)"
    if about.get("License-Expression"):
        return str(about["License-Expression"])
    classified = [
        one.rpartition(" :: ")[2]
        for one in about.get_all("Classifier") or []
        if one.startswith("License :: ") and not one.endswith("OSI Approved")
    ]
    if classified:
        return ", ".join(classified)
    field = " ".join(str(about.get("License") or "not said").split())
    return field if len(field) <= LONGEST else field[:LONGEST] + " ..."


def main() -> None:
    if "--write" in sys.argv[1:]:
        PAGE.write_text(page(), encoding="utf-8")
    else:
        sys.stdout.write(page())


if __name__ == "__main__":
    main()
