"""The scene file of `clearway assess`: its tables and keys, with defaults, as typed sections."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.avoidance.rate.fusion import RATINGS
from clearway.avoidance.scene import VehicleKind
from clearway.base.units import FASTEST_MPS
from clearway.base.variants import join_choices
from clearway.base.version import SCHEMA_VERSION
from clearway.io.choices import OneOf
from clearway.io.scans.optical import Axes
from clearway.io.toml import Section
from clearway.missions.sections import (
    Attitude,
    GridSection,
    ModelName,
    NotNegative,
    Numbers,
    ObstacleSection,
    Place,
    Point,
    Share,
    state_problems,
    without_version,
)
from clearway.reach.sets import METHODS, tuning_of
from clearway.sensors.cells.detection import RULES
from clearway.traffic import Intruder
from clearway.traffic.models.combined import MODELS
from clearway.traffic.models.timing import TIMED_RULES

Pair = Annotated[tuple[float, float], Field(strict=False)]
Tuning = Annotated[int, Field(ge=1, le=1000)]
TimedRuleName = Annotated[str, OneOf(TIMED_RULES)]


class SceneVehicleSection(Section):
    """`[vehicle]`: the vehicle, and its pose in the world, where the grid is too."""

    kind: VehicleKind | None = None
    """A plane keeps its speed and cannot hover; a multirotor accelerates and brakes; an inertialess
    vehicle changes its speed at once. Default: inertialess where [scan] names a file, else plane.
    Its speed, turns and steepest pitch stand in [reach_set]."""
    position_m: Place | None = None
    """World frame; default: as the recording says, else the origin."""
    attitude_deg: Attitude | None = None
    """Roll, pitch (nose down positive), yaw (left positive); default: as the recording says, else
    level. Where only one of position and attitude is stated, the other is zero."""


Obstacles = Annotated[tuple[ObstacleSection, ...], Field(strict=False)]


class SimulateSection(Section):
    """`[scan.simulate]`: a scan of obstacles by ray casting."""

    obstacles: Annotated[tuple[int, ...], Field(strict=False)] | None = None
    """Which of the map's obstacles are really there, by index from 0."""
    obstacle: Obstacles = ()
    """What is there besides; without both keys, all obstacles of the map are there."""
    beams_per_cell: Annotated[tuple[int, int], Field(strict=False)] = (20, 10)
    """Azimuths and elevations through every column of cells, at angular midpoints."""
    azimuth_deg: Numbers | None = None
    """Left positive; needs `elevation_deg` beside it."""
    elevation_deg: Numbers | None = None
    """Beams at every azimuth and elevation listed, in place of `beams_per_cell`."""
    max_range_m: float | None = Field(default=None, gt=0.0)
    """Default: the grid's range."""
    sigma_m: float = Field(default=0.0, ge=0.0)
    """Standard deviation of the range."""
    dropout: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Share of returns that get lost."""
    seed: int = Field(default=0, ge=0)
    """Of noise and drop-outs."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if (self.azimuth_deg is None) != (self.elevation_deg is None):
            raise ValueError("azimuth_deg and elevation_deg are needed together")
        if self.azimuth_deg is not None and "beams_per_cell" in self.model_fields_set:
            raise ValueError("give beams_per_cell, or azimuth_deg and elevation_deg, not both")
        if self.azimuth_deg == () or self.elevation_deg == ():
            raise ValueError("azimuth_deg and elevation_deg need at least one angle each")
        if min(self.beams_per_cell) < 1:
            raise ValueError(f"beams_per_cell must be at least [1, 1], got {self.beams_per_cell}")
        return self


