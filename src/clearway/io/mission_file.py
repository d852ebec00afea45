"""The mission file of `clearway fly`: its tables and keys, with defaults, as typed sections."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.errors import InputError
from clearway.intruders import Intruder
from clearway.io.fault_section import FaultsSection
from clearway.io.planned import PLANS, Notice, beside, planned_tables, with_plan
from clearway.io.rule_sections import KeepOutSection, RulesSection
from clearway.io.scene_file import ModelName
from clearway.io.sections import GridSection, Numbers, ObstacleSection, Point, Share, said
from clearway.io.toml import Section, parse_model, read_model, read_toml

Points = Annotated[tuple[Point, ...], Field(strict=False)]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
OWN_ADDRESS = "ownship"
"""What the ownship's own transponder would report; no intruder of a mission has it."""


class MissionSection(Section):
    """`[mission]`: where to go."""

    name: str
    """What logs, pictures and the output folder are called."""
    waypoints_m: Annotated[Points, Field(min_length=1)]
    """Points to fly to, in this order, world frame; `plan` can bring them."""
    plan: str | None = None
    """A ground station's .plan or .waypoints file, relative to the mission file. It brings name,
    waypoints, start, speed, fences, and what suits the speed; keys given here take precedence."""
    origin_geodetic: Point | None = None
    """Latitude and longitude in degrees, height above sea level in metres, of the world's origin;
    x is then east and y north. Default: amid the first map file, if there is one."""
    reach_radius_m: Positive = 1.5
    """A waypoint is reached within this distance; 0.4 turning radii serve well."""
    landing_m: Points = ()
    """Points of the landing sequence, after the last waypoint."""
    pass_within_m: Positive | None = None
    """A waypoint before the last also counts once it is abeam within this distance; default: every
    waypoint has to be reached."""


class VehicleSection(Section):
    """`[vehicle]`: start pose and movement automaton."""

    position_m: Point = (0.0, 0.0, 0.0)
    """Where the flight starts, world frame."""
    attitude_deg: Point = (0.0, 0.0, 0.0)
    """Roll, pitch (nose down positive), yaw (left positive)."""
    speed_mps: Positive = 1.0
    """Kept throughout: the vehicle cannot hover."""
    turn_step_deg: float = Field(default=15.0, gt=0.0, le=90.0)
    """Turn in one movement."""
    movement_s: Positive = 1.0
    """Duration of a movement."""
    pitch_limit_deg: float = Field(default=30.0, ge=0.0, lt=90.0)
    """Steepest pitch, up and down."""
    body_radius_m: NotNegative = 0.3
    """For the margins drawn in the picture of distances only."""


class ReachSetSection(Section):
    """`[reach_set]`: the trajectories to choose from."""

    method: Literal[
        "flying", "primitives", "cover", "late", "dispersion", "combined", "harmonic", "chaotic"
    ] = "flying"
    """How trajectories are selected; flying contains turns of any length, then straight."""


class SafetySection(Section):
    """`[safety]`: what to keep clear by."""

    margin_m: Positive = 0.6
    """From the vehicle's centre to any obstacle's surface."""
    conservative_turning_radius_m: Positive | None = None
    """Turning radius of (6.14), for the picture only; default: the automaton's."""
    sigmas: NotNegative = 3.0
    """Standard deviations of the own position by which the margin grows."""
    own_drift_mps: NotNegative = 0.05
    """Growth of the margin with the age of the own state."""
    point_sigmas: NotNegative = 2.0
    """Standard deviations of the range by which a hit point grows."""
    ground_height_m: float | None = None
    """Returns at or below this height are ground, no obstacles; a floor is then up to the map."""
    patience_turns: Positive = 1.5
    """Full circles' worth of time without progress before a detour."""


class RatingSection(Section):
    """`[rating]`: how evidence becomes a rating, and what a trajectory must have of it."""

    name: Literal["total", "printed", "visible", "evidence"] = "total"
    """total weighs what is seen, what the map says and what is hidden; printed is (4.22), visible
    that of 2.2.2, evidence 1 - P_O."""
    unknown: Share = 0.0
    """How far hidden space counts as blocked, u."""
    unknown_unseen: Share = 1.0
    """The same for columns that no beam looks into."""
    threshold: Share = 0.3
    """P_R that a trajectory must have."""
    detection: Literal["ratio", "surface"] = "ratio"
    """Hits by beams of the column (5.41), or by those that a reference surface returns."""
    sensors: Literal["conjunction", "weighted"] = "conjunction"
    """How several sensors become one: (5.38), or weighted by precision and trust; see
    [sensors.md](sensors.md)."""


