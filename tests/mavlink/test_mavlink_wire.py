"""Frames of a link: damaged, foreign, forged, replayed, too many; the good ones are found."""

from __future__ import annotations

import hashlib
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from clearway.base.errors import InputError
from clearway.mavlink.inbox import KEPT, Inbox
from clearway.mavlink.outbox import Packer
from clearway.mavlink.signing import SignatureCheck, read_key, signing_time
from clearway.mavlink.wire import frames_in
from mavlink_for_tests import (
    KEY,
    OTHER_KEY,
    PEER,
    aircraft,
    attitude,
    framed,
    heartbeat,
    position,
    raw_frame,
)

EXTRAS = {number: int(mavlink.mavlink_map[number].crc_extra) for number in KEPT}


def inbox(key: bytes | None = None, *, stream: bool = False) -> Inbox:
    return Inbox(1, 1, None if key is None else SignatureCheck(key), stream=stream)


def types(box: Inbox, *pieces: bytes) -> list[str]:
    return [a.message.get_type() for a in box.take([(piece, PEER) for piece in pieces])]


def test_messages_come_in_order_and_are_counted() -> None:
    box = inbox()
    assert types(box, framed(heartbeat(), attitude(1.0)), framed(position(1.0))) == [
        "HEARTBEAT",
        "ATTITUDE",
        "LOCAL_POSITION_NED",
    ]
    assert dict(box.received) == {"HEARTBEAT": 1, "ATTITUDE": 1, "LOCAL_POSITION_NED": 1}
    assert not box.refused


@pytest.mark.parametrize("stream", [False, True])
def test_a_damaged_frame_costs_no_other(stream: bool) -> None:
    bad = bytearray(framed(position(1.0)))
    bad[15] ^= 0x40
    box = inbox(stream=stream)
    assert types(box, bytes(bad) + framed(attitude(1.0))) == ["ATTITUDE"]
    assert dict(box.refused) == {"bad checksum": 1}


def test_every_flipped_bit_is_noticed() -> None:
    good, box = framed(position(1.0, (1.5, 2.5, -3.5))), inbox()
    for bit in range(8 * 10, 8 * len(good)):
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        assert types(box, bytes(bad)) == []


def test_a_truncated_datagram_is_counted_and_ends_there() -> None:
    box = inbox()
    assert types(box, framed(position(1.0))[:-3], framed(attitude(1.0))) == ["ATTITUDE"]
    assert dict(box.refused) == {"truncated": 1}


def test_a_stream_may_be_cut_anywhere() -> None:
    data = framed(heartbeat(), attitude(1.0), position(1.0))
    for cut in range(len(data)):
        box = inbox(stream=True)
        found = types(box, data[:cut]) + types(box, data[cut:])
        assert found == ["HEARTBEAT", "ATTITUDE", "LOCAL_POSITION_NED"]
        assert not box.refused


def test_mavlink_1_is_refused() -> None:
    codec = mavlink.MAVLink(None, 1, 1)
    old = bytes(position(1.0).pack(codec, force_mavlink1=True))
    box = inbox()
    assert types(box, old, old + framed(attitude(1.0))) == ["ATTITUDE"]
    assert dict(box.refused) == {"MAVLink 1": 2}


def test_frames_that_ask_for_the_unknown_are_refused() -> None:
    frame = bytearray(framed(position(1.0)))
    frame[2] |= 0x02
    box = inbox()
    assert types(box, bytes(frame)) == []
    assert dict(box.refused) == {"unknown flags": 1}


@given(data=st.binary(max_size=300), stream=st.booleans())
def test_garbage_does_no_harm_and_is_all_accounted_for(data: bytes, stream: bool) -> None:
    refused: Counter[str] = Counter()
    frames, rest = frames_in(data, EXTRAS, refused, stream=stream)
    assert not frames
    assert bool(refused) or rest == data
    assert data.endswith(rest)


@given(garbage=st.binary(max_size=80), stream=st.booleans())
def test_a_frame_behind_garbage_is_found_on_a_line(garbage: bytes, stream: bool) -> None:
    good = framed(position(1.0))
    # On a line, what looks like the head of a longer frame needs all its bytes before it is known
    # to be none; in datagrams the next one is not touched.
    box = inbox(stream=stream)
    pieces = [garbage + good + bytes(300)] if stream else [garbage, good]
    assert "LOCAL_POSITION_NED" in types(box, *pieces)


@given(data=st.binary(min_size=9, max_size=60), number=st.sampled_from(sorted(KEPT)))
def test_any_payload_of_the_right_checksum_is_decoded_or_counted(data: bytes, number: int) -> None:
    box = inbox()
    assert len(types(box, raw_frame(number, data))) + sum(box.refused.values()) == 1


@pytest.mark.parametrize(
    ("reason", "system", "component"),
    [
        ("another system", 2, 1),
        ("another component", 1, 100),
        ("our own frame", 1, 196),
    ],
)
def test_strangers_are_refused(reason: str, system: int, component: int) -> None:
    box = inbox()
    assert types(box, framed(heartbeat(), system=system, component=component)) == []
    assert dict(box.refused) == {reason: 1}


