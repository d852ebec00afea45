"""Topics of a run's MCAP file: clearway's own as JSON with these schemas, the rest Foxglove's."""

from __future__ import annotations

from typing import Any

from clearway.avoidance.rate.fusion import RATINGS

FORMAT = 1
"""Version of clearway's own messages; a reader refuses newer ones."""

MISSION = "/clearway/mission"
STATE = "/clearway/state"
DECISION = "/clearway/decision"
CELLS = "/clearway/cells"
REACH_SET = "/clearway/reach_set"
REACH = "/clearway/reach"
SCALARS = "/clearway/scalars"
INTRUDERS = "/clearway/intruders"

TRANSFORMS = "/tf"
SCENE = "/scene"
WORLD_POINTS = "/world_points"
PLAN_SCENE = "/plan"
WAY_OUT_SCENE = "/way_out"
CELL_SCENE = "/cells"
REACH_SCENE = "/reach_set"
POINTS = "/points"
INTRUDER_SCENE = "/traffic"
LOG = "/log"
FIX = "/fix"
SCANS = "/scans/"
"""Before the name of a sensor."""

Schema = dict[str, Any]

_TYPES: dict[str, Schema] = {
    "number": {"type": "number"},
    "number?": {"type": ["number", "null"]},
    "integer": {"type": "integer"},
    "text": {"type": "string"},
    "text?": {"type": ["string", "null"]},
    "yes/no": {"type": "boolean"},
    "numbers": {"type": "array", "items": {"type": "number"}},
    "integers": {"type": "array", "items": {"type": "integer"}},
    "texts": {"type": "array", "items": {"type": "string"}},
    "points": {"type": "array", "items": {"type": "array", "items": {"type": "number"}}},
    "object": {"type": "object"},
    "object?": {"type": ["object", "null"]},
    "numbers?": {"type": ["array", "null"], "items": {"type": "number"}},
    "way?": {"type": ["object", "null"]},
    "objects": {"type": "array", "items": {"type": "object"}},
}


def _schema(title: str, **fields: str) -> Schema:
    return {
        "title": f"clearway.{title}",
        "type": "object",
        "properties": {name: _TYPES[kind] for name, kind in fields.items()},
    }


RATING = "rating_"
"""Before the name of a rating."""
CELL_QUANTITIES = (
    "obstacle",
    "visibility",
    "reachability",
    *(f"{RATING}{name}" for name in RATINGS),
    "detected",
    "map",
    "intruder",
)
"""[cells] values within [0, 1] that a message of CELLS holds; one of the user's own comes last."""
CELL_FLAGS = ("passed", "coated", "seen")
"""[cells] 0 or 1."""

SCHEMAS: dict[str, Schema] = {
    MISSION: _schema(
        "Mission",
        format="integer",
        clearway="text",
        name="text",
        planner="text",
        rating="text",
        threshold="number",
        margin_m="number",
        body_radius_m="number",
        speed_mps="number",
        ground_m="number?",
        start_m="numbers",
        waypoints_m="points",
        landing_m="points",
        reach_radius_m="number",
        obstacles="objects",
        intruder_radius_m="object",
        grid="object",
        voxel_m="number",
        vehicle="text",
        origin_geodetic="numbers?",
        begins_unix_s="number",
        terrain="object?",
        summary="object",
    ),
    STATE: _schema(
        "State",
        time_s="number",
        position_m="numbers",
        attitude_rad="numbers",
        obstacle_distance_m="number?",
        intruder_distance_m="number?",
    ),
    DECISION: _schema(
        "Decision",
        time_s="number",
        why_now="text",
        mode="text",
        mode_before="text?",
        why_mode="text",
        goal="integer",
        explanation="text",
        basis="text",
        position_m="numbers",
        attitude_rad="numbers",
        movements="texts",
        cost_m="number?",
        rating="number?",
        feasibility="number?",
        continuations="number?",
        clearance_m="number?",
        kept_clearance_m="number?",
        kept_predicted_m="number?",
        kept_level="number?",
        limited_by="text",
        margin_asked_m="number?",
        margin_kept_m="number?",
        side="text",
        candidates="integer",
        below_threshold="integer",
        ruled_out_by="object",
        ruled_out="objects",
        rules="objects",
        scan_age_s="number?",
        data_left_out="object",
        way_out="way?",
        no_way_out="texts",
        decide_within_s="number?",
        elapsed_ms="number",
        path_m="points",
        way_out_m="points",
        movers="objects",
    ),
    CELLS: _schema(
        "Cells",
        time_s="number",
        **dict.fromkeys(CELL_QUANTITIES, "numbers"),
        **dict.fromkeys(CELL_FLAGS, "integers"),
    ),
    REACH_SET: _schema(
        "ReachSet",
        start_pitch_rad="number",
        parent="integers",
        complete="integers",
        movement="integers",
        movement_names="texts",
        samples="integer",
        samples_mm="integers",
    ),
    REACH: _schema(
        "Reach", time_s="number", start_pitch_rad="number", chosen="integer", rating="numbers"
    ),
    SCALARS: _schema(
        "Scalars",
        time_s="number",
        mode="integer",
        alert="integer",
        cost_m="number?",
        rating="number?",
        clearance_m="number?",
        kept_clearance_m="number?",
        margin_asked_m="number?",
        margin_kept_m="number?",
        way_out_margin_m="number?",
        candidates="integer",
        ruled_out="integer",
        scan_age_s="number?",
        elapsed_ms="number",
    ),
    INTRUDERS: _schema("Intruders", time_s="number", intruders="objects"),
}
