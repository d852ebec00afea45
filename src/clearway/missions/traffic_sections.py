"""`[traffic]` and `[[intruder]]` of a mission file: who else flies, and how it is known."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.io.choices import OneOf
from clearway.io.toml import Section
from clearway.missions.sections import (
    ModelName,
    NotNegative,
    Point,
    Positive,
    state_problems,
    values_for,
)
from clearway.sim.scripted import ScriptedIntruder, Spawn, TrafficSettings
from clearway.traffic import Intruder, TrackerSettings
from clearway.traffic.recorded.aircraft import LONGEST_GAP_S
from clearway.traffic.volumes import VOLUME_SETS

COAST_S = 30.0
"""How long an aircraft of a recording is believed to fly on without a report."""


class TrafficSection(Section):
    """`[traffic]`: how intruders appear, are known, and are counted in the grid."""

    spawn: Spawn = "nominal"
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
    follow_movers: bool | None = None
    """Count what moves and is seen by LiDAR alone as intruders too; default: if some intruder has
    no transponder."""
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

    volumes: Annotated[str | None, OneOf(VOLUME_SETS)] = None
    """Volumes about other aircraft to alert on, in every decision's record; see
    [volumes.md](volumes.md). Your own as `[[volume]]` tables."""
    keep_volumes: bool = False
    """Decide by those volumes too: paths that lead into them within a minute come last, the worst
    into the innermost one, and the risk of being inside has a cost."""

    def to_settings(self) -> TrafficSettings:
        return TrafficSettings(**values_for(TrafficSettings, self))

    def to_tracker(self) -> TrackerSettings | None:
        """Recordings hold fewer reports than a receiver hears, so silence means less there."""
        if not self.tracker:
            return None
        if self.recording is None:
            return TrackerSettings()
        return TrackerSettings(stale_s=LONGEST_GAP_S, coast_s=COAST_S)


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
        state_problems(self._report)
        if self.seen_by_lidar and self.radius_m == 0.0:
            raise ValueError("a LiDAR sees it as a ball, so radius_m must be above 0")
        return self

    @property
    def seen_by_lidar(self) -> bool:
        """Whether a LiDAR sees it, said or by default."""
        return not self.transponder if self.visible is None else self.visible

    def to_scripted(self, spawn: Spawn) -> ScriptedIntruder:
        """spawn: what the numbers are relative to."""
        return ScriptedIntruder(
            self.name,
            self.appears_s,
            np.array(self.position_m),
            np.array(self.velocity_mps),
            np.radians(self.spread_deg),
            self.radius_m,
            spawn,
            self.transponder,
            self.seen_by_lidar,
        )

    def _report(self) -> Intruder:
        return Intruder(
            np.array(self.position_m),
            np.array(self.velocity_mps),
            spread_rad=np.radians(self.spread_deg),
            radius_m=self.radius_m,
            name=self.name,
        )
