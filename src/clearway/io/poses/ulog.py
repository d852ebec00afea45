"""ULog of PX4: the vehicle's way as a track, and what its transponder heard and where it was."""

from __future__ import annotations

import math
import struct
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.base.errors import InputError, MissingExtraError, naming
from clearway.base.frames import FloatArray
from clearway.io.apart import apart
from clearway.io.foreign_errors import damage_told
from clearway.io.poses.pose_track import (
    PoseTrack,
    convert_quaternion,
    pose_track,
    quaternions_of,
    slerp,
)
from clearway.io.poses.ulog_topics import Log, read_logged
from clearway.io.traffic.traffic_rows import NO_ADDRESS, NO_POSITION, Sieve
from clearway.traffic.recorded.report import TrafficRecording, TrafficReport

FORM = "ULog of PX4"
MAGIC = b"ULog\x01\x12\x35"
OWN = "own"
"""Address under which the vehicle's own positions are listed."""
HEADER_BYTES = 16
MESSAGE_HEAD = 3
MICROSECOND_S = 1e-6
ENU_FROM_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FRD_FROM_FLU = np.diag([1.0, -1.0, -1.0])
VALID_PLACE = 1
VALID_ALTITUDE = 2
VALID_HEADING = 4
VALID_VELOCITY = 8
VALID_CALLSIGN = 16
"""Flags of transponder_report, as of MAVLink's ADSB_VEHICLE."""
PRESSURE_ALTITUDE = 0
PLACE_FIELDS = ("timestamp", "x", "y", "z", "xy_valid", "z_valid")
TURN_FIELDS = ("timestamp", "q[0]", "q[1]", "q[2]", "q[3]")
FIX_3D = 3
UNIT_WITHIN = 0.1
"""Of length 1, within which four numbers are taken for a turn."""


class FlightLog(NamedTuple):
    """A flight as its autopilot logged it."""

    track: PoseTrack
    """In a local frame: x east, y north, z up from where the estimator began."""
    origin_geodetic: tuple[float, float, float] | None
    """Latitude and longitude in degrees and height of the local frame, where known."""


def read_ulog(path: str | Path) -> FlightLog:
    """Position and attitude of a log, seconds since 1970 where GPS told the time, else since boot.

    Raises InputError where it is damaged or has no position, MissingExtraError without [ulog].
    """
    path = Path(path)
    with naming(path, "read"):
        content = path.read_bytes()
    log, notes = read_topics(str(path), content, ["vehicle_local_position", "vehicle_attitude",
                                              "vehicle_gps_position"])  # fmt: skip
    with damage_told(path, "ULog"):
        return _make_flight(path, log, notes)


def _make_flight(path: Path, log: Log, notes: tuple[str, ...]) -> FlightLog:
    """The flight of a log's topics."""
    place, turn = _data(log, "vehicle_local_position"), _data(log, "vehicle_attitude")
    if place is None or turn is None:
        absent = "vehicle_local_position" if place is None else "vehicle_attitude"
        raise InputError(str(path), f"no {absent} in the log")
    require_fields(path, "vehicle_local_position", place, PLACE_FIELDS)
    require_fields(path, "vehicle_attitude", turn, TURN_FIELDS)
    valid = (place["xy_valid"] != 0) & (place["z_valid"] != 0)
    if not valid.any():
        raise InputError(str(path), "no valid position in the log (vehicle_local_position)")
    times = place["timestamp"].astype(np.float64)[valid] * MICROSECOND_S
    ned = np.column_stack([place[axis] for axis in "xyz"]).astype(np.float64)[valid]
    own, turns = _turns(turn)
    quaternion = _attitudes(own, turns, times)
    shift = utc_shift(log)
    if len(own) < len(turn["timestamp"]):
        left_out = len(turn["timestamp"]) - len(own)
        notes = (*notes, f"{left_out} attitudes left out: no unit quaternions")
    if not valid.all():
        notes = (*notes, f"{np.count_nonzero(~valid)} positions left out: not valid yet")
    told = tuple(f"{path}: {note}" for note in notes)
    track = pose_track(str(path), times + shift, ned @ ENU_FROM_NED.T, quaternion, told)
    return FlightLog(track, _origin(place))


def require_fields(path: Path, topic: str, data: Any, names: tuple[str, ...]) -> None:
    """Raise InputError naming the fields that a topic's columns lack."""
    lacks = [name for name in names if name not in data]
    if lacks:
        raise InputError(str(path), f"{topic} of the log lacks {', '.join(lacks)}")


def _turns(turn: Any) -> tuple[FloatArray, FloatArray]:
    """Times [n] and quaternions [n, 4] of what is a turn; raises ValueError where nothing is."""
    own = turn["timestamp"].astype(np.float64) * MICROSECOND_S
    logged = np.column_stack([turn[f"q[{n}]"] for n in range(4)]).astype(np.float64)
    whole = np.abs(np.linalg.norm(logged, axis=1) - 1.0) < UNIT_WITHIN
    if not whole.any():
        raise ValueError("no attitude is a unit quaternion")
    return own[whole], logged[whole]


def _attitudes(own: FloatArray, logged: FloatArray, times: FloatArray) -> FloatArray:
    """[n, 4] world (east, north, up) from body (ahead, left, up) at times."""
    after = np.clip(np.searchsorted(own, times), 1, max(1, len(own) - 1))
    rotations = []
    for at, time_s in zip(after, times, strict=True):
        before = at - 1
        at = min(int(at), len(own) - 1)
        gap = own[at] - own[before]
        share = float(np.clip((time_s - own[before]) / gap, 0.0, 1.0)) if gap > 0.0 else 0.0
        mixed = slerp(logged[before], logged[at], share)
        rotations.append(ENU_FROM_NED @ convert_quaternion(mixed) @ FRD_FROM_FLU)
    return quaternions_of(np.array(rotations))


