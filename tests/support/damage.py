"""What can happen to a file that is kept: each makes other bytes of its bytes."""

from __future__ import annotations

from collections.abc import Callable

Damage = Callable[[bytes], bytes]
DAMAGES: dict[str, Damage] = {
    "truncated": lambda data: data[:-1],
    "header": lambda data: data[:10],
    "empty": lambda data: data[:0],
    "flipped": lambda data: data[:200] + bytes([data[200] ^ 1]) + data[201:],
    "foreign": lambda data: b"something else" + data,
}
