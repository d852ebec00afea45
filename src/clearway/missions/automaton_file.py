"""The automaton file: a vehicle's movements as they were measured, one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.provenance import provenance
from clearway.io.staging import stage_file
from clearway.io.toml import Section, read_model
from clearway.io.toml_writing import write_toml
from clearway.missions.sections import Count, NotNegative, Positive
from clearway.sim.plants.measuring import MeasuredPlant, MeasureSettings
from clearway.sim.plants.measuring_classes import MeasuredCopter, with_tube
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.copter import CopterLimits
from clearway.vehicle.inertialess import InertialessModel

DIGITS = 5
"""Of metres and radians, far below what any vehicle repeats."""
OF_LIMITS = (
    "speed_mps",
    "acceleration_mps2",
    "climb_mps",
    "sink_mps",
    "yaw_rate_deg_s",
    "lag_s",
)
"""Keys of `[copter]` that say what it can do."""
Row = Annotated[tuple[float, float, float, float], Field(strict=False)]
Name = Annotated[str, Field(min_length=1, max_length=60)]


class AboutSection(Section):
    """`[automaton]`: what was measured, and how."""

    plant: str
    """By name, or `module:name`."""
    made_by: str = ""
    seed: int = 0
    flights: Count = 1
    held_out: Count = 1
    wind_mps: Annotated[tuple[float, float, float], Field(strict=False)] = (0.0, 0.0, 0.0)
    gusts_mps: NotNegative = 0.0
    first: str = Field(default="", max_length=60)
    """What counts as flown before a flight begins."""
    tube_m: Annotated[tuple[NotNegative, ...], Field(strict=False)] = ()
    """Per number of movements since the own state estimate was known: within how far of its
    prediction the vehicle was 999 times of 1,000."""
    error_p95_m: Annotated[tuple[NotNegative, ...], Field(strict=False)] = ()
    """The same 19 times of 20, on flights that did not make the table."""
    closed_form_p95_m: Annotated[tuple[NotNegative, ...], Field(strict=False)] = ()
    """And that by the closed form of the movements."""


class MovementSection(Section):
    """`[[movement]]`: what the plant's loops are asked to hold."""

    name: Name
    speed_mps: NotNegative
    climb_mps: float = 0.0
    yaw_rate_deg_s: float = 0.0
    duration_s: Positive
    smooth: bool = False


class PairSection(Section):
    """`[[pair]]`: one movement after another."""

    previous: Name
    movement: Name
    path: Annotated[tuple[Row, ...], Field(min_length=1, strict=False)]
    """x, y, z (m) and yaw (rad) from its start, along the heading there, at equal times."""
    spread_m: NotNegative = 0.0
    """Standard deviation of its end."""
    spread_yaw_rad: NotNegative | None = None
    """And of its yaw there."""


class CopterSection(Section):
    """`[copter]`: a copter with inertia, and within how far of its plan it was, by its speed."""

    speed_mps: Positive
    acceleration_mps2: Positive
    climb_mps: NotNegative
    sink_mps: NotNegative
    yaw_rate_deg_s: Positive
    lag_s: NotNegative
    speeds_mps: Annotated[tuple[NotNegative, ...], Field(min_length=1, strict=False)]
    """Ascending."""
    tube_m: Annotated[tuple[NotNegative, ...], Field(min_length=1, strict=False)]
    """Per speed, within how far of its plan the vehicle was 99 times of 100."""
    inside: Annotated[tuple[NotNegative, ...], Field(strict=False)] = ()
    """Per speed, the share that was within it on flights that did not make it."""

    def to_automaton(self, gusts_mps: float) -> MovementAutomaton:
        """The automaton with its tube; raises ClearwayError for tubes that do not fit speeds."""
        if len(self.tube_m) != len(self.speeds_mps):
            raise ClearwayError("copter: tube_m and speeds_mps must be of one length")
        limits = CopterLimits(**{key: getattr(self, key) for key in OF_LIMITS}, gusts_mps=gusts_mps)
        asked = MovementAutomaton.of_copter(limits)
        return with_tube(asked, np.array(self.speeds_mps), np.array(self.tube_m))