class VerifySection(Section):
    """`[verify]`: whether candidates are held against the evidence itself."""

    method: Literal["evidence", "none"] = "evidence"
    """none flies on cell ratings alone, as the paper does."""


class PricesSection(Section):
    """`[prices]`: small prices beside the length flown."""

    turn: NotNegative = 0.2
    """Per movement that is not smooth, as a share of its length."""
    change: NotNegative = 0.1
    """Per movement unlike the one before it, as a share of its length."""
    vertical: NotNegative = 0.15
    """Per metre of height changed."""
    risk: NotNegative = 0.5
    """Per unit of -log P_R, in movement lengths: a dearer but safer trajectory may win."""
    coated: NotNegative = 3.0
    """For passing cells that the margin around evidence reaches into, in movement lengths."""
    miss: NotNegative = 2.0
    """For grazing the reach radius of the goal, in movement lengths."""
    other_side: NotNegative = 4.0
    """For passing on another side than the one committed to, in movement lengths."""
    other_plan: NotNegative = 0.1
    """For a first movement other than the last plan's, in movement lengths."""
    ahead: NotNegative = 0.0
    """For crossing ahead of an intruder, in movement lengths: above 0 passes behind (6.8)."""


class LidarSection(Section):
    """`[[lidar]]`: a sensor, its beams and its faults."""

    name: str = "lidar"
    """Differs from sensor to sensor."""
    pattern: str | None = None
    """A sensor by name; otherwise `beams_per_cell`, or lists of angles."""
    beams_per_cell: Annotated[tuple[int, int], Field(strict=False)] | None = None
    """Azimuths and elevations through every column; [20, 10] without any pattern."""
    azimuth_deg: Numbers | None = None
    """With `elevation_deg`: a beam at every azimuth and elevation listed."""
    elevation_deg: Numbers | None = None
    """Up positive."""
    position_m: Point = (0.0, 0.0, 0.0)
    """Where the sensor sits, body frame."""
    attitude_deg: Point = (0.0, 0.0, 0.0)
    """How it is turned in the body: roll, pitch (nose down positive), yaw."""
    min_range_m: NotNegative = 0.0
    """Blind range: nearer returns are dropped."""
    max_range_m: Positive | None = None
    """Default: the grid's range."""
    sigma_m: NotNegative = 0.0
    """Standard deviation of the range."""
    dropout: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Share of returns that get lost."""
    airframe_radius_m: NotNegative = 0.0
    """Returns within this distance of the body's origin come from the own airframe."""
    precision: float = Field(default=1.0, gt=0.0, le=1.0)
    """Among several sensors: share of its hits that lie in the cell that they are told for."""
    trust: float = Field(default=1.0, gt=0.0, le=1.0)
    """Among several sensors: how far its word counts; contradiction by others lowers it."""
    lie: Literal["none", "blind", "ghost-wall"] = "none"
    """What it tells in place of the truth: nothing at all, or a wall at half its range that travels
    along."""
    lies_from_s: NotNegative = 0.0
    """Time from which it lies."""

    @model_validator(mode="after")
    def _is_one_of_three(self) -> Self:
        if (self.azimuth_deg is None) != (self.elevation_deg is None):
            raise ValueError("azimuth_deg and elevation_deg are needed together")
        ways = [self.pattern, self.beams_per_cell, self.azimuth_deg]
        if sum(way is not None for way in ways) > 1:
            raise ValueError(
                "give one of pattern, beams_per_cell, or azimuth_deg and elevation_deg"
            )
        if self.beams_per_cell is not None and min(self.beams_per_cell) < 1:
            raise ValueError(f"beams_per_cell must be at least [1, 1], got {self.beams_per_cell}")
        if self.azimuth_deg == () or self.elevation_deg == ():
            raise ValueError("azimuth_deg and elevation_deg need at least one angle each")
        return self


class WorldObstacleSection(ObstacleSection):
    """`[[obstacle]]`: a shape of the world, of the map, or of both."""

    known: Literal["world", "map", "both"] = "world"
    """world: really there, not on the map; map: on the map only, a false positive; both."""