def test_sensors_may_be_components_of_their_own() -> None:
    assert types(inbox(), framed(aircraft(), component=156)) == ["ADSB_VEHICLE"]


def test_messages_that_nobody_needs_are_passed_over() -> None:
    box = inbox()
    power = mavlink.MAVLink_power_status_message(0, 0, 0)
    assert types(box, framed(power, heartbeat())) == ["HEARTBEAT"]
    assert dict(box.refused) == {"message not needed": 1}


# --- signing ------------------------------------------------------------------------------------


def test_only_what_is_signed_with_the_key_is_taken() -> None:
    box = inbox(KEY)
    pieces = [framed(heartbeat(), key=key) for key in (KEY, OTHER_KEY, None)]
    assert types(box, *pieces) == ["HEARTBEAT"]
    assert dict(box.refused) == {"wrong signature": 1, "unsigned": 1}


def test_signed_frames_are_read_without_a_key_too() -> None:
    assert types(inbox(), framed(heartbeat(), key=KEY)) == ["HEARTBEAT"]


def test_a_replayed_frame_is_refused() -> None:
    box = inbox(KEY)
    frame = framed(heartbeat(), key=KEY)
    assert types(box, frame, frame) == ["HEARTBEAT"]
    assert types(box, frame) == []
    assert dict(box.refused) == {"old timestamp": 2}


def signed_at(ticks: int, key: bytes = KEY, link: int = 0) -> bytes:
    """A heartbeat signed by hand, as the MAVLink guide has it."""
    head = framed(heartbeat(), key=KEY)[:-13]
    block = bytes([link]) + ticks.to_bytes(6, "little")
    return head + block + hashlib.sha256(key + head + block).digest()[:6]


def test_a_new_stream_must_not_be_older_than_a_minute() -> None:
    now = signing_time()
    box = Inbox(1, 1, SignatureCheck(KEY, now), stream=False)
    assert types(box, signed_at(now - 6_100_000)) == []
    assert types(box, signed_at(now - 5_900_000)) == ["HEARTBEAT"]
    assert dict(box.refused) == {"old timestamp": 1}


def test_a_forged_time_does_not_shut_out_the_true_sender() -> None:
    now = signing_time()
    box = Inbox(1, 1, SignatureCheck(KEY, now), stream=False)
    assert types(box, signed_at(now), signed_at(now + 10**9, OTHER_KEY)) == ["HEARTBEAT"]
    assert types(box, signed_at(now + 1)) == ["HEARTBEAT"]
    assert dict(box.refused) == {"wrong signature": 1}


def test_what_we_sign_is_accepted_by_pymavlink_and_counts_up() -> None:
    receiver = mavlink.MAVLink(None)
    receiver.signing.secret_key = KEY
    packer = Packer(1, key=KEY)
    for _ in range(3):
        message = receiver.decode(bytearray(packer.pack(heartbeat())))
        assert message.get_srcComponent() == 196
    assert receiver.signing.goodsig_count == 3


def test_our_signatures_are_never_older_than_those_heard() -> None:
    ahead = signing_time() + 10**10
    check = SignatureCheck(KEY)
    box = Inbox(1, 1, check, stream=False)
    assert types(box, signed_at(ahead)) == ["HEARTBEAT"]
    frame = Packer(1, key=KEY, check=check).pack(heartbeat())
    assert int.from_bytes(frame[-12:-6], "little") >= ahead


def test_keys_are_32_bytes_or_their_digits(tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.write_bytes(KEY)
    assert read_key(file) == KEY
    file.write_text(KEY.hex() + "\n")
    assert read_key(file) == KEY
    for bad in (b"", b"secret", KEY[:-1], KEY.hex()[:-2].encode(), b"zz" * 32):
        file.write_bytes(bad)
        with pytest.raises(InputError, match="32 bytes or 64 hexadecimal digits"):
            read_key(file)
    with pytest.raises(InputError, match="cannot be read"):
        read_key(tmp_path / "none")


# --- floods -------------------------------------------------------------------------------------


def test_a_flood_of_one_kind_shuts_out_no_other() -> None:
    box = inbox()
    flood = [framed(aircraft(number)) for number in range(5_000)]
    found = Counter(types(box, framed(heartbeat()), *flood, framed(position(1.0))))
    assert found == {"HEARTBEAT": 1, "ADSB_VEHICLE": 128, "LOCAL_POSITION_NED": 1}
    assert dict(box.refused) == {"flood: more than can be used": 5_000 - 128}


def test_of_too_many_the_newest_are_kept() -> None:
    box = inbox()
    pieces = [(framed(position(float(second))), PEER) for second in range(100)]
    told = [arrival.message.time_boot_ms for arrival in box.take(pieces)]
    assert told == [1000 * second for second in range(68, 100)]


def test_more_bytes_than_can_be_cut_are_dropped_oldest_first() -> None:
    box = inbox()
    pieces = [bytes(4096)] * 100 + [framed(heartbeat())]
    assert types(box, *pieces) == ["HEARTBEAT"]
    assert box.refused["flood: more than can be used"] == 37
    assert box.refused["bytes of no frame"] == 4096 * 63
