"""`python -m clearway_build`: the core of this checkout, built where it is not as its sources."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from clearway_build.build import FLAVOURS, build_core
from clearway_build.errors import BuildError
from clearway_build.placed import place

ROOT = Path(__file__).parent.parent.parent
BAD_INPUT = 2


def main() -> int:
    """Build and place the core; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m clearway_build", description=__doc__)
    parser.add_argument("--flavour", choices=FLAVOURS, default="fast")
    flavour = parser.parse_args().flavour
    try:
        built = build_core(ROOT, flavour=flavour)
        place(ROOT, built.path)
    except BuildError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    print(built.report)
    return 0


if __name__ == "__main__":
    sys.exit(main())
