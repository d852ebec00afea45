"""The mission file of `clearway fly`: all of its tables, and reading it."""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.avoidance.plan.costs import Prices
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.brief import in_brief, one_line
from clearway.base.errors import ClearwayError, InputError
from clearway.base.notebook import Marks, html_table, sketch_from_above
from clearway.base.state import State
from clearway.base.suggest import did_you_mean, file_nearby
from clearway.base.version import SCHEMA_VERSION
from clearway.io.public_data import at_hand, where_from
from clearway.io.toml import Section, parse_model, read_model, read_toml
from clearway.io.what_file import refuse_others
from clearway.live.mission import Mission
from clearway.missions.fault_section import FaultsSection
from clearway.missions.left_out import describe_left_out, values_left_out
from clearway.missions.lidar_section import LidarSection
from clearway.missions.mission_scale import FOLLOWING, mission_scale, suit_vehicle
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
from clearway.missions.place_sections import (
    ColumnsSection,
    MapSection,
    PointCloudSection,
    WorldObstacleSection,
)
from clearway.missions.planned import (
    PLANS,
    Notice,
    make_planned_tables,
    plan_reader,
    resolve_beside,
    with_plan,
)
from clearway.missions.rule_sections import KeepOutSection, RulesSection
from clearway.missions.sections import GridSection, state_problems, values_for, without_version
from clearway.missions.sensor_section import SensorSection
from clearway.missions.traffic_sections import FlyingIntruderSection, TrafficSection
from clearway.missions.volume_section import VolumeSection, volumes_of
from clearway.sim.worlds import WORLD_FAMILIES
from clearway.traffic.volumes import VOLUME_SETS, VolumeSet

OWN_ADDRESS = "ownship"
"""What the ownship's own transponder would report; no intruder of a mission has it."""

FARTHEST_M = 1e6
"""No waypoint is farther from the start: beyond, no flat frame would do."""


