"""Mode S as hexadecimal rows and Beast frames: published messages, and what damage does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from absent_packages import without
from clearway.base.errors import InputError, MissingExtraError
from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS, KNOT_MPS
from clearway.io.traffic.ticks import TickClock
from clearway.io.traffic.traffic import read_traffic
from mode_s_for_tests import EVEN, IDENTIFICATION, ODD, VELOCITY, beast, mode_s


def with_parity(message: str) -> str:
    """The message with its last 24 bits as they must be: long division, bit by bit."""
    bits = [int(bit) for bit in f"{int(message[:-6], 16):0{4 * len(message) - 24}b}"] + 24 * [0]
    divisor = [int(bit) for bit in f"{0x1FFF409:b}"]
    for at in range(len(bits) - 24):
        if bits[at]:
            for step, bit in enumerate(divisor):
                bits[at + step] ^= bit
    return message[:-6] + f"{int(''.join(map(str, bits[-24:])), 2):06X}"


def test_published_messages(tmp_path: Path) -> None:
    """Position (5.2), velocity (5.3) and callsign of the book, with latest velocity attached."""
    velocity = with_parity("8D40621D" + VELOCITY[8:])
    name = with_parity("8D40621D" + IDENTIFICATION[8:])
    recording = mode_s(
        tmp_path / "a.csv", (10.0, name), (11.0, velocity), (12.0, ODD), (13.0, EVEN)
    )
    (report,) = recording.reports
    assert (report.time_s, report.address, report.callsign) == (13.0, "40621d", "KLM1023")
    assert (report.latitude_deg, report.longitude_deg) == pytest.approx(
        (52.2572021484375, 3.91937255859375)
    )
    assert (report.altitude_m, report.altitude_kind) == (38_000 * FOOT_M, "barometric")
    assert report.geometric_altitude_m == pytest.approx((38_000 + 550) * FOOT_M)
    assert report.ground_speed_mps == pytest.approx(159.20 * KNOT_MPS, rel=1e-4)
    assert report.track_rad == pytest.approx(np.radians(182.88), rel=1e-4)
    assert report.vertical_rate_mps == pytest.approx(-832 * FOOT_PER_MINUTE_MPS)
    assert recording.of_use == {"identification": 1, "velocity": 1}
    assert recording.left_out == {"position without its other half (CPR)": 1}
    assert recording.clock == "relative"


def test_old_velocities_are_not_attached(tmp_path: Path) -> None:
    velocity = with_parity("8D40621D" + VELOCITY[8:])
    recording = mode_s(tmp_path / "a.csv", (1.0, velocity), (12.0, ODD), (13.0, EVEN))
    assert recording.reports[0].ground_speed_mps is None
    assert recording.reports[0].geometric_altitude_m is not None


@pytest.mark.parametrize(
    ("control", "flag", "address", "source"),
    [
        (0, 0, "40621d", "adsb"),
        (1, 0, "~40621d", "adsb"),
        (2, 0, "40621d", "tisb"),
        (2, 1, "~40621d", "tisb"),
        (3, 0, "40621d", "tisb"),
        (5, 0, "~40621d", "tisb"),
        (6, 0, "40621d", "adsr"),
        (6, 1, "~40621d", "adsr"),
    ],
)
def test_who_sends_relayed_messages(
    tmp_path: Path, control: int, flag: int, address: str, source: str
) -> None:
    """Control field and address flag of DF 18 (DO-260B 2.2.3.2.1.5, TIS-B flag IMF)."""

    def relayed(message: str) -> str:
        first = 18 << 3 | control
        kind = int(message[8:10], 16) & 0xFE | flag
        return with_parity(f"{first:02X}{message[2:8]}{kind:02X}{message[10:]}")

    rows = ((1.0, relayed(ODD)), (2.0, relayed(EVEN)))
    (report,) = mode_s(tmp_path / "a.csv", *rows).reports
    assert (report.address, report.source) == (address, source)


@given(bit=st.integers(min_value=5, max_value=111))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
def test_one_wrong_bit_is_noticed(tmp_path: Path, bit: int) -> None:
    """The checksum tells every single wrong bit after the downlink format."""
    wrong = f"{int(EVEN, 16) ^ (1 << (111 - bit)):028X}"
    recording = mode_s(tmp_path / "a.csv", (1.0, ODD), (2.0, wrong), (3.0, EVEN))
    assert recording.left_out["checksum wrong"] == 1
    assert len(recording.reports) == 1


def test_beast_is_the_same_as_hex(tmp_path: Path) -> None:
    """Ticks of 0x1a1a.., signal 0x1a, short frames: escapes everywhere."""
    rows = [(0x1A1A1A1A1A00, IDENTIFICATION), (0x1A1A1B1A1A1A, ODD), (0x1A1A1C000000, EVEN)]
    short = with_parity("5D40621D000000")
    text = mode_s(
        tmp_path / "a.csv",
        *(((ticks - rows[0][0]) / 12e6, message) for ticks, message in rows),
        (2.0, short),
    )
    (tmp_path / "a.bin").write_bytes(beast(*rows, (rows[0][0] + 24_000_000, short)))
    binary = read_traffic(tmp_path / "a.bin")
    assert binary.reports == text.reports
    assert (binary.of_use, binary.left_out) == (text.of_use, text.left_out)
    assert binary.heard == {"4840d6": 1, "40621d": 3}


def test_beast_cut_anywhere_is_refused_or_has_whole_frames(tmp_path: Path) -> None:
    pytest.importorskip("rs1090")
    content = beast((0x1A1A1A1A1A1A, ODD), (0x1A1A1A1A1A1B, with_parity(EVEN[:20] + "1AAAAAAA")))
    whole = [len(beast((0x1A1A1A1A1A1A, ODD))), len(content)]
    for end in range(2, len(content) + 1):
        (tmp_path / "a.bin").write_bytes(content[:end])
        if end in whole:
            assert read_traffic(tmp_path / "a.bin").messages == 1 + whole.index(end)
        else:
            try:
                notes = read_traffic(tmp_path / "a.bin").notes
            except InputError as error:
                notes = (str(error),)
            assert "truncated" in " ".join(notes)


def test_beast_odds_and_ends(tmp_path: Path) -> None:
    """Mode A/C, the receiver's state, a computed position without time, a frame cut short."""
    pytest.importorskip("rs1090")
    whole = beast((2**48 - 12_000_000, ODD), (0, EVEN))  # the counter starts again
    content = (
        b"\x07\x08"
        + b"\x1a\x31" + bytes(6) + b"\x00\x12\x34"
        + b"\x1a\x34" + bytes(6) + b"\x00" + bytes(14)
        + b"\x1a\x33" + b"\xff\x00MLAT" + b"\x00" + bytes.fromhex(EVEN)
        + b"\x1a\x33" + bytes(9)
        + whole
    )  # fmt: skip
    (tmp_path / "a.bin").write_bytes(content)
    recording = read_traffic(tmp_path / "a.bin")
    assert recording.messages == 6
    assert recording.of_use == {"Mode A/C reply": 1, "state of the receiver": 1}
    assert recording.left_out == {
        "no time": 1,
        "damaged": 1,
        "position without its other half (CPR)": 1,
    }
    assert [report.time_s for report in recording.reports] == [1.0]
    assert any("2 bytes before the first frame" in note for note in recording.notes)