class AutomatonFile(Section):
    """All of an automaton file: movements and their pairs, or a copter with inertia."""

    automaton: AboutSection
    movement: Annotated[tuple[MovementSection, ...], Field(strict=False)] = ()
    pair: Annotated[tuple[PairSection, ...], Field(strict=False)] = ()
    copter: CopterSection | None = None

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if self.copter is None and not (self.movement and self.pair):
            raise ValueError("must hold [[movement]] and [[pair]], or [copter]")
        if self.copter is not None and (self.movement or self.pair):
            raise ValueError("copter: its movements follow from it; [[movement]] is one too many")
        try:
            self.to_automaton()
        except ClearwayError as error:
            raise ValueError(str(error)) from error
        return self

    def to_automaton(self) -> MovementAutomaton:
        """The automaton with its table; raises ClearwayError where they do not belong together."""
        if self.copter is not None:
            return self.copter.to_automaton(self.automaton.gusts_mps)
        movements = tuple(
            Movement(
                one.name,
                one.speed_mps,
                yaw_rate_rps=float(np.radians(one.yaw_rate_deg_s)),
                duration_s=one.duration_s,
                smooth=one.smooth,
                climb_mps=one.climb_mps,
            )
            for one in self.movement
        )
        table = ClassTable.of_pairs(
            tuple(one.name for one in self.movement),
            {(one.previous, one.movement): np.array(one.path, np.float64) for one in self.pair},
            self.automaton.first,
            self.automaton.tube_m,
        )
        return MovementAutomaton(
            movements, 0.0, vehicle=InertialessModel(), table=table, forbidden=table.forbidden
        )


def read_automaton(path: str | Path) -> MovementAutomaton:
    """The measured automaton of a file; raises InputError with every problem of it."""
    return read_model(path, AutomatonFile).to_automaton()


def _about(plant: str, settings: MeasureSettings, **found: Any) -> AboutSection:
    return AboutSection(
        plant=plant,
        made_by=f"clearway {provenance()['clearway']}",
        seed=settings.seed,
        flights=settings.flights,
        held_out=settings.held_out,
        wind_mps=settings.wind_mps,
        gusts_mps=settings.gusts_mps,
        **found,
    )


def copter_file(
    plant: str, limits: CopterLimits, measured: MeasuredCopter, settings: MeasureSettings
) -> AutomatonFile:
    """What measuring a copter with inertia gave, as a file."""
    copter = CopterSection(
        **{key: getattr(limits, key) for key in OF_LIMITS},
        speeds_mps=_round_all(measured.speeds_mps),
        tube_m=_round_all(np.ceil(measured.tube_m * 1e3) / 1e3),
        inside=_round_all(measured.inside),
    )
    return AutomatonFile(automaton=_about(plant, settings), copter=copter)


def automaton_file(plant: str, measured: MeasuredPlant, settings: MeasureSettings) -> AutomatonFile:
    """What measuring gave, as a file."""
    table = measured.automaton.classes
    assert table is not None  # Measuring makes one.
    found = measured.pairs
    about = _about(
        plant,
        settings,
        first=found.first,
        tube_m=_round_all(table.tube_m),
        error_p95_m=_p95(measured.error_m),
        closed_form_p95_m=_p95(measured.closed_form_m),
    )
    movements = tuple(
        MovementSection(
            name=m.name,
            speed_mps=m.speed_mps,
            climb_mps=m.climb_mps or 0.0,
            yaw_rate_deg_s=float(np.degrees(m.yaw_rate_rps)),
            duration_s=m.duration_s,
            smooth=m.smooth,
        )
        for m in measured.automaton.movements
    )
    pairs = tuple(
        PairSection(
            previous=previous,
            movement=name,
            # Whole digits of what circles or stands: it must do so exactly.
            path=_rows(path if previous == name else np.round(path, DIGITS)),
            spread_m=round(found.spread_m.get((previous, name), 0.0), 6),
            spread_yaw_rad=round(found.spread_yaw_rad.get((previous, name), 0.0), 6),
        )
        for (previous, name), path in found.paths.items()
    )
    return AutomatonFile(automaton=about, movement=movements, pair=pairs)


def write_automaton(file: AutomatonFile, path: str | Path) -> None:
    """Write an automaton file; raises InputError where that cannot be done."""
    with stage_file(path) as scratch:
        write_toml(file, scratch)


def _rows(path: FloatArray) -> tuple[Row, ...]:
    return tuple((float(x), float(y), float(z), float(a)) for x, y, z, a in path)


def _p95(errors: Sequence[FloatArray]) -> tuple[float, ...]:
    return _round_all([float(np.quantile(each, 0.95)) for each in errors])


def _round_all(values: object) -> tuple[float, ...]:
    return tuple(round(float(value), 6) for value in np.atleast_1d(np.array(values)))