class TrafficSection(Section):
    """`[traffic]`: how intruders appear, are known, and are counted in the grid."""

    spawn: Literal["nominal", "ownship", "world"] = "nominal"
    """What positions and velocities are relative to: the nominal straight flight at the time of
    detection, the true ownship then, or the world."""
    models: Annotated[tuple[ModelName, ...], Field(strict=False, min_length=1)] = (
        "line",
        "spread",
    )
    """Intersection models that count in the grid."""
    position_sigma_m: NotNegative = 0.0
    """Standard deviation of reported positions, on each axis."""
    velocity_sigma_mps: NotNegative = 0.0
    """Standard deviation of reported velocities, on each axis."""
    deviates: bool = False
    """Intruders fly anywhere inside their stated spread, with a new direction every second."""
    report_s: Positive = 1.0
    """Time between reports of one intruder."""
    tracker: bool = False
    """Make reports into tracks first, which smooths noisy ones."""
    follow_movers: bool = False
    """Count what moves and is seen by LiDAR alone as intruders too."""
    recording: str | None = None
    """A recording of real traffic that plays around the flight, relative to the mission file; see
    [traffic.md](traffic.md) for the formats. It needs `origin_geodetic`, whose height is then an
    altitude as the aircraft report it."""
    recording_from: str | float | None = None
    """Moment of the recording at which the flight begins: 2025-06-01T12:00Z, or seconds on the
    recording's own clock. Default: its first report."""
    own_address: str | None = None
    """The aircraft of the recording whose place the ownship takes: it is left out."""
    heights: Literal["barometric", "geometric"] = "barometric"
    """Altitudes of the recording that count; the two are never mixed."""
    heard_within_m: Positive = 20_000.0
    """Reports from farther away, horizontally, are not heard."""


class FlyingIntruderSection(Section):
    """`[[intruder]]`: one that appears during the mission."""

    name: str
    """Differs from intruder to intruder."""
    appears_s: NotNegative
    """Time of the mission from which it is there, and reports itself if it can."""
    position_m: Point
    """Where it is then; `[traffic] spawn` says in which frame."""
    velocity_mps: Point
    """In the same frame."""
    spread_deg: Annotated[tuple[float, float], Field(strict=False)] = (0.0, 0.0)
    """[horizontal, vertical] half-angles."""
    radius_m: NotNegative = 0.0
    """Of its body; the margin is kept from its surface."""
    transponder: bool = True
    """Whether it reports itself."""
    visible: bool | None = None
    """Whether a LiDAR sees it, as a ball of its radius; default: if it has no transponder."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        said(self._reported)
        if self.seen_by_lidar and self.radius_m == 0.0:
            raise ValueError("a LiDAR sees it as a ball, so radius_m must be above 0")
        return self

    @property
    def seen_by_lidar(self) -> bool:
        """Whether a LiDAR sees it, said or by default."""
        return not self.transponder if self.visible is None else self.visible

    def _reported(self) -> Intruder:
        return Intruder(
            np.array(self.position_m),
            np.array(self.velocity_mps),
            np.radians(self.spread_deg),
            self.radius_m,
            self.name,
        )


class PointCloudSection(Section):
    """`[point_cloud]`: a surveyed place as the world to fly in."""

    file: str
    """Relative to the mission file."""
    point_radius_m: Positive
    """What a stored point stands for: half the spacing of the survey, or more."""
    origin_m: Point | Literal["lowest-corner", "file"] = "lowest-corner"
    """What becomes the world's origin: a point of the survey, its lowest corner, or its own."""
    leave_out_classes: Annotated[tuple[int, ...], Field(strict=False)] = ()
    """ASPRS classes that are not there; noise never is."""


class MapSection(Section):
    """`[map]`: map files as obstacles that are known, and zones to keep out of."""

    files: Annotated[tuple[str, ...], Field(strict=False, min_length=1)]
    """Relative to the mission file; see [maps.md](maps.md) for the formats."""
    known: Literal["world", "map", "both"] = "both"
    """both: really there and on the map; world: there, but not on the map; map: on the map only.
    Zones to keep out of are always on the map only."""
    point_radius_m: Positive = 20.0
    """What an obstacle stands for that a file gives as a mere point."""
    beyond_m: Positive = 300.0
    """What lies farther than this from the box around the mission is left out."""
    keep_out: bool = True
    """Whether zones of the airspace are kept out of."""
    at: str | None = None
    """Moment of the flight, such as 2025-06-01T12:00Z: zones not in force then do not count."""


