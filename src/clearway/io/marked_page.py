"""Parts of a Markdown page that a command makes: what stands between two marks."""

from __future__ import annotations

from pathlib import Path

from clearway.base.errors import InputError, naming
from clearway.io.staging import stage_file


def put_between_marks(page: Path, name: str, made: str) -> None:
    """Put text between `<!-- name:begin -->` and `<!-- name:end -->` of a page.

    Raises InputError where the page cannot be read or written, or has no such marks.
    """
    begin, end = f"<!-- {name}:begin -->", f"<!-- {name}:end -->"
    with naming(page, "written"):
        text = page.read_text(encoding="utf-8")
        before, found, rest = text.partition(begin)
        _, closed, after = rest.partition(end)
        if not (found and closed):
            raise InputError(str(page), f"no {begin} ... {end}")
    with stage_file(page) as scratch:
        scratch.write_text(f"{before}{begin}\n{made.strip()}\n{end}{after}", encoding="utf-8")