class ScanSection(Section):
    """`[scan]`: returns of the LiDAR, from a file or simulated."""

    file: str | None = None
    """Point cloud, folder of numbered ones, bag, or Ouster recording in the sensor's frame;
    relative to the scene file."""
    frame: Axes = "auto"
    """Axes of its points. body: x ahead, y left, z up; optical: a camera's, z ahead, x right, y
    down; auto: optical where a bag calls the frame so (`..._optical`, `..._optical_frame`), else
    body."""
    at: int | str | None = None
    """Which scan of several: its number from 0, or "1.5s" after the first; default: the first that
    can be used."""
    topic: str | None = None
    """Of a bag with several topics with points."""
    poses: str | None = None
    """File of the vehicle's poses, or a bag's topic; where [vehicle] states no pose the one at the
    scan's time is taken."""
    pattern: str = "auto"
    """Name of the sensor whose beams these are, or "auto": as the file says, else estimated from
    the points."""
    position_m: Place | None = None
    """Place of the sensor on the vehicle; default: as the bag says, else at its origin."""
    attitude_deg: Attitude | None = None
    """Its roll, pitch (nose down positive), yaw (left positive) on it; zero looks ahead, a camera
    too; default as above."""
    min_range_m: NotNegative | None = None
    """Blind range: nearer returns are dropped; default: the sensor's, as far as it is known."""
    airframe_radius_m: NotNegative = 0.0
    """Returns within this distance of the body's origin come from the own airframe."""
    simulate: SimulateSection | None = None
    """In place of `file`."""

    @model_validator(mode="after")
    def _is_one_of_two(self) -> Self:
        if (self.file is None) == (self.simulate is None):
            raise ValueError("either `file` or [scan.simulate] is needed, and not both")
        if self.simulate is not None and self.model_fields_set - {"simulate"}:
            others = ", ".join(f"`{name}`" for name in sorted(self.model_fields_set - {"simulate"}))
            raise ValueError(f"{others} belong to `file`; [scan.simulate] states its beams itself")
        return self


class IntruderSection(Section):
    """`[[intruder]]`: in the same frame as the obstacles."""

    position_m: Place
    """Where it is at the moment of decision."""
    velocity_mps: Point
    """In the same frame."""
    spread_deg: float | Pair = 0.0
    """Half-angles of the cone of its uncertainty: [horizontal, vertical], or one for both."""
    radius_m: float = 0.0
    """Of its body."""
    models: Annotated[tuple[ModelName, ...], Field(strict=False)] | None = None
    """Default: line, and body with a radius, and spread with a spread."""
    timed: bool | TimedRuleName = False
    """Whether meeting it at the vehicle's time counts; true is the paper's (5.5)."""
    up: Point | None = None
    """World up in the grid's frame; default: as the vehicle's attitude says."""
    name: str = ""
    """For the result."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        state_problems(self.to_intruder)
        if self.models == ():
            raise ValueError(f"models: at least one of {', '.join(MODELS)} is needed")
        if self.up is not None and not any(self.up):
            raise ValueError("up: a direction is needed, got [0, 0, 0]")
        return self

    def to_intruder(self) -> Intruder:
        return Intruder(
            np.array(self.position_m),
            np.array(self.velocity_mps),
            spread_rad=np.radians(self._spread_deg),
            radius_m=self.radius_m,
            name=self.name,
        )

    @property
    def _spread_deg(self) -> tuple[float, float]:
        spread = self.spread_deg
        return spread if isinstance(spread, tuple) else (spread, spread)

    @property
    def chosen_models(self) -> tuple[str, ...]:
        """The models given, or those that the data call for."""
        if self.models is not None:
            return self.models
        body = ("body",) if self.radius_m > 0.0 else ()
        spread = ("spread",) if any(self._spread_deg) else ()
        return ("line", *body, *spread)


class TimingSection(Section):
    """`[vehicle_timing]`: when the vehicle is in which cell."""

    model: Literal["radial", "reach-set"] = "radial"
    """radial: straight away through the layers; reach-set: as its trajectories pass."""
    speed_mps: float | None = Field(default=None, gt=0.0, le=FASTEST_MPS)
    """Default: the reach set's."""


class SceneReachSetSection(Section):
    """`[reach_set]`: the trajectories that are rated."""

    method: Annotated[str, OneOf(METHODS)] = "flying"
    """How trajectories are selected."""
    spread: Tuning | None = None
    """Nodes kept per cell by the methods that it tunes; see [reach-sets.md](reach-sets.md)."""
    harmonic: Tuning | None = None
    """Harmonic nodes kept per cell; see [reach-sets.md](reach-sets.md)."""
    start_pitch_deg: float | None = Field(default=None, ge=-90.0, le=90.0)
    """Nose down positive; default: the start pitch nearest to the vehicle's."""
    speed_mps: float | None = Field(default=None, gt=0.0, le=FASTEST_MPS)
    """Default: one layer a movement of 1 s. Of a multirotor the greatest."""
    turn_step_deg: float = Field(default=15.0, gt=0.0, le=90.0)
    """Turn in one movement; a multirotor turns as its acceleration allows."""
    pitch_limit_deg: float = Field(default=30.0, ge=0.0, le=90.0)
    """Steepest pitch, up and down; a multirotor climbs by 2 m/s and sinks by 1.5."""
    now_mps: float | None = Field(default=None, ge=0.0, le=FASTEST_MPS)
    """Of a multirotor, own speed ahead; default: its greatest."""
    acceleration_mps2: float | None = Field(default=None, gt=0.0)
    """Of a multirotor, greatest acceleration in any direction; default 3."""

    @model_validator(mode="after")
    def _tuning_belongs(self) -> Self:
        for name in self.tuning:
            tuned = [method for method in METHODS if name in tuning_of(method)]
            if self.method not in tuned:
                raise ValueError(f"{name} tunes {join_choices(tuned)}, not {self.method}")
        return self

    @property
    def tuning(self) -> dict[str, float]:
        """Tuning that was given."""
        given = {"spread": self.spread, "harmonic": self.harmonic}
        return {name: float(value) for name, value in given.items() if value is not None}


