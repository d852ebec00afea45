"""Commands of MAVLink (MAV_CMD) in plans of ground stations: names, and which lead where."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

Action = Literal["take-off", "waypoint", "return", "land"]
ACTIONS: Mapping[int, Action] = {
    16: "waypoint",
    17: "waypoint",
    18: "waypoint",
    19: "waypoint",
    20: "return",
    21: "land",
    22: "take-off",
    31: "waypoint",
    36: "waypoint",
    82: "waypoint",
    84: "take-off",
    85: "land",
    94: "land",
}
"""Commands that lead somewhere; 94 descends to its place, puts its load down and climbs again."""
LOITERING = (17, 18, 19, 31)
UNLIMITED = 17
"""Nothing after this loiter is flown."""
BENT = {36: "arc to a waypoint, flown straight", 82: "spline to a waypoint, flown straight"}
DELAY = 93
CHANGE_SPEED = 178
DO_JUMP = 177
JUMP_TAG = 600
DO_JUMP_TAG = 601
FENCE_INSIDE = 5001
FENCE_OUTSIDE = 5002
CIRCLE_INSIDE = 5003
CIRCLE_OUTSIDE = 5004
RALLY = 5100
FENCE_AND_RALLY_ITEMS = range(5000, 5101)
"""Items of fence and rally files."""
NAMES: Mapping[int, str] = {
    16: "WAYPOINT", 17: "LOITER_UNLIM", 18: "LOITER_TURNS", 19: "LOITER_TIME",
    20: "RETURN_TO_LAUNCH", 21: "LAND", 22: "TAKEOFF", 30: "CONTINUE_AND_CHANGE_ALT",
    31: "LOITER_TO_ALT", 34: "DO_ORBIT", 36: "ARC_WAYPOINT", 80: "ROI", 82: "SPLINE_WAYPOINT",
    83: "ALTITUDE_WAIT", 84: "VTOL_TAKEOFF", 85: "VTOL_LAND", 92: "GUIDED_ENABLE", 93: "DELAY",
    94: "PAYLOAD_PLACE", 112: "CONDITION_DELAY", 113: "CONDITION_CHANGE_ALT",
    114: "CONDITION_DISTANCE", 115: "CONDITION_YAW", 176: "DO_SET_MODE", 177: "DO_JUMP",
    178: "DO_CHANGE_SPEED", 179: "DO_SET_HOME", 180: "DO_SET_PARAMETER", 181: "DO_SET_RELAY",
    182: "DO_REPEAT_RELAY", 183: "DO_SET_SERVO", 184: "DO_REPEAT_SERVO",
    185: "DO_FLIGHTTERMINATION", 187: "DO_SET_ACTUATOR", 188: "DO_RETURN_PATH_START",
    189: "DO_LAND_START", 191: "DO_GO_AROUND", 194: "DO_SET_REVERSE",
    195: "DO_SET_ROI_LOCATION", 196: "DO_SET_ROI_WPNEXT_OFFSET", 197: "DO_SET_ROI_NONE",
    200: "DO_CONTROL_VIDEO", 201: "DO_SET_ROI", 202: "DO_DIGICAM_CONFIGURE",
    203: "DO_DIGICAM_CONTROL", 204: "DO_MOUNT_CONFIGURE", 205: "DO_MOUNT_CONTROL",
    206: "DO_SET_CAM_TRIGG_DIST", 207: "DO_FENCE_ENABLE", 208: "DO_PARACHUTE",
    210: "DO_INVERTED_FLIGHT", 211: "DO_GRIPPER", 212: "DO_AUTOTUNE_ENABLE",
    213: "SET_YAW_SPEED", 214: "DO_SET_CAM_TRIGG_INTERVAL", 215: "DO_SET_RESUME_REPEAT_DIST",
    216: "DO_SPRAYER", 217: "DO_SEND_SCRIPT_MESSAGE", 218: "DO_AUX_FUNCTION",
    222: "DO_GUIDED_LIMITS", 223: "DO_ENGINE_CONTROL", 400: "COMPONENT_ARM_DISARM",
    530: "SET_CAMERA_MODE", 531: "SET_CAMERA_ZOOM", 532: "SET_CAMERA_FOCUS", 600: "JUMP_TAG",
    601: "DO_JUMP_TAG", 1000: "DO_GIMBAL_MANAGER_PITCHYAW", 2000: "IMAGE_START_CAPTURE",
    2001: "IMAGE_STOP_CAPTURE", 2500: "VIDEO_START_CAPTURE", 2501: "VIDEO_STOP_CAPTURE",
    3000: "DO_VTOL_TRANSITION", 4501: "CONDITION_GATE", 5000: "FENCE_RETURN_POINT",
    5001: "FENCE_POLYGON_VERTEX_INCLUSION", 5002: "FENCE_POLYGON_VERTEX_EXCLUSION",
    5003: "FENCE_CIRCLE_INCLUSION", 5004: "FENCE_CIRCLE_EXCLUSION", 5100: "RALLY_POINT",
    42600: "DO_WINCH", 42702: "SCRIPT_TIME", 42703: "ATTITUDE_TIME",
}  # fmt: skip
"""Without the MAV_CMD_ and NAV_ that they begin with."""


def name_command(command: int | None) -> str:
    """Return a command in words, such as `command 115 (CONDITION_YAW)`."""
    name = NAMES.get(command or 0)
    return f"command {command} ({name})" if name else f"command {command}"
