"""What some extras of pyproject.toml need: `python -m tools.requirements dev,docs`, a line each.

`make` installs that beside the compiler, which pip would keep waiting for it.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent


def requirements_of(extras: list[str], top: Path = REPOSITORY) -> list[str]:
    """Return the requirements of the package and of its extras, in the order of pyproject.toml."""
    project = tomllib.loads((top / "pyproject.toml").read_text("utf-8"))["project"]
    optional = project["optional-dependencies"]
    lists = [project["dependencies"], *(optional[extra] for extra in extras)]
    return [str(one) for each in lists for one in each]


if __name__ == "__main__":
    print("\n".join(requirements_of(sys.argv[1].split(","))))
