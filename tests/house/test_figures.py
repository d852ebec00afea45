"""Every measured figure of the documentation stands in one result, which names its command."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest
from tools.figures import (
    MEASURED,
    RESULTS,
    SOURCE,
    Row,
    WrongFigureError,
    check,
    main,
    pages,
    prose,
    rows_of,
    wrong_quotes,
)

from repository import GENERATED_PAGES, REPOSITORY

WRITTEN = [
    page for page in pages() if RESULTS not in page.parents and page.name not in GENERATED_PAGES
]
NO_MEASUREMENT = {
    "": {"95 %": "the confidence of every interval"},
    "decisions.md": {"60 %": "share of returns that makes a cluster a moving one"},
    "campaign.md": {
        "200 flights": "of a family of the file",
        "1.5 times": "what counts as direct",
    },
    "encounters.md": {"99.9 %": "a target", "99 %": "a target"},
    "faults.md": {
        "97 %": "a level",
        "99 %": "a level",
        "0.4 %": "of the example",
        "0.03 %": "from which lone returns wait, a setting",
        "1 %": "from which there is an alarm, a setting",
    },
    "guardian.md": {"10 ms": "within which commands are taken as one"},
    "hand.md": {"20 ms": "after which it sends, a setting"},
    "limits.md": {"69 %": "of any ten of ten"},
    "measured.md": {"89 %": "of any thirty of thirty"},
    "mavlink-messages.md": {
        "0.3 %": "by which scales of autopilots differ",
        "20 ms": "after which the link is read again, a setting",
    },
    "peers.md": {"1.05 times": "a setting of ORCA"},
    "plants.md": {"999 of 1,000": "what the tube holds", "99 %": "what the tube holds"},
    "risk.md": {
        "10 %": "reports lost, a setting",
        "30 %": "reports lost, a setting",
        "300 encounters": "asked for",
        "3 ms": "a target",
    },
    "risk-method.md": {
        "1000 encounters": "asked for",
        "1.15 times": "a margin, set",
        "97 to 100 %": "of simulated studies: tests/base/test_intervals.py",
    },
    "own-drone.md": {"80 %": "a recommendation"},
    "safety.md": {"1 %": "of lone returns, from which there is an alarm, a setting"},
    "volumes.md": {
        "75 %": "by which climb rates miss the heights flown to be set aside, a setting"
    },
    "sight.md": {"1.5 times": "what counts as direct"},
}
"""What reads like a measurement and is none: definitions, settings, targets; by page."""


@pytest.mark.parametrize("page", pages(), ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_figures_are_quoted_as_the_results_say(page: Path) -> None:
    wrong = wrong_quotes(page, page.read_text(encoding="utf-8"))
    said = [f"{quote['where']}: {why}" for quote, why in wrong]
    assert said == [], "python -m tools.figures --write puts right what can be"


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_no_measured_figure_stands_on_a_page_without_its_result(page: Path) -> None:
    found = Counter(one[0] for one in MEASURED.finditer(prose(page.read_text(encoding="utf-8"))))
    own = NO_MEASUREMENT.get(page.name, {})
    known = {**NO_MEASUREMENT[""], **own}
    assert [one for one in found if one not in known] == [], "quote a result, or say less"
    assert [one for one in own if one not in found] == [], "no longer on the page"


SECTIONS = [
    (page.name, section)
    for page in sorted(RESULTS.glob("*.md"))
    if page.name not in ("index.md", "missions.md")
    for section in page.read_text(encoding="utf-8").split("\n## ")[1:]
    if "\n| " in section
]


@pytest.mark.parametrize(("page", "section"), SECTIONS, ids=lambda one: one.split("\n")[0])
def test_results_name_version_date_machine_and_command(page: str, section: str) -> None:
    before, _, _ = section.partition("\n| ")
    assert SOURCE.search(before), page


def test_results_are_left_out_of_the_search_and_listed() -> None:
    listed = (RESULTS / "index.md").read_text(encoding="utf-8")
    for page in RESULTS.glob("*.md"):
        assert page.read_text(encoding="utf-8").startswith("---\nsearch:\n  exclude: true\n---\n")
        assert page.name == "index.md" or f"({page.name})" in listed


TABLE = """\
## Some flights

