"""Objects of JSON files in any arrangement: one, a list of them, or one a line."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from clearway.base.errors import InputError
from clearway.io.foreign import NoJsonError, parse_json
from clearway.io.traffic.traffic_rows import DAMAGED, Sieve

BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def json_objects(source: str, content: bytes, sieve: Sieve) -> Iterator[tuple[str, dict[str, Any]]]:
    """Place and value of each object; what is none goes to the sieve as damaged.

    Raises InputError where the file ends in the middle of its object or its list, and where an
    object has a key more than once; a last line that is cut off is left out, and told.
    """
    lines = content.removeprefix(BYTE_ORDER_MARK).splitlines()
    if not _parses(source, lines[0]):
        try:
            yield from _of(parse_json(source, b"\n".join(lines)), "", sieve)
            return
        except NoJsonError as cause:
            if len(lines) == 1 or lines[0].strip() in (b"{", b"[", b"[{"):
                kind = "list" if lines[0].lstrip().startswith(b"[") else "object"
                raise InputError(source, f"no whole JSON {kind}, truncated? ({cause})") from cause
    whole = content.endswith(b"\n")
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            found = parse_json(source, line, f"line {number}")
        except NoJsonError as cause:
            if number == len(lines) and not whole:
                sieve.cut_off(f"line {number}, the last one, ends in the middle: {cause}")
                continue
            sieve.drop(DAMAGED, f"line {number}: no JSON object ({cause})")
        else:
            yield from _of(found, f"line {number}", sieve)


def _of(found: Any, place: str, sieve: Sieve) -> Iterator[tuple[str, dict[str, Any]]]:
    """The objects of a value: itself, or those that it lists."""
    rows = found if isinstance(found, list) and any(isinstance(r, dict) for r in found) else [found]
    for number, row in enumerate(rows):
        here = f"{place} row {number}".strip() if rows is found else place
        if isinstance(row, dict):
            yield here, row
        else:
            sieve.drop(DAMAGED, f"{here or 'the file'}: no JSON object but {str(row)[:40]!r}")


def _parses(source: str, line: bytes) -> bool:
    try:
        parse_json(source, line, "line 1")
    except NoJsonError:
        return False
    return True