class MissionFile(Section):
    """All of a mission file; only `[mission]` is needed.

    >>> import clearway as cw
    >>> mission = cw.read_mission("static-obstacles").with_values("vehicle", speed_mps=0.8)
    >>> mission.vehicle.speed_mps, mission.effective()["safety"]["margin_m"]
    (0.8, 0.6)
    """

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
    columns: ColumnsSection | None = None
    point_cloud: PointCloudSection | None = None
    map: MapSection | None = None
    traffic: TrafficSection = TrafficSection()
    intruder: Annotated[tuple[FlyingIntruderSection, ...], Field(strict=False)] = ()
    lidar: Annotated[tuple[LidarSection, ...], Field(strict=False)] = (LidarSection(),)
    sensor: Annotated[tuple[SensorSection, ...], Field(strict=False)] = ()
    obstacle: Annotated[tuple[WorldObstacleSection, ...], Field(strict=False)] = ()
    keep_out: Annotated[tuple[KeepOutSection, ...], Field(strict=False)] = ()
    volume: Annotated[tuple[VolumeSection, ...], Field(strict=False)] = ()

    @model_validator(mode="before")
    @classmethod
    def _check_version(cls, data: Any) -> Any:
        return without_version(data)

    @model_validator(mode="after")
    def _suits_its_vehicle(self) -> Self:
        vars(self).update(
            suit_vehicle(self.mission, self.vehicle, self.grid, self.safety, self._known_lidars)
        )
        return self

    @property
    def _known_lidars(self) -> tuple[LidarSection, ...]:
        """The LiDARs, unless there are sensors of which nobody knows how far they see."""
        return () if self.sensor else self.lidar

    @property
    def left_out(self) -> dict[str, float]:
        """Values that the file leaves out and the vehicle decides, by `table.key`."""
        return values_left_out(FOLLOWING, vars(self))

    @property
    def scale_note(self) -> str | None:
        """Which values follow from the vehicle, and why; None where they are those of 1 m/s."""
        scale = mission_scale(self.mission, self.vehicle, self._known_lidars)
        return describe_left_out(FOLLOWING, vars(self), scale)

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
    def _volumes_are_nested(self) -> Self:
        if self.volume and self.traffic.volumes is not None:
            raise ValueError("traffic.volumes: leave it out where there are [[volume]] tables")
        if self.volume:
            state_problems(lambda: volumes_of(self.volume))
        elif self.traffic.keep_volumes and self.traffic.volumes is None:
            raise ValueError("traffic.keep_volumes: there are no volumes; name some by volumes")
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
        start = State(
            np.array(self.vehicle.position_m),
            np.radians(self.vehicle.attitude_deg),
            position_std_m=self.simulation.position_sigma_m,
            attitude_std_rad=np.radians(self.simulation.attitude_sigma_deg),
        )
        return Mission(
            self.mission.name,
            start,
            waypoints_m=np.array(self.mission.waypoints_m),
            reach_radius_m=self.mission.reach_radius_m,
            landing_m=np.array(self.mission.landing_m).reshape(-1, 3),
            pass_within_m=self.mission.pass_within_m,
        )

    def __repr__(self) -> str:
        tables = sorted(self.model_fields_set - {"mission"})
        facts = (in_brief(self.mission.name), f"{len(self.mission.waypoints_m)} waypoints", *tables)
        return one_line("MissionFile", facts)

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """For notebooks: the tables that differ from the defaults, and the way from above."""
        tables = self.model_dump(exclude_unset=True, exclude_none=True)
        facts = {name: _in_short(table) for name, table in tables.items() if table}
        way = np.array([self.vehicle.position_m, *self.mission.waypoints_m])
        goals = Marks(way[1:], "#2e9e4f", joined=False, size=3.0)
        sketch = sketch_from_above([Marks(way, "#9a9a9a"), goals])
        return html_table(f"Mission {self.mission.name}", facts, sketch)

    @property
    def follows_dynamic_objects(self) -> bool:
        """Whether what LiDAR alone sees move counts as traffic, said or by default."""
        said = self.traffic.follow_movers
        return any(not one.transponder for one in self.intruder) if said is None else said

    def to_volumes(self) -> VolumeSet | None:
        """Volumes about other aircraft to alert on; None where none are asked for."""
        if self.volume:
            return volumes_of(self.volume)
        named = self.traffic.volumes
        return None if named is None else VOLUME_SETS.find(named)

    def to_avoidance(self) -> AvoidanceSettings:
        """How the vehicle senses, remembers and decides."""
        volumes = self.to_volumes()
        return AvoidanceSettings(
            **values_for(AvoidanceSettings, self.rating, self.safety)
            | {"escape": self.safety.escape_kept},
            rating=self.rating.name,
            verify=self.verify.method == "evidence",
            safety_margin_m=self.safety.margin_m,
            body_radius_m=self.vehicle.body_radius_m,
            intruder_models=self.traffic.models,
            prices=Prices(**values_for(Prices, self.prices)),
            sensor_fusion=self.rating.sensors,
            volumes=volumes if self.traffic.keep_volumes else None,
            alert_volumes=volumes,
            follow_movers=self.follows_dynamic_objects,
            tracker=self.traffic.to_tracker(),
            transponder_address=OWN_ADDRESS,
            lowest_m=-np.inf if self.rules.floor_m is None else self.rules.floor_m,
            highest_m=np.inf if self.rules.ceiling_m is None else self.rules.ceiling_m,
        )

    def effective(self) -> dict[str, Any]:
        """Tables that fly the same mission again from anywhere, defaults filled in.

        `schema_version` stands before them: of the form that this version writes.
        """
        tables = {"schema_version": SCHEMA_VERSION, **self.model_dump(exclude_none=True)}
        tables["grid"] = self.grid.effective()
        tables["vehicle"] = self.vehicle.effective()
        return tables

    def with_values(self, section: str, **values: object) -> MissionFile:
        """Return the mission with some values of one table replaced, checked as a file would be.

        Parameters
        ----------
        section
            Name of the table, such as `simulation`. Of a table that there may be several of
            (`lidar`, `intruder`, `obstacle`, `keep_out`), all are changed.
        **values
            Those of a mission file, numbers and arrays of NumPy too.

        Returns
        -------
        MissionFile
            The changed mission.

        Raises
        ------
        InputError
            Naming every unknown table or key and every wrong value, with what is valid.
        """
        if not isinstance(section, str):
            raise ClearwayError(f"section: the name of a table is needed, got {section!r}")
        given = {key: _plain(value) for key, value in values.items()}
        tables: dict[str, object] = {name: getattr(self, name) for name in self.model_fields_set}
        part = getattr(self, section, None) if section in type(self).model_fields else None
        source = f"mission {self.mission.name!r}"
        if isinstance(part, tuple):
            if not part:
                raise InputError(source, f"{section}: there is none to change")
            tables[section] = tuple(_with(one, given) for one in part)
        else:
            tables[section] = _with(part, given)
        return parse_model(source, tables, type(self))