| family | flights | arrived | nearest | level: arrived |
| --- | --- | --- | --- | --- |
| street | 30 | 3 of 30 (3-26 %) | 0.53 m | 0: 10; 4: 1, 3 crashed |
| walls | 30 | **27** | 1.1 m (0.9-1.3) | 0: 10; 4: 9 |
| `balls` | 1,200 | 1,195 of 1,200 | - | 0: 10; 4: 10 |
"""


@pytest.fixture
def rows(tmp_path: Path) -> list[Row]:
    (tmp_path / "some.md").write_text(TABLE)
    return list(rows_of(tmp_path / "some.md"))


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("3 of 30", "Some flights/street > arrived"),
        ("3", "Some flights/street > arrived"),
        ("Three", "Some flights/street > arrived"),
        ("27 of 30", "Some flights/street > not arrived"),
        ("27 of 30", "Some flights/walls > arrived"),
        ("30 of 60", "*/street + */walls > arrived"),
        ("37.7 to 62.3 %", "*/street + */walls > arrived"),
        ("50 %", "*/street + */walls > arrived"),
        ("1,195 of 1,200", "*/balls > arrived"),
        ("1195", "*/balls > arrived"),
        ("0.53 m", "*/street > nearest"),
        ("1.1 m (0.9 to 1.3)", "*/walls > nearest"),
        ("3 crashed", "*/street > level: arrived@4"),
        ("1225", "Some flights/* > arrived"),
    ],
)
def test_a_quote_that_agrees_passes(text: str, where: str, rows: list[Row]) -> None:
    check(text, where, rows)


@pytest.mark.parametrize(
    ("text", "where", "right"),
    [
        ("4 of 30", "*/street > arrived", "3 of 30"),
        ("two", "*/street > arrived", "three"),
        ("3 of 30", "*/walls > arrived", "27 of 30"),
        ("31 of 60", "*/street + */walls > arrived", "30 of 60"),
        ("38 to 63 %", "*/street + */walls > arrived", "38 to 62 %"),
        ("1,195 of 1,201", "*/balls > arrived", "1195 of 1200"),
        ("all", "*/balls > arrived", "1195"),
        ("30", "*/street > arrived", "3"),
        ("0.9", "*/walls > nearest", "1.1"),
        ("0.5 m", "*/street > nearest", "0.53 m"),
        ("1.2 m (0.9 to 1.4)", "*/walls > nearest", "1.1 m (0.9 to 1.3)"),
        ("4 crashed", "*/street > level: arrived@4", "3 crashed"),
        ("53 m", "*/street > nearest", "0.53 m"),
        ("0.53 m", "*/canyon > nearest", None),
        ("0.53 m", "*/street > farthest", None),
        ("3 crashed", "*/street > level: arrived@0", None),
        ("3 crashed", "*/walls > level: arrived@4", None),
        ("3 crashed", "*/street > level: arrived@9", None),
        ("0.53 m", "*/* > nearest", None),
    ],
)
def test_a_quote_that_does_not_agree_says_what_is_right(
    text: str, where: str, right: str | None, rows: list[Row]
) -> None:
    with pytest.raises(WrongFigureError) as wrong:
        check(text, where, rows)
    assert wrong.value.right == right


def test_a_page_is_put_right(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "some.md").write_text(TABLE)
    page = tmp_path / "README.md"
    page.write_text('It passes [4 of 30](docs/some.md "*/street > arrived") streets.\n')
    monkeypatch.setattr("tools.figures.REPOSITORY", tmp_path)
    monkeypatch.setattr("tools.figures.RESULTS", tmp_path / "docs")
    monkeypatch.setattr("sys.argv", ["figures", "--write"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    assert page.read_text() == 'It passes [3 of 30](docs/some.md "*/street > arrived") streets.\n'


@pytest.mark.parametrize(
    "text",
    [
        "None of 780 was lost, 6 of 2,600 were.",
        "It took 1.54 ms.",
        "By 5.1 times the way.",
        "It arrived in 97.8 to 99.5 % of them.",
        "A ratio of 0.14 (0.09 to 0.22).",
        "It flew 2,600 flights.",
        "It came to 0.53 of 0.6 m.",
    ],
)
def test_what_reads_like_a_measurement_is_found(text: str) -> None:
    assert MEASURED.search(prose(text))
    assert not MEASURED.search(prose(f"```\n{text}\n```\n"))


def test_nothing_else_is_taken_for_one() -> None:
    text = "A plane of 0.3 m at 5 m/s, 10 m of range, 7 columns, `3 of 30`, version 0.1.0."
    assert re.findall(MEASURED, prose(text)) == []