def _origin(place: Any) -> tuple[float, float, float] | None:
    """The last reference told, which is the one that the estimator keeps."""
    where = [float(place[name][-1]) for name in ("ref_lat", "ref_lon", "ref_alt") if name in place]
    if len(where) < 3 or not all(map(math.isfinite, where)):
        return None
    return where[0], where[1], where[2]


def utc_shift(log: Log) -> float:
    """Seconds from the log's clock to UTC; 0 where GPS never told the time."""
    gps = _data(log, "vehicle_gps_position")
    if gps is None:
        return 0.0
    told = gps["time_utc_usec"] > 0
    if not told.any():
        return 0.0
    microseconds = gps["time_utc_usec"][told].astype(np.int64) - gps["timestamp"][told].astype(
        np.int64
    )
    return float(np.median(microseconds)) * MICROSECOND_S


def read_ulog_traffic(source: str, content: bytes) -> TrafficRecording:
    """Own GPS positions (address `own`) and the transponder's reports.

    Reports of nobody and nowhere are counted. Raises InputError where the log is damaged.
    """
    log, notes = read_topics(source, content, ["vehicle_gps_position", "transponder_report"])
    sieve = Sieve(source)
    sieve.notes.extend(notes)
    shift = utc_shift(log)
    _take_own(log, shift, sieve)
    for topic, data in log.topics:
        if topic == "transponder_report":
            for number in range(len(data["timestamp"])):
                _take_report(data, number, shift, sieve)
    clock = "utc" if shift or _data(log, "vehicle_gps_position") is not None else "relative"
    return sieve.recording(FORM, clock=clock, own_address=OWN)  # type: ignore[arg-type]


def _take_own(log: Log, shift: float, sieve: Sieve) -> None:
    gps = _data(log, "vehicle_gps_position")
    if gps is None:
        return
    degrees = "latitude_deg" in gps
    latitude = gps["latitude_deg"] if degrees else gps["lat"] * 1e-7
    longitude = gps["longitude_deg"] if degrees else gps["lon"] * 1e-7
    height = gps["altitude_ellipsoid_m"] if degrees else gps["alt_ellipsoid"] * 1e-3
    for n in range(len(gps["timestamp"])):
        if gps["fix_type"][n] < FIX_3D:
            sieve.drop("no fix of GPS")
            continue
        sieve.heard[OWN] += 1
        sieve.take(
            TrafficReport(
                float(gps["timestamp"][n]) * MICROSECOND_S + shift,
                OWN,
                float(latitude[n]),
                float(longitude[n]),
                float(height[n]),
                "geometric",
                float(height[n]),
                float(gps["vel_m_s"][n]),
                float(gps["cog_rad"][n]) % (2.0 * math.pi),
                -float(gps["vel_d_m_s"][n]),
                OWN,
            )
        )


def _take_report(data: Any, n: int, shift: float, sieve: Sieve) -> None:
    """One transponder_report: WGS 84 degrees, metres, m/s, heading in (-pi, pi]."""
    flags, number = int(data["flags"][n]), int(data["icao_address"][n])
    if number == 0:
        sieve.drop(NO_ADDRESS)
        return
    address = f"{number:06x}"
    sieve.heard[address] += 1
    if not flags & VALID_PLACE:
        sieve.drop(NO_POSITION)
        return
    moves = bool(flags & VALID_VELOCITY)
    height = float(data["altitude"][n]) if flags & VALID_ALTITUDE else None
    barometric = int(data["altitude_type"][n]) == PRESSURE_ALTITUDE
    letters = bytes(int(data[f"callsign[{k}]"][n]) & 0x7F for k in range(8))
    sieve.take(
        TrafficReport(
            float(data["timestamp"][n]) * MICROSECOND_S + shift - float(data["tslc"][n]),
            address,
            float(data["lat"][n]),
            float(data["lon"][n]),
            height,
            None if height is None else "barometric" if barometric else "geometric",
            None if barometric else height,
            float(data["hor_velocity"][n]) if moves else None,
            float(data["heading"][n]) % (2.0 * math.pi) if flags & VALID_HEADING else None,
            float(data["ver_velocity"][n]) if moves else None,
            letters.rstrip(b"\0 ").decode("ascii") if flags & VALID_CALLSIGN else "",
            "adsb",
        )
    )


def read_topics(source: str, content: bytes, names: list[str]) -> tuple[Log, tuple[str, ...]]:
    """The log with some of its topics, and a note where it ends in the middle."""
    if find_spec("pyulog") is None:
        raise MissingExtraError(f"reading {source}", "ulog")
    log = apart(Path(source), "ULog", read_logged, source, content, names)
    notes = ["damaged: parts of it were left out"] if log.damaged else []
    left = _bytes_left(content)
    if left:
        notes.append(f"cut off: the last {left} bytes are half a record; what is before was read")
    return log, tuple(notes)


def _bytes_left(content: bytes) -> int:
    """Bytes of an unfinished record at the end."""
    at = HEADER_BYTES
    while at + MESSAGE_HEAD <= len(content):
        (size,) = struct.unpack_from("<H", content, at)
        if at + MESSAGE_HEAD + size > len(content):
            break
        at += MESSAGE_HEAD + size
    return max(0, len(content) - at)


def _data(log: Log, name: str) -> Any:
    """Columns of a topic's first instance; None where it was not logged."""
    return next((data for topic, data in log.topics if topic == name), None)
