"""What is handed over arrives whole or not at all."""

from __future__ import annotations

import random

import pytest

from clearway.hand.handover import (
    HEAD,
    BrokenHandOver,
    HandOver,
    Kind,
    Packet,
    Scheduled,
    decode,
    encode,
)

ESCAPE = HandOver(
    (Scheduled(10.0, (Packet(0, b"one"), Packet(1, b""))), Scheduled(10.1, (Packet(0, b"two"),))),
    peer=("127.0.0.1", 14550),
    vehicle_s=-3.5,
    begins=(Packet(0, b"begins"),),
)


def test_it_comes_back_as_it_was() -> None:
    assert decode(encode(Kind.ESCAPE, 7.25, ESCAPE)) == (Kind.ESCAPE, 7.25, ESCAPE)
    assert decode(encode(Kind.PULSE, 7.5)) == (Kind.PULSE, 7.5, None)
    assert decode(encode(Kind.END, 8.0))[0] is Kind.END


def test_any_damage_is_noticed() -> None:
    whole, rng = encode(Kind.ESCAPE, 7.25, ESCAPE), random.Random(3)
    for at in range(len(whole)):
        flipped = bytearray(whole)
        flipped[at] ^= 1 << rng.randrange(8)
        with pytest.raises(BrokenHandOver):
            decode(bytes(flipped))
    for length in range(len(whole)):
        with pytest.raises(BrokenHandOver):
            decode(whole[:length])


@pytest.mark.parametrize("handed", [
    ESCAPE._replace(moments=(Scheduled(float("nan"), ()),)),
    ESCAPE._replace(moments=ESCAPE.moments[::-1]),
    ESCAPE._replace(vehicle_s=float("inf")),
    ESCAPE._replace(begins=(Packet(0, "text"),)),  # type: ignore[arg-type]
    ESCAPE._replace(peer=("127.0.0.1", "port")),  # type: ignore[arg-type]
])  # fmt: skip
def test_what_makes_no_sense_is_refused_though_its_checksum_is_right(handed: HandOver) -> None:
    with pytest.raises(BrokenHandOver):
        decode(encode(Kind.ESCAPE, 7.25, handed))


def test_a_kind_that_nobody_knows_is_refused() -> None:
    import zlib

    head = HEAD.pack(b"CWH1", 9, 1.0, 0)
    with pytest.raises(BrokenHandOver):
        decode(HEAD.pack(b"CWH1", 9, 1.0, zlib.crc32(head)))
