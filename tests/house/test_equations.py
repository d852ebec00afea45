"""The page that says where the paper's equations are computed: current, complete, and right."""

from __future__ import annotations

import re

from tools import equations
from tools.paper_tags import WITHOUT_COUNTERPART, titles

from repository import REPOSITORY

LAST = {3: 54, 4: 31, 5: 54, 6: 19}
"""The paper's last equation of each chapter."""


def test_every_number_of_the_paper_is_listed_once():
    expected = [f"({chapter}.{n})" for chapter, last in LAST.items() for n in range(1, last + 1)]
    expected += [f"def. {n}" for n in range(1, 26)]
    assert list(titles()) == expected


def test_every_number_is_found_in_the_code_or_has_a_reason():
    found = set(equations.places())
    neither = [tag for tag in titles() if tag not in found and tag not in WITHOUT_COUNTERPART]
    assert not neither, "tag where it is computed, or give a reason in tools/paper_tags.py"


def test_no_reason_is_given_for_what_the_code_has():
    found = set(equations.places())
    assert not [tag for tag in WITHOUT_COUNTERPART if tag in found]
    assert set(WITHOUT_COUNTERPART) <= set(titles())


def test_no_tag_is_of_a_number_that_the_paper_does_not_have():
    assert not set(equations.places()) - set(titles())


def test_the_page_is_current():
    assert equations.PAGE.read_text() == equations.page(), "run python -m tools.equations --write"


def test_every_place_on_the_page_is_where_the_tag_stands():
    rows = re.findall(
        r"^\| (\(\d\.\d+\)|def\. \d+) \|[^|]*\|(.*)\|$", equations.PAGE.read_text(), re.M
    )
    assert len(rows) == sum(LAST.values()) + 25
    for tag, where in rows:
        for path in re.findall(r"\]\(\.\./(src/[^)]+)\)", where):
            assert tag.lower() in (REPOSITORY / path).read_text().lower()