def _in_short(table: object) -> str:
    """A table of keys in one line; of several tables their number."""
    if not isinstance(table, dict):
        return in_brief(table)
    return ", ".join(f"{key} = {in_brief(value)}" for key, value in table.items())


def _with(section: Section | None, values: dict[str, object]) -> dict[str, object]:
    """The keys of a table that were given, and others over them."""
    return (section.model_dump(exclude_unset=True) if section is not None else {}) | values


def _plain(value: object) -> object:
    """Numbers and arrays of NumPy as Python's own, which alone a file can hold."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


class AbsentPublicFileError(InputError):
    """Public files that a mission names are not there; it says how to get them."""


def read_mission_file(name_or_path: str, notice: Notice | None = None) -> MissionFile:
    """A mission of clearway by name, a mission file, or a flight plan of a ground station.

    notice: called with what was assumed or left out. Raises InputError with every problem of a
    file.
    """
    built_in = list_built_in_missions()
    if name_or_path in built_in:
        with resources.as_file(built_in[name_or_path]) as path:
            return read_model(path, MissionFile)
    path = Path(name_or_path)
    if not os.path.exists(path) and path.suffix not in (".toml", *PLANS):
        names = ", ".join(sorted(built_in))
        near = did_you_mean(name_or_path, [*built_in, *WORLD_FAMILIES]) or file_nearby(path)
        problem = f"no such mission or file{near}; missions by name: {names}; made-up worlds: "
        raise InputError(name_or_path, problem + ", ".join(WORLD_FAMILIES))
    if plan_reader(path) is not None:
        return parse_model(
            str(path), make_planned_tables(path, None, notice), MissionFile, path.parent
        )
    if path.suffix != ".toml":
        refuse_others(path, "fly")
    tables = with_plan(path, read_toml(path), notice)
    mission = parse_model(str(path), tables, MissionFile, path.parent)
    return _with_files_beside(path, mission)


def _with_files_beside(path: Path, mission: MissionFile) -> MissionFile:
    """Files that a mission names are looked for beside its own."""
    _refuse_absent_data(path, mission)
    if mission.point_cloud is not None:
        file = str(at_hand(Path(resolve_beside(path, mission.point_cloud.file))))
        mission = mission.with_values("point_cloud", file=file)
    if mission.map is not None:
        files = tuple(str(at_hand(Path(resolve_beside(path, file)))) for file in mission.map.files)
        mission = mission.with_values("map", files=files)
    if mission.columns is not None and mission.columns.file is not None:
        file = resolve_beside(path, mission.columns.file)
        mission = mission.with_values("columns", file=file)
    if mission.vehicle.automaton is not None:
        file = resolve_beside(path, mission.vehicle.automaton)
        mission = mission.with_values("vehicle", automaton=file)
    if mission.traffic.recording is not None:
        mission = mission.with_values(
            "traffic", recording=resolve_beside(path, mission.traffic.recording)
        )
    return mission


def _refuse_absent_data(path: Path, mission: MissionFile) -> None:
    """Raise AbsentPublicFileError for those that are not there."""
    named = [] if mission.point_cloud is None else [mission.point_cloud.file]
    named += [] if mission.map is None else mission.map.files
    absent = [
        file
        for file in named
        if where_from(file) and not at_hand(Path(resolve_beside(path, file))).exists()
    ]
    if absent:
        raise AbsentPublicFileError(
            str(path), [f"no file {file}{where_from(file)}" for file in absent]
        )


def list_built_in_missions() -> dict[str, Any]:
    """Missions that come with clearway, by name."""
    folder = resources.files("clearway.missions") / "built_in"
    return {
        entry.name.removesuffix(".toml"): entry
        for entry in folder.iterdir()
        if entry.name.endswith(".toml")
    }