class SimulationSection(Section):
    """`[simulation]`: what truth is like."""

    seed: int = Field(default=0, ge=0)
    """Of all noise; the same seed flies the same flight."""
    step_s: float = Field(default=0.05, gt=0.0, le=0.05)
    """Step of the true motion."""
    scan_latency_s: NotNegative = 0.0
    """Age of a scan when it reaches the vehicle."""
    state_noise_mps: NotNegative = 0.0
    """Bound of the disturbance w (3.20) on each axis of velocity."""
    input_noise: NotNegative = 0.0
    """Bound of the disturbance v (3.20), as a share of speed and of the turn rate."""
    wind_mps: Point = (0.0, 0.0, 0.0)
    """Steady wind that carries the vehicle, world frame; unknown to it."""
    position_sigma_m: NotNegative = 0.0
    """Standard deviation of the own position as measured; stated to the vehicle."""
    time_limit_s: Positive | None = None
    """End of a flight that does not arrive; default: six straight flights and a minute."""


class MissionFile(Section):
    """All of a mission file; only `[mission]` is needed."""

    mission: MissionSection
    vehicle: VehicleSection = VehicleSection()
    grid: GridSection = GridSection()
    reach_set: ReachSetSection = ReachSetSection()
    safety: SafetySection = SafetySection()
    rating: RatingSection = RatingSection()
    verify: VerifySection = VerifySection()
    prices: PricesSection = PricesSection()
    rules: RulesSection = RulesSection()
    simulation: SimulationSection = SimulationSection()
    faults: FaultsSection = FaultsSection()
    point_cloud: PointCloudSection | None = None
    map: MapSection | None = None
    traffic: TrafficSection = TrafficSection()
    intruder: Annotated[tuple[FlyingIntruderSection, ...], Field(strict=False)] = ()
    lidar: Annotated[tuple[LidarSection, ...], Field(strict=False)] = (LidarSection(),)
    obstacle: Annotated[tuple[WorldObstacleSection, ...], Field(strict=False)] = ()
    keep_out: Annotated[tuple[KeepOutSection, ...], Field(strict=False)] = ()

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [lidar.name for lidar in self.lidar]
        if len(set(names)) < len(names):
            raise ValueError(f"lidar: names must differ, got {names}")
        names = [intruder.name for intruder in self.intruder]
        if len(set(names)) < len(names):
            raise ValueError(f"intruder: names must differ, got {names}")
        if OWN_ADDRESS in names:
            raise ValueError(f"intruder: {OWN_ADDRESS!r} is what the ownship calls itself")
        return self

    @model_validator(mode="after")
    def _recording_has_a_place(self) -> Self:
        if self.traffic.recording is None:
            return self
        if self.mission.origin_geodetic is None:
            raise ValueError("traffic.recording: mission.origin_geodetic is needed to place it")
        if self.intruder:
            raise ValueError("traffic.recording: there can be no [[intruder]] beside a recording")
        return self

    def effective(self) -> dict[str, Any]:
        """Tables that fly the same mission again from anywhere, defaults filled in."""
        tables = self.model_dump(exclude_none=True)
        tables["grid"] = self.grid.effective()
        return tables

    def changed(self, section: str, **values: object) -> MissionFile:
        """The same mission with some values of one section replaced."""
        part = getattr(self, section).model_copy(update=values)
        return self.model_copy(update={section: part})


def read_mission(name_or_path: str, notice: Notice | None = None) -> MissionFile:
    """A mission of clearway by name, a mission file, or a flight plan of a ground station.

    notice: called with what was assumed or left out. Raises InputError with every problem of a
    file.
    """
    built_in = built_in_missions()
    if name_or_path in built_in:
        with resources.as_file(built_in[name_or_path]) as path:
            return read_model(path, MissionFile)
    path = Path(name_or_path)
    if not path.exists() and path.suffix not in (".toml", *PLANS):
        names = ", ".join(sorted(built_in))
        raise InputError(name_or_path, f"no such mission or file; missions by name: {names}")
    if path.suffix in PLANS:
        return parse_model(str(path), planned_tables(path, None, notice), MissionFile)
    mission = parse_model(str(path), with_plan(path, read_toml(path), notice), MissionFile)
    if mission.point_cloud is not None:
        file = beside(path, mission.point_cloud.file)
        mission = mission.changed("point_cloud", file=file)
    if mission.map is not None:
        files = tuple(beside(path, file) for file in mission.map.files)
        mission = mission.changed("map", files=files)
    if mission.traffic.recording is not None:
        mission = mission.changed("traffic", recording=beside(path, mission.traffic.recording))
    return mission


def built_in_missions() -> dict[str, Any]:
    """Missions that come with clearway, by name."""
    folder = resources.files("clearway") / "missions"
    return {
        entry.name.removesuffix(".toml"): entry
        for entry in folder.iterdir()
        if entry.name.endswith(".toml")
    }
