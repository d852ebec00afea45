"""Floods a UDP port from a process of its own: `python flooder.py PORT SECONDS RATE KIND REPLAYED`.

REPLAYED is a file of frames signed with the right key that were sent before, 1 length byte each.
"""

from __future__ import annotations

import os
import socket
import sys
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path

BATCH_S = 0.01


def pieces_of(kind: str, replayed: list[bytes]) -> Callable[[int], bytes]:
    """What is sent, by number."""
    from mavlink_for_tests import (
        OTHER_KEY,
        aircraft,
        attitude,
        distances,
        framed,
        heartbeat,
        position,
    )

    forged = [heartbeat(0), position(9e5, (900, 900, 0)), attitude(9e5), distances(9e5), aircraft()]
    unsigned = [framed(one) for one in forged]
    wrong = [framed(one, key=OTHER_KEY) for one in forged]
    kinds: dict[str, Callable[[int], bytes]] = {
        "random": lambda n: os.urandom(20 + n % 300),
        "magic": lambda _: b"\xfd\x00\x01" * 500,
        "unsigned": lambda n: unsigned[n % len(unsigned)],
        "wrong key": lambda n: wrong[n % len(wrong)],
        "replayed": lambda n: replayed[n % len(replayed)],
        "truncated": lambda n: wrong[n % len(wrong)][: -1 - n % 20],
        "our own": lambda _: framed(heartbeat(0), component=196),
    }
    if kind != "all":
        return kinds[kind]
    mixed = list(kinds.values())
    return lambda n: mixed[n % len(mixed)](n)


def main() -> None:
    port, seconds, rate, kind, recorded = sys.argv[1:]
    data, replayed = Path(recorded).read_bytes(), []
    while data:
        replayed.append(data[1 : 1 + data[0]])
        data = data[1 + data[0] :]
    piece = pieces_of(kind, replayed)
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(8)]
    print("ready", flush=True)
    numbers, began, sent = count(), time.monotonic(), 0
    while (now := time.monotonic()) < began + float(seconds):
        while sent < (now - began) * float(rate):
            number = next(numbers)
            sockets[number % 8].sendto(piece(number), ("127.0.0.1", int(port)))
            sent += 1
        time.sleep(BATCH_S)
    print(sent)


if __name__ == "__main__":
    main()
