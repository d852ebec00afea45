"""Figures that pages quote, checked against docs/results: `python -m tools.figures [--write]`.

Every measured figure stands in one table of a page under docs/results, below a line that names
version, date and command. Another page quotes it by a link to that page, whose title says where it
stands: rows, by the heading and the first cells, then the column:

    [0 of 780](results/dead-ends.md "*/clearway > crashed")

Rows are patterns (`*` for anything, ` + ` between several); counts of several rows are summed. The
text is a count, a count `of` flights, a share or a Wilson interval of these, or words of the one
cell. `not crashed` counts the others, `@4` takes the part of a cell that begins with `4:`.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from clearway.base.intervals import wilson

REPOSITORY = Path(__file__).resolve().parent.parent
RESULTS = REPOSITORY / "docs" / "results"
QUOTE = re.compile(r'\[(?P<text>[^\]]+)\]\((?P<page>[^)\s]+\.md) "(?P<where>[^"]+ > [^"]+)"\)')
SOURCE = re.compile(
    r"^Measured with clearway \S+ on \d{4}-\d\d-\d\d \([^)]+\):\s+(?:`[^`]+`[,;.]?\s*(?:and\s+)?)+",
    re.MULTILINE,
)
"""The line above the tables of a section that says where they come from."""
TRIALS = ("flights", "n", "can be avoided", "flown", "encounters")
"""Columns that say of how many a count is, where its cell does not."""
WORDS = tuple("none one two three four five six seven eight nine ten eleven twelve".split())  # noqa: SIM905
NUMBER = r"\d[\d,]*(?:\.\d+)?"
MEASURED = re.compile(
    "|".join(
        (
            rf"\b{NUMBER} of (?:the |these |those |all )?{NUMBER}\b",
            rf"{NUMBER}(?: (?:to|and) {NUMBER})? ?%",
            rf"{NUMBER}(?: (?:to|and) {NUMBER})? (?:ms|us)\b",
            rf"\b{NUMBER} times\b",
            rf"\({NUMBER} to {NUMBER}\)",
            r"\b\d[\d,]+ (?:\w+ )?(?:flights|encounters|worlds|decisions)\b",
            rf"{NUMBER}(?: \w+)? (?:in the (?:mean|median|middle)|on average)\b",
            rf"(?:median|mean) (?:of )?{NUMBER}",
            rf"± ?{NUMBER}",
        )
    )
)
"""What reads like the outcome of a measurement: shares, counts, intervals, times of computing."""


class WrongFigureError(Exception):
    """A quote that does not agree with the results; says what it should be."""

    def __init__(self, said: str, right: str | None = None) -> None:
        super().__init__(said)
        self.right = right


@dataclass(frozen=True)
class Row:
    """A line of a table of results."""

    heading: str
    cells: dict[str, str]
    """By the head of their column, in order."""

    def matches(self, pattern: str) -> bool:
        """Whether a pattern fits the heading and the first one, two or three cells."""
        first = [_plain(cell) for cell in self.cells.values()]
        keys = ["/".join((self.heading, *first[:count])) for count in (1, 2, 3)]
        return any(fnmatchcase(key, pattern) for key in keys)

    def count(self, column: str, cell: str) -> tuple[int, int | None]:
        """A number of flights, and of how many, where that is known; of a column, or a part of it.

        Raises ValueError where the cell holds none.
        """
        found = re.match(r"(\d+)(?: of (\d+))?(?![\d.])", _plain(cell))
        if found is None:
            raise ValueError(f"{cell!r} is no count")
        trials = found[2] or next(
            (self.cells[one] for one in TRIALS if one in self.cells and one != column), None
        )
        return int(found[1]), None if trials is None else int(_plain(trials).split()[0])


def rows_of(page: Path) -> Iterator[Row]:
    """All lines of all tables of a page, in order."""
    heading, head = "", list[str]()
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            heading = line.lstrip("#").strip()
        if not line.startswith("|"):
            head = []
            continue
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not head:
            head = [_plain(cell) for cell in cells]
        elif not set(line) <= set("|-: "):
            yield Row(heading, dict(zip(head, cells, strict=False)))


def check(text: str, where: str, rows: list[Row]) -> None:
    """Raise WrongFigureError unless the text is what the results say there."""
    wanted, _, column = where.rpartition(" > ")
    column, _, part = column.partition("@")
    inverse = column.startswith("not ")
    column = column.removeprefix("not ")
    found = [
        row
        for row in rows
        if column in row.cells and any(row.matches(one) for one in wanted.split(" + "))
    ]
    if not found:
        raise WrongFigureError(f"no row {wanted!r} with a column {column!r}")
    said = _plain(text)
    cells = [_part(row.cells[column], part) for row in found]
    alone = cells[0] if len(cells) == 1 and not inverse else ""
    if _words(alone, said) == said:
        return
    right = None if "%" in said else _words(alone, said, any_number=True)
    try:
        counts = [row.count(column, cell) for row, cell in zip(found, cells, strict=True)]
    except ValueError as error:
        raise WrongFigureError(f"{said!r} does not stand in {cells[:4]}", right) from error
    number = sum(count for count, _ in counts)
    trials = None if any(of is None for _, of in counts) else sum(of or 0 for _, of in counts)
    if inverse and trials is not None:
        number = trials - number
    right = right or _in_form(said, number, trials)
    if right != said:
        raise WrongFigureError(f"{said!r} should be {right!r}: {cells[:4]}", right)


def _words(cell: str, said: str, *, any_number: bool = False) -> str | None:
    """What stands in a cell as the text does, or so but for its numbers.

    A number alone is looked for where the cell begins, words anywhere.
    """
    parts = re.split(f"({NUMBER})", said)
    if any_number and len(parts) == 1:
        return None
    pattern = "".join(
        NUMBER if any_number and number % 2 else re.escape(part)
        for number, part in enumerate(parts)
    )
    begin = "^" if re.fullmatch(NUMBER, said) else r"(?<![\w.])"
    found = re.search(rf"{begin}{pattern}(?!\w|\.\d)", _plain(cell))
    return found[0] if found else None


def _in_form(said: str, number: int, trials: int | None) -> str | None:
    """The figure in the form of the text: word, count, share, interval; None in no other."""
    if said.lower() in (*WORDS, "no", "all"):
        if said.lower() == ("all" if number == trials else "no" if number == 0 else ""):
            return said
        word = WORDS[number] if number < len(WORDS) else str(number)
        return word.capitalize() if said[0].isupper() else word
    if re.fullmatch(NUMBER, said):
        return str(number)
    if not trials:
        return None
    if re.fullmatch(rf"{NUMBER} of {NUMBER}", said):
        return f"{number} of {trials}"
    if re.fullmatch(rf"{NUMBER} %", said):
        return f"{100.0 * number / trials:.{_digits(said)}f} %"
    interval = re.fullmatch(rf"({NUMBER})(?: %)? to ({NUMBER}) %", said)
    if interval is None:
        return None
    low, high = (
        _rounded(100.0 * share, one)
        for share, one in zip(wilson(number, trials), interval.groups(), strict=True)
    )
    return f"{low} to {high} %"


def _rounded(value: float, like: str) -> str:
    text = f"{value:.{_digits(like)}f}"
    return like if float(text) == float(like) else text


def _digits(text: str) -> int:
    found = re.search(r"\.(\d+)", text)
    return len(found[1]) if found else 0


def _plain(text: str) -> str:
    """Without emphasis, code and separators of thousands; ranges with "to"."""
    text = re.sub(r"(?<=\d),(?=\d{3})", "", re.sub(r"[*`]", "", text))
    return re.sub(r"(?<=\d)[-–](?=\d)", " to ", " ".join(text.split()))


def _part(cell: str, part: str) -> str:
    """Of `0: 10; 4: 1, 3 crashed` what stands at a level."""
    if not part:
        return cell
    levels = dict(one.split(": ", 1) for one in cell.split("; "))
    return levels.get(part, "")


def prose(text: str) -> str:
    """What people wrote of a page: without code, comments, quotes, and what commands put there."""
    text = re.sub(r"<!-- ([\w-]+):begin -->.*?<!-- \1:end -->", " ", text, flags=re.DOTALL)
    text = re.sub(r"^ *```.*?^ *```$", " ", text, flags=re.MULTILINE | re.DOTALL)
    text = QUOTE.sub(" ", re.sub(r"<!--.*?-->", " ", text, flags=re.DOTALL))
    return re.sub(r"\s+", " ", re.sub(r"`[^`]*`", "``", text))


def pages() -> list[Path]:
    """README and all pages of the documentation, those of results too."""
    return [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]


def wrong_quotes(page: Path, text: str) -> Iterator[tuple[re.Match[str], WrongFigureError]]:
    """Quotes of a page that are not as the results say."""
    for quote in QUOTE.finditer(text):
        target = (page.parent / quote["page"]).resolve()
        try:
            if RESULTS not in target.parents or not target.is_file():
                raise WrongFigureError(f"{quote['page']} is no page of results")
            check(quote["text"], quote["where"], list(rows_of(target)))
        except WrongFigureError as wrong:
            yield quote, wrong


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="put right what can be")
    args = parser.parse_args()
    left = 0
    for page in pages():
        text = made = page.read_text(encoding="utf-8")
        for quote, wrong in wrong_quotes(page, text):
            mended = args.write and wrong.right is not None
            if mended:
                new = quote[0].replace(f"[{quote['text']}]", f"[{wrong.right}]", 1)
                made = made.replace(quote[0], new)
            left += not mended
            print(f"{page.relative_to(REPOSITORY)}: {quote['where']}: {wrong}")
        if made != text:
            page.write_text(made, encoding="utf-8")
    raise SystemExit(1 if left else 0)


if __name__ == "__main__":
    main()