class SceneRatingSection(Section):
    """`[rating]`: how evidence becomes a rating."""

    name: Annotated[str, OneOf(RATINGS)] = "total"
    """How safe a cell is, by its evidence."""
    unknown: Share = 0.0
    """How far hidden space counts as blocked, u."""
    unknown_unseen: Share = 1.0
    """The same for columns that no beam looks into."""
    detection: Annotated[str, OneOf(RULES)] = "ratio"
    """How hits become P_OD."""
    threshold: Share = 0.3
    """Rating from which a trajectory counts as passable."""
    safety_margin_m: float = Field(default=0.6, ge=0.0)
    """How far `coated` reaches around points and map obstacles."""


class SceneFile(Section):
    """All of a scene file; every table may be left out."""

    grid: GridSection = GridSection()
    vehicle: SceneVehicleSection | None = None
    obstacle: Obstacles = ()
    scan: ScanSection | None = None
    intruder: Annotated[tuple[IntruderSection, ...], Field(strict=False)] = ()
    vehicle_timing: TimingSection = TimingSection()
    reach_set: SceneReachSetSection = SceneReachSetSection()
    rating: SceneRatingSection = SceneRatingSection()

    @model_validator(mode="before")
    @classmethod
    def _check_version(cls, data: Any) -> Any:
        return without_version(data)

    @model_validator(mode="after")
    def _indices_exist(self) -> Self:
        simulate = self.scan.simulate if self.scan else None
        bad = [n for n in (simulate and simulate.obstacles) or () if n not in self._indices]
        if bad:
            valid = f"0 to {len(self.obstacle) - 1}" if self.obstacle else "none, no [[obstacle]]"
            raise ValueError(f"scan.simulate.obstacles: no obstacle {bad}; valid indices: {valid}")
        return self

    @model_validator(mode="after")
    def _speeds_suit_the_kind(self) -> Self:
        if self.vehicle_kind != "multirotor":
            for name in ("now_mps", "acceleration_mps2"):
                if getattr(self.reach_set, name) is not None:
                    raise ValueError(f'reach_set.{name}: only of [vehicle] kind = "multirotor"')
        elif self.reach_set.method != "flying":
            raise ValueError('reach_set.method: a multirotor has "flying" alone')
        return self

    @property
    def vehicle_kind(self) -> VehicleKind:
        """As stated, else one that can stop for a file's scan, else a plane."""
        if self.vehicle is not None and self.vehicle.kind is not None:
            return self.vehicle.kind
        return "inertialess" if self.records_a_flight else "plane"

    @property
    def records_a_flight(self) -> bool:
        """Whether its scan is of a file."""
        return self.scan is not None and self.scan.file is not None

    @property
    def _indices(self) -> range:
        return range(len(self.obstacle))

    def effective(self, folder: Path) -> dict[str, Any]:
        """Tables that assess the same scene again from anywhere, defaults filled in.

        `schema_version` stands before them: of the form that this version writes.
        """
        tables = {"schema_version": SCHEMA_VERSION, **self.model_dump(exclude_none=True)}
        tables["grid"] = self.grid.effective()
        tables["vehicle"] = {**tables.get("vehicle", {}), "kind": self.vehicle_kind}
        if self.scan is not None and self.scan.file is not None:
            tables["scan"]["file"] = str((folder / self.scan.file).absolute())
            poses = self.scan.poses
            if poses is not None and (folder / poses).is_file():
                tables["scan"]["poses"] = str((folder / poses).absolute())
        elif self.scan is not None:
            for key in ("frame", "pattern", "airframe_radius_m"):
                del tables["scan"][key]
            if "azimuth_deg" in tables["scan"]["simulate"]:
                del tables["scan"]["simulate"]["beams_per_cell"]
        return tables
