"""DataFlash logs of ArduPilot (.bin): own GPS positions, and what the transponder heard.

Through pymavlink's reader, in a process of its own: it prints what it finds odd.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from clearway.base.errors import MissingExtraError
from clearway.io.apart import apart
from clearway.io.moments import utc_of_gps
from clearway.io.traffic.traffic_rows import (
    DAMAGED,
    NO_ADDRESS,
    NO_POSITION,
    NO_TIME,
    Sieve,
)
from clearway.traffic.recorded.report import TrafficRecording, TrafficReport

LOADED_APART = ("pymavlink.DFReader",)
"""Before a reader is forked, see `io.readers`."""
FORM = "DataFlash log of ArduPilot (.bin)"
MAGIC = b"\xa3\x95\x80\x80"
OWN = "own"
FIX_3D = 3
WEEK_S = 604_800.0
MICROSECOND_S = 1e-6
FRESH_S = 2.0
"""For how long a pressure and an undulation go with positions."""
SEA_LEVEL_PA = 101_325.0
LAPSE_M = 44_330.77
EXPONENT = 0.190263
"""Of the standard atmosphere."""
FIELDS = {
    "GPS": ("TimeUS", "I", "Status", "GMS", "GWk", "Lat", "Lng", "Alt", "Spd", "GCrs", "VZ"),
    "GPA": ("TimeUS", "I", "Und"),
    "BARO": ("TimeUS", "I", "Press"),
    "ADSB": ("TimeUS", "ICAO_address", "Lat", "Lng", "Alt", "Heading", "Hor_vel", "Ver_vel"),
}
"""Messages that are read; what an older log lacks is None."""


class LoggedRow(NamedTuple):
    """One message."""

    kind: str
    values: dict[str, float | None]


def read_dataflash(source: str, content: bytes) -> TrafficRecording:
    """Own positions (address `own`) of the first GPS, and ADSB messages.

    Own altitude is that of the barometer above 1013.25 hPa; the GPS's is above the ellipsoid where
    the log tells the undulation. Raises MissingExtraError without [mavlink].
    """
    if find_spec("pymavlink") is None:
        raise MissingExtraError(f"reading {source}", "mavlink")
    rows, others, lost_bytes = apart(Path(source), "DataFlash log", read_logged_rows, content)
    sieve = Sieve(source)
    sieve.use("other message", others)
    if lost_bytes < 0:
        sieve.cut_off(f"the last message lacks {-lost_bytes} bytes")
    elif lost_bytes:
        mean_bytes = (len(content) - lost_bytes) / max(len(rows) + others, 1)
        lost = max(1, round(lost_bytes / max(mean_bytes, 1.0)))
        sieve.drop(DAMAGED, count=lost)
        sieve.notes.append(f"{lost_bytes} bytes hold no message: about {lost} are lost")
    begin_s = next((one for one in map(_boot_s, rows) if one is not None), None)
    if begin_s is None:
        sieve.notes.append("GPS told no time: times are since boot")
    own = _Own()
    for row in rows:
        micro = row.values["TimeUS"]
        if micro is None or not math.isfinite(micro):
            sieve.drop(NO_TIME)
        elif row.kind == "ADSB":
            _take_other(row.values, micro * MICROSECOND_S + (begin_s or 0.0), sieve)
        elif row.values["I"] not in (None, 0.0):
            sieve.use("further GPS or barometer")
        else:
            own.take(row, micro * MICROSECOND_S, begin_s or 0.0, sieve)
    return sieve.recording(FORM, "relative" if begin_s is None else "utc", own_address=OWN)


def read_logged_rows(
    content: bytes, fields: Mapping[str, tuple[str, ...]] = FIELDS
) -> tuple[list[LoggedRow], int, int]:
    """Messages that are read, in their order, how many others, and bytes that hold none.

    Fewer than 0 where the last one is cut off.
    """
    from pymavlink.DFReader import DFReader_binary

    with tempfile.NamedTemporaryFile(suffix=".bin") as file:
        file.write(content)
        file.flush()
        reader = DFReader_binary(file.name)
        found = []
        while (message := reader.recv_match(type=list(fields))) is not None:
            kind = message.get_type()
            values = {name: _number(message, name) for name in fields[kind]}
            found.append(LoggedRow(kind, values))
        counts = {n: count for n, count in enumerate(reader.counts) if count}
        known = sum(count * reader.formats[n].len for n, count in counts.items())
        others = max(sum(counts.values()) - len(found), 0)
        return found, others, len(content) - known


def _number(message: Any, name: str) -> float | None:
    try:
        value = getattr(message, name)
    except AttributeError:
        return None
    return float(value) if isinstance(value, (int, float)) else None


def _boot_s(row: LoggedRow) -> float | None:
    """When the vehicle was started, seconds since 1970, by a GPS message that tells the time."""
    values = row.values
    if row.kind != "GPS" or (values["Status"] or 0.0) < FIX_3D or not values["GWk"]:
        return None
    if values["TimeUS"] is None or values["GMS"] is None:
        return None
    gps_s = WEEK_S * values["GWk"] + 1e-3 * values["GMS"]
    return utc_of_gps(gps_s) - MICROSECOND_S * values["TimeUS"]


class _Own:
    """What barometer and GPS told between positions, since boot."""

    def __init__(self) -> None:
        self._pressure: tuple[float, float] | None = None
        self._undulation: tuple[float, float] | None = None

    def take(self, row: LoggedRow, boot_s: float, begin_s: float, sieve: Sieve) -> None:
        values = row.values
        if row.kind == "BARO":
            if (values["Press"] or 0.0) > 0.0:
                self._pressure = (boot_s, values["Press"] or 0.0)
            sieve.use("pressure")
        elif row.kind == "GPA":
            if values["Und"]:
                self._undulation = (boot_s, values["Und"])
            sieve.use("accuracy of GPS")
        elif (values["Status"] or 0.0) < FIX_3D:
            sieve.drop("no fix of GPS")
        else:
            self._place(values, boot_s, begin_s, sieve)

    def _place(
        self, values: dict[str, float | None], boot_s: float, begin_s: float, sieve: Sieve
    ) -> None:
        latitude, longitude, height = values["Lat"], values["Lng"], values["Alt"]
        if latitude is None or longitude is None:
            sieve.drop(NO_POSITION)
            return
        sieve.heard[OWN] += 1
        pressure, undulation = (
            one[1] if one is not None and boot_s - one[0] <= FRESH_S else None
            for one in (self._pressure, self._undulation)
        )
        geometric = None if height is None or undulation is None else height - undulation
        if geometric is None:
            sieve.odd("GPS tells heights above the sea alone, taken as unknown")
        barometric = None
        if pressure is not None:
            barometric = LAPSE_M * (1.0 - (pressure / SEA_LEVEL_PA) ** EXPONENT)
        course, climb = values["GCrs"], values["VZ"]
        sieve.take(
            TrafficReport(
                begin_s + boot_s,
                OWN,
                latitude,
                longitude,
                geometric if barometric is None else barometric,
                "barometric" if barometric is not None else None if geometric is None
                else "geometric",
                geometric,
                values["Spd"],
                None if course is None else math.radians(course),
                None if climb is None else -climb,  # down positive in the log
                OWN,
            )
        )  # fmt: skip


def _take_other(values: dict[str, float | None], time_s: float, sieve: Sieve) -> None:
    """Raw numbers of ADSB_VEHICLE: degrees times 1e7, millimetres, centimetres a second."""
    number = int(values["ICAO_address"] or 0) & 0xFFFFFF
    if not number:
        sieve.drop(NO_ADDRESS)
        return
    address = f"{number:06x}"
    sieve.heard[address] += 1
    latitude, longitude = values["Lat"], values["Lng"]
    if not latitude and not longitude:
        sieve.drop(NO_POSITION)
        return
    height, heading = values["Alt"], values["Heading"]
    sieve.take(
        TrafficReport(
            time_s,
            address,
            (latitude or 0.0) * 1e-7,
            (longitude or 0.0) * 1e-7,
            None if height is None else height * 1e-3,
            None if height is None else "barometric",
            None,
            _scale(values["Hor_vel"], 1e-2),
            None if heading is None else math.radians(heading * 1e-2),
            _scale(values["Ver_vel"], 1e-2),
            "",
            "adsb",
        )
    )


def _scale(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor
