"""The same encounter in the other forms of traffic: tables, snapshots, traces, scripts."""

from __future__ import annotations

import csv
import gzip
import json
import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.samples.encounter import AIRCRAFT, BEGIN_S, FOOT_M, Row, row_at, rows


def _aircraft(row: Row) -> dict[str, Any]:
    """One aircraft as readsb tells it."""
    return {
        "hex": row.aircraft.address,
        "flight": row.aircraft.callsign.ljust(8),
        "type": "adsb_icao",
        "alt_baro": row.altitude_ft,
        "alt_geom": row.altitude_ft,
        "gs": round(row.speed_kt, 1),
        "track": row.aircraft.track_deg,
        "baro_rate": 0,
        "lat": round(row.latitude, 6),
        "lon": round(row.longitude, 6),
        "seen_pos": 0.0,
        "seen": 0.0,
    }


def write_readsb_lines(path: Path, rng: np.random.Generator) -> None:
    """Rows of aircraft, one a line, packed by gzip."""
    del rng
    lines = (json.dumps({"now": row.time_s, **_aircraft(row)}) + "\n" for row in rows())
    path.write_bytes(gzip.compress("".join(lines).encode(), mtime=0))


def write_readsb(path: Path, rng: np.random.Generator) -> None:
    """Snapshots (aircraft.json) in a list."""
    del rng
    found: dict[float, list[dict[str, Any]]] = {}
    for row in rows():
        found.setdefault(row.time_s, []).append(_aircraft(row))
    shots = [{"now": now, "messages": 0, "aircraft": both} for now, both in found.items()]
    path.write_text(json.dumps(shots))


def write_trace(path: Path, rng: np.random.Generator) -> None:
    """A day of one aircraft, as tar1090 keeps it."""
    del rng
    one = AIRCRAFT[0]
    trace = []
    for second in range(121):
        row = row_at(one, second)
        trace.append(
            [second, round(row.latitude, 6), round(row.longitude, 6), row.altitude_ft,
             round(row.speed_kt, 1), one.track_deg, 0, 0, {"flight": one.callsign}, "adsb_icao",
             row.altitude_ft, 0, None, None]
        )  # fmt: skip
    told = {"icao": one.address, "r": one.callsign, "timestamp": BEGIN_S, "trace": trace}
    path.write_text(json.dumps(told))


def write_states(path: Path, rng: np.random.Generator) -> None:
    """State vectors of OpenSky, one answer of its interface a line."""
    del rng
    found: dict[float, list[list[Any]]] = {}
    for row in rows():
        one = row.aircraft
        found.setdefault(row.time_s, []).append(
            [one.address, one.callsign.ljust(8), "Nowhere", int(row.time_s), int(row.time_s),
             round(row.longitude, 6), round(row.latitude, 6), one.altitude_m, False, one.speed_mps,
             one.track_deg, 0.0, None, one.altitude_m, None, False, 0]
        )  # fmt: skip
    answers = [{"time": int(now), "states": both} for now, both in found.items()]
    path.write_text("".join(json.dumps(one) + "\n" for one in answers))


def write_states_table(path: Path, rng: np.random.Generator) -> None:
    """The same as rows of OpenSky's history: metres, metres a second."""
    del rng
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            ("time", "icao24", "lat", "lon", "velocity", "heading", "vertrate", "callsign",
             "onground", "baroaltitude", "geoaltitude")
        )  # fmt: skip
        for row in rows():
            one = row.aircraft
            writer.writerow(
                (int(row.time_s), one.address, f"{row.latitude:.6f}", f"{row.longitude:.6f}",
                 one.speed_mps, one.track_deg, 0.0, one.callsign, False, one.altitude_m,
                 one.altitude_m)
            )  # fmt: skip


def write_trajectories(path: Path, rng: np.random.Generator) -> None:
    """Rows of the `traffic` library: feet, knots, feet a minute, milliseconds since 1970."""
    del rng
    path.write_text(
        json.dumps(
            [
                {
                    "timestamp": int(1000.0 * row.time_s),
                    "icao24": row.aircraft.address,
                    "callsign": row.aircraft.callsign,
                    "latitude": round(row.latitude, 6),
                    "longitude": round(row.longitude, 6),
                    "altitude": row.altitude_ft,
                    "groundspeed": round(row.speed_kt, 1),
                    "track": row.aircraft.track_deg,
                    "vertical_rate": 0,
                }
                for row in rows()
            ]
        )
    )


def write_trajectory_columns(path: Path, rng: np.random.Generator) -> None:
    """The same by column, as `to_json()` of the `traffic` library and of pandas has it."""
    del rng
    columns: dict[str, dict[str, Any]] = {}
    for number, row in enumerate(rows()):
        told = {
            "timestamp": int(1000.0 * row.time_s),
            "icao24": row.aircraft.address,
            "callsign": row.aircraft.callsign,
            "latitude": round(row.latitude, 6),
            "longitude": round(row.longitude, 6),
            "altitude": row.altitude_ft,
            "groundspeed": round(row.speed_kt, 1),
            "track": row.aircraft.track_deg,
            "vertical_rate": 0,
        }
        for name, value in told.items():
            columns.setdefault(name, {})[str(number)] = value
    path.write_text(json.dumps(columns))


def write_basestation(path: Path, rng: np.random.Generator) -> None:
    """Lines of BaseStation (SBS-1): position, then velocity."""
    del rng
    lines = []
    for row in rows():
        when = datetime.fromtimestamp(row.time_s, UTC)
        moment = f"{when:%Y/%m/%d},{when:%H:%M:%S}.000"
        head = f"1,1,{row.aircraft.address.upper()},1,{moment},{moment}"
        place = f"{row.latitude:.6f},{row.longitude:.6f}"
        speed = f"{row.speed_kt:.0f},{row.aircraft.track_deg:.0f}"
        lines.append(f"MSG,3,{head},,{row.altitude_ft},,,{place},,,0,0,0,0\n")
        lines.append(f"MSG,4,{head},,,{speed},,,0,,,,,0\n")
    path.write_text("".join(lines))


def write_daidalus(path: Path, rng: np.random.Generator) -> None:
    """A scenario of DAIDALUS: names, units, rows; the first aircraft is the own one."""
    del rng
    lines = ["NAME, lat, lon, alt, trk, gs, vs, time\n"]
    lines.append("[none], [deg], [deg], [ft], [deg], [knot], [fpm], [s]\n")
    for row in rows():
        one = row.aircraft
        name = "Ownship" if one is AIRCRAFT[0] else one.callsign
        lines.append(
            f"{name}, {row.latitude:.8f}, {row.longitude:.8f}, "
            f"{one.altitude_m / FOOT_M:.1f}, {one.track_deg:.1f}, {row.speed_kt:.4f}, 0.0, "
            f"{row.after_s:.1f}\n"
        )
    path.write_text("".join(lines))


def write_bluesky(path: Path, rng: np.random.Generator) -> None:
    """A script of BlueSky: both aircraft, where they begin."""
    del rng
    lines = []
    for one in AIRCRAFT:
        row = row_at(one, 0.0)
        feet, knots = one.altitude_m / FOOT_M, math.floor(row.speed_kt)
        lines.append(
            f"00:00:00.00>CRE {one.callsign},C172,{row.latitude:.6f},{row.longitude:.6f},"
            f"{one.track_deg:.0f},{feet:.0f},{knots}\n"
        )
    path.write_text("".join(lines))
