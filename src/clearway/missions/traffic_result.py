"""The JSON of `clearway traffic`: an air picture as plain values, SI units in the keys."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray
from clearway.traffic.recorded.aircraft import Aircraft
from clearway.traffic.recorded.closest import ClosestPair
from clearway.traffic.recorded.picture import AirPicture
from clearway.traffic.recorded.report import Clock


def traffic_result(picture: AirPicture) -> dict[str, Any]:
    """One recording; every aircraft, and every pair that came within 10 km, nearest first.

    Pairs of which one is slow (no faster than 40 kt) follow all others.
    """
    recording, span = picture.recording, picture.span_s
    start, end = span or (None, None)
    clock = recording.clock
    return {
        "file": recording.source,
        "format": recording.format,
        "clock": clock,
        "from_s": start,
        "to_s": end,
        "from": _utc(start, clock),
        "to": _utc(end, clock),
        "messages": recording.messages,
        "reports": len(recording.reports),
        "of_use": dict(recording.of_use),
        "left_out": dict(recording.left_out),
        "notes": list(recording.notes),
        "own_address": picture.own_address,
        "aircraft": [_aircraft(one, picture, clock) for one in picture.aircraft],
        "heard_without_position": dict(picture.unplaced),
        "radar_only": picture.radar_only,
        "ghosts": dict(picture.ghosts),
        "pairs": [_pair(pair, clock) for pair in picture.pairs],
        "pairs_without_height": [list(names) for names in picture.without_height],
    }


def _aircraft(one: Aircraft, picture: AirPicture, clock: Clock) -> dict[str, Any]:
    gaps = one.gaps_s
    return {
        "address": one.address,
        "callsign": one.callsign,
        "source": one.source,
        "reports": len(one.time_s),
        "from_s": float(one.time_s[0]),
        "to_s": float(one.time_s[-1]),
        "from": _utc(float(one.time_s[0]), clock),
        "to": _utc(float(one.time_s[-1]), clock),
        "altitude_m": _range(one.altitude_m),
        "altitude_step_m": round(one.altitude_step_m, 6),
        "on_ground": int(np.count_nonzero(one.on_ground)),
        "ground_speed_mps": _range(one.ground_speed_mps),
        "visits": one.visits,
        "gaps": len(gaps),
        "longest_gap_s": round(float(gaps.max()), 3) if len(gaps) else None,
        "jumps": one.jumps,
        "doubles": picture.ghosts.get(one.address),
    }


def _pair(pair: ClosestPair, clock: Clock) -> dict[str, Any]:
    return {
        "addresses": [pair.first.address, pair.second.address],
        "callsigns": [pair.first.callsign, pair.second.callsign],
        "time_s": pair.time_s,
        "time": _utc(pair.time_s, clock),
        "distance_m": round(pair.distance_m, 3),
        "height_m": round(pair.height_m, 3),
        "height_step_m": round(pair.height_step_m, 6),
        "slant_m": round(pair.slant_m, 3),
        "altitude_m": round(pair.altitude_m, 3),
        "relative_mps": None if pair.relative_mps is None else round(pair.relative_mps, 3),
        "latitude_deg": round(pair.latitude_deg, 7),
        "longitude_deg": round(pair.longitude_deg, 7),
        "together_s": pair.together_s,
        "slow": list(pair.slow),
    }


def _utc(time_s: float | None, clock: Clock) -> str | None:
    if time_s is None or clock != "utc" or not math.isfinite(time_s):
        return None
    return datetime.fromtimestamp(time_s, UTC).isoformat(timespec="milliseconds")


def _range(values: FloatArray) -> list[float] | None:
    """Least and largest of the known values."""
    known = values[~np.isnan(values)]
    return [round(float(known.min()), 3), round(float(known.max()), 3)] if len(known) else None
