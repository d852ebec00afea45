"""Plants flown at their own scale: `python -m tools.plants`.

Flies the missions of examples/missions/plants and random worlds, by the measured automata of
examples/automata, and prints the tables of docs/results/plants.md; with `--write` into the page.
Every flight is a line of a journal: what is in it is not flown again.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from clearway.io.marked_page import put_between_marks
from tools.plants import missions, page, picture, study, tubes
from tools.plants.worlds import AUTOMATA, FAMILIES, REPOSITORY, SCALES

TUBES_PAGE = REPOSITORY / "docs" / "plants.md"
PAGE = REPOSITORY / "docs" / "results" / "plants.md"


def main(arguments: Sequence[str]) -> None:
    """Fly, and print or write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=20, help="of each kind; half with faults")
    measured = [one.plant for one in SCALES if (AUTOMATA / f"{one.plant}.toml").exists()]
    parser.add_argument("--plants", default=",".join(measured), help="those in examples/automata")
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--minutes", type=float, default=1e9, help="after which none is begun")
    parser.add_argument("--journal", type=Path, default=REPOSITORY / "build" / "plants.jsonl")
    parser.add_argument("--write", action="store_true", help="tables and picture, into the page")
    parser.add_argument("--tubes", action="store_true", help="the tubes of docs/plants.md alone")
    given = parser.parse_args(arguments)
    if given.tubes:
        put_between_marks(TUBES_PAGE, "tubes", "\n".join(tubes.tubes(("quadrotor", "F450"))))
        return
    shown = missions.fly_all(given.journal.with_name("plant-missions.jsonl"))
    plants, families = given.plants.split(","), given.families.split(",")
    study.fly_all(given.journal, plants, families, given.worlds, given.minutes)
    flights = study.journalled(given.journal)
    parts = (
        page.predicted(page.automata()),
        page.shown(shown),
        page.said(flights),
        page.flown(flights),
        page.held(flights),
    )
    made = "\n\n".join("\n".join(part) for part in parts if part)
    if given.write:
        put_between_marks(PAGE, "plants", made)
        picture.draw(shown)
    else:
        print(made)


if __name__ == "__main__":
    main(sys.argv[1:])
