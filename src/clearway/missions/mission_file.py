"""The mission file of `clearway fly`: all of its tables, and reading it."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.avoidance.costs import Prices
from clearway.avoidance.planner import AvoidanceSettings
from clearway.base.errors import InputError
from clearway.base.state import State
from clearway.io.toml import Section, parse_model, read_model, read_toml
from clearway.io.what_file import refuse_others
from clearway.live.mission import Mission
from clearway.missions.fault_section import FaultsSection
from clearway.missions.lidar_section import LidarSection
from clearway.missions.mission_sections import (
    MissionSection,
    PricesSection,
    RatingSection,
    ReachSetSection,
    SafetySection,
    SimulationSection,
    VehicleSection,
    VerifySection,
)
from clearway.missions.place_sections import MapSection, PointCloudSection, WorldObstacleSection
from clearway.missions.planned import PLANS, Notice, beside, plan_reader, planned_tables, with_plan
from clearway.missions.rule_sections import KeepOutSection, RulesSection
from clearway.missions.sections import GridSection
from clearway.missions.traffic_sections import FlyingIntruderSection, TrafficSection

OWN_ADDRESS = "ownship"
"""What the ownship's own transponder would report; no intruder of a mission has it."""

FARTHEST_M = 1e6
"""No waypoint is farther from the start: beyond, no flat frame would do."""


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

    @model_validator(mode="after")
    def _is_on_one_map(self) -> Self:
        start = np.array(self.vehicle.position_m)
        for name in ("waypoints_m", "landing_m"):
            for number, place in enumerate(getattr(self.mission, name)):
                away_m = float(np.linalg.norm(np.array(place) - start))
                if not away_m <= FARTHEST_M:
                    raise ValueError(
                        f"mission.{name}[{number}]: {away_m / 1e3:,.4g} km from the start; at most "
                        f"{FARTHEST_M / 1e3:,.0f} km are flown in one flat frame: is it in metres?"
                    )
        return self

    def to_mission(self) -> Mission:
        """The way to fly; raises InputError if it is none."""
        start = State(np.array(self.vehicle.position_m), np.radians(self.vehicle.attitude_deg))
        return Mission(
            self.mission.name,
            start,
            np.array(self.mission.waypoints_m),
            self.mission.reach_radius_m,
            np.array(self.mission.landing_m).reshape(-1, 3),
            self.mission.pass_within_m,
        )

    @property
    def follows_dynamic_objects(self) -> bool:
        """Whether what LiDAR alone sees move counts as traffic, said or by default."""
        said = self.traffic.follow_movers
        return any(not one.transponder for one in self.intruder) if said is None else said

    def to_avoidance(self) -> AvoidanceSettings:
        """How decisions are taken."""
        rating, safety = self.rating, self.safety
        return AvoidanceSettings(
            rating=rating.name,
            unknown=rating.unknown,
            unknown_unseen=rating.unknown_unseen,
            threshold=rating.threshold,
            verify=self.verify.method == "evidence",
            safety_margin_m=safety.margin_m,
            sigmas=safety.sigmas,
            own_drift_mps=safety.own_drift_mps,
            intruder_models=self.traffic.models,
            point_sigmas=safety.point_sigmas,
            smallest_object_m=safety.smallest_object_m,
            prices=Prices(**self.prices.model_dump()),
            sensor_fusion=rating.sensors,
        )

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
    if plan_reader(path) is not None:
        return parse_model(str(path), planned_tables(path, None, notice), MissionFile)
    if path.suffix != ".toml":
        refuse_others(path, "fly")
    mission = parse_model(str(path), with_plan(path, read_toml(path), notice), MissionFile)
    return _with_files_beside(path, mission)


def _with_files_beside(path: Path, mission: MissionFile) -> MissionFile:
    """Files that a mission names are looked for beside its own."""
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
    folder = resources.files("clearway.missions") / "built_in"
    return {
        entry.name.removesuffix(".toml"): entry
        for entry in folder.iterdir()
        if entry.name.endswith(".toml")
    }
