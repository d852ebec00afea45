"""Damage: ways to change the bytes of a file, drawn from a seeded generator."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable
from random import Random
from typing import Any

NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[\w.]+")
EXTREMES: tuple[bytes, ...] = (
    b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e-320", b"1e20", b"-1", b"0", b"-0.0",
    b"2147483648", b"4294967296", b"9223372036854775808", b"1e999", b"9" * 50, b"9" * 5000,
    b"0x10", b"1_000", b"", b"\xd9\xa1", b"1.5.5", b"--1", b"true", b"null", b'""', b"[]", b"{}",
    b"180.0001", b"90.1", b"1e5", b"1e-9", b"65536", b"256",
)  # fmt: skip
STRANGE: tuple[bytes, ...] = (
    b"\x1b[31m", b"\0", b"\x07", b"\x7f", b"\r", b"\n\n", "\u202e".encode(), "\u2028".encode(),
    b"\xff", b"\xed\xa0\x80", "\U0001f6e9".encode(), b"\xc2\x9b31m", b'"', b"'", b",", b";", b"\t",
    b"[/red]", b"%s%n", b"../../x", b"x" * 3000, b"[" * 3000, b"{" * 3000, b"#", b"\x1a", b"$x$",
)  # fmt: skip
VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 10**400, 2**63, 1e308, -1e308, 5e-324, "", "x", "nan", "\x1b[31mred",
    "\u0000", "\ud800", "y" * 2000, [], {}, [[]], [None], {"": None}, [[[[1]]]], "1e999", -0.0,
)  # fmt: skip
INTEGERS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF,
            0x7FFFFFFFFFFFFFFF, 0x8000000000000000, 0xFFFFFFFFFFFFFFFF)  # fmt: skip
FLOATS = (float("nan"), float("inf"), -float("inf"), 1e308, -1e308, 1e-320, 1e20, 0.0, 3.5e38)
HEAD = 512
"""Where headers are: half of all changes of single bytes are made there."""
LONGEST = 4_000_000


def mutated(data: bytes, random: Random, others: tuple[bytes, ...]) -> bytes:
    """One to four changes of data; others: files to take pieces from."""
    text = data[:2000].isascii() and b"\0" not in data[:2000]
    ways = TEXT if text and random.random() < 0.8 else BINARY
    for _ in range(random.choice((1, 1, 1, 2, 2, 3, 4))):
        if random.random() < 0.15 and others:
            data = spliced(data, random, random.choice(others))
        else:
            data = random.choice(ways)(data, random)
    return data[:LONGEST]


def _place(data: bytes | bytearray, random: Random) -> int:
    near = random.random() < 0.5
    return random.randrange(max(1, min(len(data), HEAD) if near else len(data)))


def flipped(data: bytes, random: Random) -> bytes:
    changed = bytearray(data or b"\0")
    for _ in range(random.choice((1, 1, 4, 30))):
        changed[_place(changed, random)] ^= 1 << random.randrange(8)
    return bytes(changed)


def bytes_set(data: bytes, random: Random) -> bytes:
    changed = bytearray(data or b"\0")
    for _ in range(random.choice((1, 1, 4))):
        changed[_place(changed, random)] = random.choice((0, 1, 0x7F, 0x80, 0xFF, 0x0A, 0x20))
    return bytes(changed)


def number_set(data: bytes, random: Random) -> bytes:
    """An extreme in the place of a binary number, of either byte order."""
    at, order = _place(data, random), random.choice("<>")
    if random.random() < 0.3:
        kind, value = random.choice("fd"), random.choice(FLOATS)
        if kind == "f" and abs(value) > 3.4e38:
            value = float("inf")
        new = struct.pack(order + kind, value)
    else:
        kind = random.choice("BHIQ")
        most = 256 ** struct.calcsize(order + kind)
        new = struct.pack(order + kind, random.choice(INTEGERS) % most)
    return data[:at] + new + data[at + len(new) :]


def truncated(data: bytes, random: Random) -> bytes:
    return data[: _place(data, random)]


def cut_out(data: bytes, random: Random) -> bytes:
    at = _place(data, random)
    return data[:at] + data[at + random.choice((1, 3, 16, 200, len(data) // 3)) :]


def repeated(data: bytes, random: Random) -> bytes:
    at = _place(data, random)
    piece = data[at : at + random.choice((1, 8, 64, 400))]
    return data[:at] + piece * random.choice((2, 3, 100)) + data[at:]


def inserted(data: bytes, random: Random) -> bytes:
    at = _place(data, random)
    return data[:at] + random.choice((*STRANGE, random.randbytes(8))) + data[at:]


def spliced(data: bytes, random: Random, other: bytes) -> bytes:
    at, start = _place(data, random), _place(other, random)
    piece = other[start : start + random.choice((4, 40, 400, len(other)))]
    return data[:at] + piece + data[at + random.choice((0, len(piece))) :]


def token_set(data: bytes, random: Random) -> bytes:
    """An extreme in the place of a written number."""
    found = list(NUMBER.finditer(data))
    if not found:
        return inserted(data, random)
    one = random.choice(found)
    return data[: one.start()] + random.choice(EXTREMES) + data[one.end() :]


def word_set(data: bytes, random: Random) -> bytes:
    found = list(WORD.finditer(data))
    if not found:
        return inserted(data, random)
    one, other = random.choice(found), random.choice(found)
    new = random.choice((other[0], b"", random.choice(STRANGE), one[0] + one[0], b"x"))
    return data[: one.start()] + new + data[one.end() :]


def lines_changed(data: bytes, random: Random) -> bytes:
    lines = data.splitlines(keepends=True)
    if not lines:
        return inserted(data, random)
    at, to = random.randrange(len(lines)), random.randrange(len(lines))
    match random.randrange(4):
        case 0:
            del lines[at]
        case 1:
            lines.insert(to, lines[at])
        case 2:
            lines[at], lines[to] = lines[to], lines[at]
        case _:
            lines[at:at] = [lines[at]] * random.choice((10, 300))
    return b"".join(lines)


def json_changed(data: bytes, random: Random) -> bytes:
    """A value of a JSON document replaced, left out or nested; other text changes by its words."""
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):
        return word_set(data, random)
    places = list(_places(document))
    if not places:
        return token_set(data, random)
    holder, key = random.choice(places)
    match random.randrange(5):
        case 0:
            del holder[key]
        case 1:
            holder[key] = [holder[key]]
        case 2:
            holder[key] = random.choice(random.choice(places))
        case _:
            holder[key] = random.choice(VALUES)
    try:
        return json.dumps(document).encode()
    except (ValueError, RecursionError):  # it holds itself now
        return data


def _places(value: Any) -> Any:
    keys: Any = value.keys() if isinstance(value, dict) else range(len(value)) if isinstance(
        value, list) else ()  # fmt: skip
    for key in list(keys)[:400]:
        yield value, key
        yield from _places(value[key])


Way = Callable[[bytes, Random], bytes]
BINARY: tuple[Way, ...] = (
    flipped, flipped, bytes_set, number_set, number_set, number_set, truncated, cut_out, repeated,
    inserted,
)  # fmt: skip
TEXT: tuple[Way, ...] = (
    token_set, token_set, token_set, word_set, lines_changed, json_changed, json_changed, inserted,
    flipped, truncated, cut_out, repeated,
)  # fmt: skip
