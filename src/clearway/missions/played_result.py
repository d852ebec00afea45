"""The result of `assess --all`: each scan and its decision as plain values, and in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from clearway.base.brief import runs
from clearway.io.json_values import finite
from clearway.live.mission import Mode
from clearway.live.playback import PlayedScan
from clearway.missions.played_scene import Playback
from clearway.missions.recorded_scan import beams_in_words


def make_played_result(
    name: str, playback: Playback, scans: list[dict[str, Any]]
) -> dict[str, Any]:
    """The object that `assess --all --json` prints."""
    return {
        "name": name,
        "file": playback.sequence.source,
        "format": playback.sequence.format,
        "pattern": playback.lidar.pattern.name,
        "pattern_from": playback.pattern_from,
        "vehicle": {"kind": playback.vehicle, "speed_mps": playback.speed_mps},
        "poses": playback.posed,
        "left_out": dict(playback.left_out.counts),
        "left_out_first": dict(playback.left_out.first),
        "scans": scans,
    }


def scan_result(index: int, played: PlayedScan) -> dict[str, Any]:
    """One scan and its decision; None for what is not finite."""
    flight, state = played.decision, played.moment.state
    choice, planned = flight.decision.choice, played.planned
    return {
        "scan": index,
        "time_s": state.time_s,
        "position_m": state.position_m.tolist(),
        "attitude_deg": np.degrees(state.attitude_rad).tolist(),
        "planned_position_m": None if planned is None else planned.position_m.tolist(),
        "points": len(played.moment.scan.points_m),
        "hits": played.hits,
        "nearest_m": finite(played.nearest_m),
        "mode": str(flight.mode),
        "basis": str(choice.basis),
        "movements": list(flight.movements),
        "p_reach": finite(choice.rating),
        "p_decision": finite(choice.feasibility),
        "clearance_m": finite(choice.clearance_m),
        "margin_m": flight.decision.margin_m,
        "explanation": flight.explanation,
        "counts": dict(flight.counts),
    }


def describe_playback(result: Mapping[str, Any]) -> str:
    """A line a scan under what is the same for all."""
    beams = beams_in_words(result["pattern_from"], result["pattern"])
    poses = "recorded" if result["poses"] else "none: hovering, goal straight ahead, no memory"
    left_out = ", ".join(f"{count} {reason}" for reason, count in result["left_out"].items())
    head = [
        ("scans", f"{result['format']}: {len(result['scans'])} decided, left out {left_out or 0}"),
        ("beams", beams),
        ("vehicle", f"{result['vehicle']['kind']}, {result['vehicle']['speed_mps']:g} m/s"),
        ("poses", poses),
    ]
    head += [("left out", words) for words in result["left_out_first"].values()]
    lines = [f"{name:<12}{text}" for name, text in head]
    lines.append("scan   after s   points    hits  nearest m   P_R    P_D  clearance m  decision")
    scans = result["scans"]
    for one in scans:
        lines.append(
            f"{one['scan']:<5}{one['time_s'] - scans[0]['time_s']:9.3f}{one['points']:9d}"
            f"{one['hits']:8d}{_number(one['nearest_m'])}{_number(one['p_reach'], 6)}"
            f"{_number(one['p_decision'], 7)}{_number(one['clearance_m'], 13)}  "
            f"{one['mode']}: {_runs(one['movements'])}"
        )
    return "\n".join([*lines, *_why_nothing_is_planned(scans, result["vehicle"])])


def _why_nothing_is_planned(scans: list[dict[str, Any]], vehicle: Mapping[str, Any]) -> list[str]:
    """What stands too near, or what the vehicle cannot do, where no scan leads to a plan."""
    near = [one["nearest_m"] for one in scans if one["nearest_m"] is not None]
    if not near or any(one["mode"] not in (Mode.EMERGENCY, Mode.ESCAPE) for one in scans):
        return []
    is_clear = min(near) >= scans[0]["margin_m"]
    if is_clear and any(one["mode"] != Mode.EMERGENCY for one in scans):
        return [
            f"why         no plan of a {vehicle['kind']} at {vehicle['speed_mps']:g} m/s keeps an "
            "escape through space that was seen: --vehicle inertialess can stop, a lower --speed "
            "or a shorter --range needs less space"
        ]
    return [
        f"why         nothing keeps the margin of {scans[0]['margin_m']:.2f} m: the nearest return "
        f"is {min(near):.2f} m away, as beside a wall or on a bench. If it is the own airframe, "
        "type --airframe-radius; if your vehicle needs less, --vehicle, --speed, or a scene with "
        "safety_margin_m"
    ]


def _number(value: float | None, width: int = 11) -> str:
    return f"{'-' if value is None else format(value, '.2f'):>{width}}"


def _runs(movements: list[str]) -> str:
    """The first movements, repeats counted."""
    told = runs(movements).split(", ")
    return ", ".join(told[:3]) + (" ..." if len(told) > 3 else "")
