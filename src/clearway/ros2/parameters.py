"""Parameters of the node: their names, types, defaults and bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
)

from clearway.base.errors import InputError
from clearway.io.scans.optical import Axes

NODE = "clearway"
OWN_WORDS = "Value error, "
"""What pydantic writes before our own words."""


class ParameterSection(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class CloudParameters(ParameterSection):
    """A sensor of the mission: the `[[lidar]]` of the same name."""

    topic: str
    type: Literal["PointCloud2", "LaserScan"] = "PointCloud2"
    frame: Axes = "auto"
    """Axes of its points: body (x ahead), optical (z ahead), or as its frame is called."""
    deskew: bool = True
    """Whether per-point times, where the cloud has them, move points to the stamp."""
    reliable: bool = False
    """Ask for lost parts again: the publisher must be reliable too."""


class TrafficParameters(ParameterSection):
    topic: str
    type: Literal["Aircraft", "TransponderReport", "ADSBVehicle"]


class OwnParameters(ParameterSection):
    topic: str = "odom"
    type: Literal["Odometry", "PoseStamped", "PoseWithCovarianceStamped"] = "Odometry"


class SetPointParameters(ParameterSection):
    topic: str
    type: Literal["TrajectorySetpoint", "PositionTarget", "Twist", "TwistStamped", "Path"]
    frame: Literal["body", "map"] = "body"
    """Of a Twist: along the nose, or east, north, up."""


class GuardParameters(ParameterSection):
    """For `clearway guard`: what somebody wishes, and how long it counts."""

    topic: str = "cmd_vel_in"
    type: Literal["TrajectorySetpoint", "PositionTarget", "Twist", "TwistStamped", "Path"] = "Twist"
    frame: Literal["body", "map"] = "body"
    """Of a Twist: along the nose, or east, north, up. A TwistStamped may name its own."""
    speed_mps: float | None = Field(default=None, gt=0.0)
    """At which a Path is flown; by default the mission's."""
    timeout_s: float = Field(default=0.5, gt=0.0, le=10.0)
    """A wish counts for so long after it came."""
    hold_s: float = Field(default=0.5, gt=0.0, le=10.0)
    """For so long a wish is verified to be flown on."""
    acceleration_mps2: float | None = Field(default=None, gt=0.0)
    """At which the vehicle changes its velocity; by default the mission's, or a cautious 3 m/s2."""


class Px4Parameters(ParameterSection):
    """For `clearway px4`: how PX4 is found, and what it shows of clearway."""

    release: Literal["auto", "1.16", "1.17", "1.18"] = "auto"
    """Of PX4; auto: by the topics that it publishes."""
    name: str = Field(default="clearway", pattern="^[ -~]{1,24}$")
    """Of the flight mode, as ground stations show it."""
    prefix: str = ""
    """Of PX4's topics, before /fmu: /px4_1 of the second vehicle of a simulation."""
    wait_s: float = Field(default=15.0, gt=0.0, le=600.0)
    """For so long PX4's topics are looked for at the start."""
    distances: str = ""
    """Topic of px4_msgs/ObstacleDistance, in place of clouds."""
    fan_deg: float = Field(default=0.0, ge=0.0, le=90.0)
    """How far up and down its sectors tell the nearest distance."""
    replaces_offboard: bool = False
    """Whether the mode is flown where a pilot chooses Offboard."""


class NodeParameters(ParameterSection):
    """All of them."""

    mission: Path
    act: bool = False
    """Send set-points; else only plan, decision, diagnostics and markers are published."""
    rate: float = Field(default=10.0, ge=1.0, le=100.0)
    """Ticks a second."""
    use_sim_time: bool = False
    map_frame: str = "map"
    base_frame: str = "base_link"
    ground_m: float | None = None
    """Height of the ground in the map frame; the margin above it is the floor."""
    own: OwnParameters = OwnParameters()
    clouds: dict[str, CloudParameters] = {}
    """By the names of the mission's sensors."""
    traffic: dict[str, TrafficParameters] = {}
    """By names of the user's choice: ROS knows no lists of maps."""
    set_points: dict[str, SetPointParameters] = {}
    """By names of the user's choice."""
    autostart: bool = True
    """With rclpy: whether the node configures and activates itself at the start."""
    guard: GuardParameters = GuardParameters()
    """Of `clearway guard` and `clearway px4 --guard` alone."""
    px4: Px4Parameters = Px4Parameters()
    """Of `clearway px4` alone."""
    goal: str = "goal_pose"
    """Topic of a geometry_msgs/PoseStamped: a goal in place of the mission."""
    path: str = "path_in"
    """Topic of a nav_msgs/Path: goals in place of the mission."""

    @field_validator("traffic", "set_points", mode="before")
    @classmethod
    def _refuse_lists(cls, given: object, info: ValidationInfo) -> object:
        if isinstance(given, list | tuple):
            one = next((each for each in given if isinstance(each, dict)), {})
            pairs = ", ".join(f"{key}: {value}" for key, value in one.items())
            raise ValueError(
                f"is a list of maps, which ROS cannot read: give each a name, as in "
                f"{info.field_name}: {{first: {{{pairs}}}}}"
            )
        return given


def parameters_of(found: Mapping[str, Any], folder: Path) -> NodeParameters:
    """Return parameters of nested values; a mission lies beside `folder`'s files, or where it says.

    Raises ValidationError.
    """
    if isinstance(found.get("mission"), str):
        beside = folder / found["mission"]
        found = {**found, "mission": beside if beside.exists() else Path(found["mission"])}
    return NodeParameters.model_validate(found)


def list_problems(refused: ValidationError) -> list[str]:
    """Name each value that is refused, and why."""
    return [
        f"{'.'.join(str(part) for part in error['loc'])}: {error['msg'].removeprefix(OWN_WORDS)}"
        for error in refused.errors(include_url=False, include_input=False)
    ]


class Names:
    """Full names of topics: namespace, `~`, and remappings as `from:=to`."""

    def __init__(self, namespace: str = "", node: str = NODE, remap: Sequence[str] = ()) -> None:
        self.namespace = "/" + namespace.strip("/") if namespace.strip("/") else ""
        self._node = node
        pairs = [rule.partition(":=") for rule in remap]
        wrong = [rule for rule in remap if not rule.partition(":=")[2]]
        if wrong:
            raise InputError("--remap", f"{wrong[0]!r} is not FROM:=TO")
        self._remap = {self.full(before): self.full(after) for before, _, after in pairs}

    def full(self, name: str) -> str:
        """A name in the namespace, not remapped."""
        if name.startswith("~"):
            return f"{self.namespace}/{self._node}/{name.lstrip('~/')}"
        return name if name.startswith("/") else f"{self.namespace}/{name}"

    def __call__(self, name: str) -> str:
        return self._remap.get(self.full(name), self.full(name))
