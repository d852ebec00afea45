"""What the node says: set-points, plans, decisions, diagnostics, markers, as messages."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray, ned_from_enu, world_from_body
from clearway.io.json_values import round_number
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.set_point import SetPoint
from clearway.live.outputs.flight_decision import FlightDecision
from clearway.ros2.messages import make_message

NAN3 = np.full(3, math.nan, dtype=np.float32)
FOLLOW_WHOLLY = 0x000
FOLLOW = 0x9C0
HOLD = 0x9F8
VELOCITY = 0x5C7
"""Type masks of mavros_msgs/PositionTarget: all counts; place, velocity and yaw; place and yaw;
velocity and yaw rate."""
LOCAL_NED = 1
"""FRAME_LOCAL_NED, which mavros turns from z-up itself."""
OK = 0
WARN = 1
ERROR = 2
AHEAD_S = 1.0
"""How far ahead a path leads that is sent as a set-point."""


def make_stamp(time_s: float) -> Any:
    seconds = math.floor(time_s)
    nanoseconds = min(999_999_999, round((time_s - seconds) * 1e9))
    return make_message("builtin_interfaces/msg/Time", sec=int(seconds), nanosec=nanoseconds)


def header(time_s: float, frame: str) -> Any:
    return make_message("std_msgs/msg/Header", stamp=make_stamp(time_s), frame_id=frame)


def point(place: FloatArray, kind: str = "Point") -> Any:
    x, y, z = place.tolist()
    return make_message(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)


def turn_into_message(yaw_rad: float) -> Any:
    return make_message(
        "geometry_msgs/msg/Quaternion",
        x=0.0, y=0.0, z=math.sin(0.5 * yaw_rad), w=math.cos(0.5 * yaw_rad),
    )  # fmt: skip


def make_set_point_message(kind: str, told: SetPoint, time_s: float, frame: str) -> Any:
    """A set-point as one of the kinds that `parameters.SetPointParameters` names, but for those of
    velocity alone."""
    faster, rate = told.acceleration_mps2, told.yaw_rate_rps
    velocity = np.zeros(3) if told.velocity_mps is None else told.velocity_mps
    if kind == "TrajectorySetpoint":
        moving = told.velocity_mps is not None
        return make_message(
            "px4_msgs/msg/TrajectorySetpoint",
            timestamp=max(0, int(time_s * 1e6)),
            position=ned_from_enu(told.position_m).astype(np.float32),
            velocity=ned_from_enu(velocity).astype(np.float32) if moving else NAN3,
            acceleration=NAN3 if faster is None else ned_from_enu(faster).astype(np.float32),
            jerk=NAN3,
            yaw=math.remainder(0.5 * math.pi - told.yaw_rad, 2.0 * math.pi),
            yawspeed=math.nan if faster is None else -rate,
        )
    if kind == "PositionTarget":
        mask = HOLD if told.velocity_mps is None else FOLLOW
        return make_message(
            "mavros_msgs/msg/PositionTarget",
            header=header(time_s, frame),
            coordinate_frame=LOCAL_NED,
            type_mask=mask if faster is None else FOLLOW_WHOLLY,
            position=point(told.position_m),
            velocity=point(velocity, "Vector3"),
            acceleration_or_force=point(np.zeros(3) if faster is None else faster, "Vector3"),
            yaw=told.yaw_rad,
            yaw_rate=0.0 if faster is None else rate,
        )
    ahead = [told.position_m, told.position_m + AHEAD_S * velocity]
    return path_message(np.array(ahead), time_s, frame)


def twist_message(
    kind: str,
    velocity_mps: FloatArray,
    yaw_rate_rps: float,
    time_s: float,
    frame: str,
    yaw_rad: float | None,
) -> Any:
    """A Twist or TwistStamped of a velocity [3] of the world; yaw_rad: of the body that it is
    reported in, None for the world."""
    told = velocity_mps if yaw_rad is None else velocity_mps @ world_from_body([0.0, 0.0, yaw_rad])
    turning = point(np.array([0.0, 0.0, yaw_rate_rps]), "Vector3")
    one = make_message("geometry_msgs/msg/Twist", linear=point(told, "Vector3"), angular=turning)
    if kind == "Twist":
        return one
    return make_message("geometry_msgs/msg/TwistStamped", header=header(time_s, frame), twist=one)


def make_velocity_message(
    kind: str, velocity_mps: FloatArray, yaw_rate_rps: float, time_s: float, frame: str
) -> Any:
    """A velocity [3] of the world without a place, for an autopilot: TrajectorySetpoint or
    PositionTarget."""
    if kind == "TrajectorySetpoint":
        return make_message(
            "px4_msgs/msg/TrajectorySetpoint",
            timestamp=max(0, int(time_s * 1e6)),
            position=NAN3,
            velocity=ned_from_enu(velocity_mps).astype(np.float32),
            acceleration=NAN3,
            jerk=NAN3,
            yaw=math.nan,
            yawspeed=-yaw_rate_rps,
        )
    return make_message(
        "mavros_msgs/msg/PositionTarget",
        header=header(time_s, frame),
        coordinate_frame=LOCAL_NED,
        type_mask=VELOCITY,
        velocity=point(velocity_mps, "Vector3"),
        yaw_rate=yaw_rate_rps,
    )


def path_message(places_m: FloatArray, time_s: float, frame: str) -> Any:
    """A nav_msgs/Path [n, 3], each pose along the way to the next."""
    ways = np.diff(places_m, axis=0, append=places_m[-1:]) if len(places_m) else places_m
    poses, yaw, stamped = [], 0.0, header(time_s, frame)
    for place, (along, aside, _) in zip(places_m, ways.tolist(), strict=True):
        if math.hypot(along, aside) > 1e-9:
            yaw = math.atan2(aside, along)
        pose = make_message(
            "geometry_msgs/msg/Pose", position=point(place), orientation=turn_into_message(yaw)
        )
        poses.append(make_message("geometry_msgs/msg/PoseStamped", header=stamped, pose=pose))
    return make_message("nav_msgs/msg/Path", header=stamped, poses=poses)


def decision_row(flight: FlightDecision, outcome: TickOutcome) -> dict[str, Any]:
    """A decision with its reasons, as JSON."""
    return {
        "time_s": round(flight.time_s, 6),
        "link": str(outcome.state),
        "why_now": outcome.why_now,
        "mode": str(flight.mode),
        "why_mode": flight.mode_state.why,
        "goal": flight.goal,
        "position_m": [round(v, 3) for v in flight.state.position_m.tolist()],
        "movements": list(flight.movements),
        "margin_m": round(flight.decision.margin_m, 3),
        "basis": str(flight.decision.choice.basis),
        "explanation": flight.explanation,
        "scan_age_s": round_number(flight.scan_age_s),
        "elapsed_ms": round(1e3 * outcome.elapsed_s, 3),
    }


def make_guarded_row(outcome: TickOutcome) -> dict[str, Any]:
    """What a guardian said, as JSON."""
    guarded = outcome.guarded
    assert guarded is not None
    return {
        "time_s": round(outcome.time_s, 6),
        "link": str(outcome.state),
        "passed": guarded.passed,
        "what": guarded.what,
        "changed_mps": None
        if guarded.changed_mps is None
        else round_number(guarded.changed_mps, 3),
        "why": guarded.why,
        "velocity_mps": [round(v, 3) for v in guarded.velocity_mps.tolist()],
        "yaw_rate_rps": round(guarded.yaw_rate_rps, 4),
        "margin_m": round(guarded.margin_m, 3),
        "way_out": [] if guarded.way_out is None else list(guarded.way_out.movements),
        "elapsed_ms": round(1e3 * outcome.elapsed_s, 3),
    }


def string_of(row: Mapping[str, Any]) -> Any:
    return make_message("std_msgs/msg/String", data=json.dumps(row))


def diagnostics(
    name: str, level: int, words: str, values: Mapping[str, object], time_s: float
) -> Any:
    pairs = [
        make_message("diagnostic_msgs/msg/KeyValue", key=key, value=str(value))
        for key, value in values.items()
    ]
    status = make_message(
        "diagnostic_msgs/msg/DiagnosticStatus",
        level=level, name=name, message=words, hardware_id="clearway", values=pairs,
    )  # fmt: skip
    return make_message(
        "diagnostic_msgs/msg/DiagnosticArray", header=header(time_s, ""), status=[status]
    )


def markers(flight: FlightDecision, time_s: float, frame: str) -> Any:
    """For RViz and Foxglove: plan and escape as lines, the reason as text."""
    decision = flight.decision
    way = decision.way_out_path_m
    lines = [
        _line("plan", decision.path_m, (0.84, 0.15, 0.16), time_s, frame),
        _line("escape", way, (0.03, 0.55, 0.51), time_s, frame),
    ]
    text = _marker("why", 9, time_s, frame)
    text.pose.position = point(flight.state.position_m + np.array([0.0, 0.0, 1.0]))
    text.scale.z, text.text = 0.5, str(flight.mode)
    text.color.r = text.color.g = text.color.b = text.color.a = 1.0
    return make_message("visualization_msgs/msg/MarkerArray", markers=[*lines, text])


def _line(
    name: str, places_m: FloatArray, rgb: tuple[float, float, float], time_s: float, frame: str
) -> Any:
    one = _marker(name, 4, time_s, frame)
    if len(places_m) < 2:
        one.action = 2  # DELETE
        return one
    one.points = [point(place) for place in places_m]
    one.scale.x = 0.1
    one.color.r, one.color.g, one.color.b, one.color.a = (*rgb, 1.0)
    return one


def _marker(name: str, kind: int, time_s: float, frame: str) -> Any:
    one = make_message(
        "visualization_msgs/msg/Marker", header=header(time_s, frame), ns=name, type=kind
    )
    one.pose.orientation = turn_into_message(0.0)
    return one