def test_beast_with_gps_times_names_and_places_of_the_receiver(tmp_path: Path) -> None:
    """As Radarcape and readsb write it: seconds of the day above 30 bits of nanoseconds."""
    pytest.importorskip("rs1090")
    state = b"\x1a\x34" + bytes(7) + b"\x10" + bytes(13)
    place, name = b"\x1a\x35" + bytes(21), b"\x1a\xe3" + b"ABCDEFGH"
    late, early = (86_399 << 30) + 750_000_000, 250_000_000  # over midnight
    content = state + place + name + beast((late, ODD), (early, EVEN)) + name
    (tmp_path / "a.bin").write_bytes(content)
    recording = read_traffic(tmp_path / "a.bin")
    assert [report.time_s for report in recording.reports] == [pytest.approx(0.5)]
    assert recording.of_use == {
        "state of the receiver": 1,
        "position of the receiver": 1,
        "name of the receiver": 2,
    }


def test_clocks_of_receivers() -> None:
    """Late frames, a counter that runs over, one that is started anew, one that stands."""
    clock = TickClock()
    counts = [2**48 - 24_000_000, 12_000_000, 2**48 - 6_000_000, 36_000_000, 24_000_000]
    assert [clock.seconds(count) for count in counts] == pytest.approx([0.0, 3.0, 1.5, 5.0, 4.0])
    assert clock.notes() == ()
    clock = TickClock()
    counts = [12_000_000_000, 12_012_000_000, 120_000, 12_120_000]
    assert [clock.seconds(count) for count in counts] == pytest.approx([0.0, 1.0, 3601.0, 3602.0])
    assert "started anew 1 times: 60 minutes are assumed" in clock.notes()[0]
    clock = TickClock()
    assert [clock.seconds(7) for _ in range(3)] == [0.0] * 3
    assert clock.stands


def test_beast_without_times_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(beast((0, ODD), (0, EVEN)))
    with pytest.raises(InputError, match="all 2 frames have the same time"):
        read_traffic(tmp_path / "a.bin")


def test_without_the_decoder_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without(monkeypatch, "rs1090")
    (tmp_path / "a.csv").write_text(f"1.0,{EVEN}\n")
    with pytest.raises(MissingExtraError, match=r"clearway\[adsb\]"):
        read_traffic(tmp_path / "a.csv")


@pytest.mark.parametrize("at_once", [400, 163, 97])
def test_messages_are_decoded_in_parts_without_loss(
    data_dir: Path, monkeypatch: pytest.MonkeyPatch, at_once: int
) -> None:
    """An aircraft's messages stay together; one with more of them than that loses pairs at most."""
    file = data_dir / "adsb/raw_atlanta_60s_20250729.csv"
    whole = read_traffic(file)
    monkeypatch.setattr("clearway.io.traffic.mode_s.AT_ONCE", at_once)
    parts = read_traffic(file)
    assert parts.of_use == whole.of_use
    assert parts.heard == whole.heard
    if at_once > max(whole.heard.values()):
        assert parts.reports == whole.reports
        assert parts.left_out == whole.left_out
    else:
        assert set(parts.reports) < set(whole.reports)
        assert sum(parts.left_out.values()) > sum(whole.left_out.values())
