"""Faults of flights and places that turn them into crashes, drawn at random; lengths are tenths of
what the sensor promises to see, `unit`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from crash_flights import KEPT_MARGINS, Craft, Fault

CAUSES = (
    "unseen",
    "seen late",
    "sensor dead",
    "wrong map",
    "undeclared wind",
    "late decision",
    "no escape",
)
NO_FAULT = Fault()


@dataclass(frozen=True)
class Shape:
    """A ball, or a box that stands, in the frame of the start: x ahead."""

    x: float
    y: float
    long: float
    wide: float
    tall: float
    turned_rad: float = 0.0
    up: float = 0.0
    ball: bool = False


@dataclass(frozen=True)
class Case:
    """One flight to be made: with its fault, and without."""

    cause: str
    craft: Craft
    danger: Shape
    others: tuple[Shape, ...]
    fault: Fault = NO_FAULT
    charted: tuple[Shape, ...] = ()
    by_map: bool = False
    complete: bool = False
    """Whether the map is declared complete."""
    decides_s: float = 0.5
    scans_hz: float = 5.0
    heading_rad: float = 0.0
    origin_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ahead_m: float = 60.0


def _pillar(rng: Any, x: float, y: float, wide: float, unit: float) -> Shape:
    return Shape(x, y, wide, wide, 30.0 * unit, float(rng.uniform(0.0, np.pi)))


def _beside(rng: Any, x: float, unit: float, most: int = 5) -> tuple[Shape, ...]:
    """Things to both sides that keep the sensor busy."""
    found = []
    for _ in range(int(rng.integers(2, most + 1))):
        wide = float(rng.uniform(0.5, 1.6)) * unit
        side = float(rng.choice([-1.0, 1.0])) * float(rng.uniform(3.2, 7.0)) * unit
        along = float(rng.uniform(3.0 * unit, x + 5.0 * unit))
        found.append(_pillar(rng, along, side, wide, unit))
    return tuple(found)


def _ahead(rng: Any, unit: float, wide: tuple[float, float]) -> tuple[Shape, tuple[Shape, ...]]:
    """Something in the way, and others beside it."""
    x, y = float(rng.uniform(14.0, 24.0)) * unit, float(rng.uniform(-0.4, 0.4)) * unit
    across = float(rng.uniform(*wide)) * unit
    others = _beside(rng, x, unit)
    kind = str(rng.choice(["pillar", "wall", "ball"]))
    if kind == "ball":
        return Shape(x, y, across, across, across, ball=True), others
    if kind == "wall":
        thick, turned = 0.4 * unit, float(rng.uniform(-0.5, 0.5))
        return Shape(x, y, thick, across, 30.0 * unit, turned), others
    return _pillar(rng, x, y, across, unit), others


def _unseen(rng: Any, craft: Craft, unit: float) -> Case:
    danger, others = _ahead(rng, unit, (0.6, 3.0))
    kinds = ["blind", "glass", "sideways"] if craft.stops else ["blind", "glass"]
    kind = str(rng.choice(kinds))
    fault = Fault(danger_shows_m=0.0)
    if kind == "blind":
        fault = Fault(blind_rad=float(np.radians(rng.uniform(15.0, 44.0))))
    elif kind == "sideways":
        fault = Fault(nose_rad=float(rng.choice([-1.0, 1.0]) * rng.uniform(1.4, np.pi)))
    return Case("unseen", craft, danger, others, fault)


def _seen_late(rng: Any, craft: Craft, unit: float) -> Case:
    danger, others = _ahead(rng, unit, (1.0, 7.0))
    shows = float(rng.uniform(0.8, 5.0)) * unit
    fault = Fault(farthest_m=shows) if rng.random() < 0.5 else Fault(danger_shows_m=shows)
    return Case("seen late", craft, danger, others, fault)


def _sensor_dead(rng: Any, craft: Craft, unit: float) -> Case:
    danger, others = _ahead(rng, unit, (0.8, 4.0))
    seen_s = (danger.x - 10.0 * unit - danger.wide) / craft.speed_mps
    dead_s = seen_s * float(rng.uniform(0.3, 1.0))
    return Case("sensor dead", craft, danger, others, Fault(dead_s=dead_s))


def _wrong_map(rng: Any, craft: Craft, unit: float) -> Case:
    danger, others = _ahead(rng, unit, (0.8, 4.0))
    if rng.random() < 0.4:
        return Case("wrong map", craft, danger, others, charted=others, by_map=True, complete=True)
    angle, far = float(rng.uniform(-np.pi, np.pi)), float(rng.uniform(1.0, 4.0)) * unit
    x, y = far * np.cos(angle), far * np.sin(angle)
    charted = tuple(replace(one, x=one.x + x, y=one.y + y) for one in (danger, *others))
    return Case("wrong map", craft, danger, others, charted=charted, by_map=True)


def _wind(rng: Any, craft: Craft, unit: float) -> Case:
    """A plane that plans seldom passes something in still air, and is blown into it."""
    side, x = float(rng.choice([-1.0, 1.0])), float(rng.uniform(12.0, 24.0)) * unit
    wide = float(rng.uniform(1.0, 3.0)) * unit
    y = side * (0.5 * wide + KEPT_MARGINS * craft.margin_m + float(rng.uniform(0.1, 0.8)) * unit)
    danger = Shape(x, y, wide, wide, 30.0 * unit)
    others = tuple(one for one in _beside(rng, x, unit) if one.y * side < 0.0)
    strength = float(rng.uniform(0.1, 0.35)) * craft.speed_mps
    # Wherever the flight leads, it blows across, more or less.
    angle = side * float(rng.uniform(0.3 * np.pi, 0.7 * np.pi))
    wind = (strength * np.cos(angle), strength * np.sin(angle), 0.0)
    return Case("undeclared wind", craft, danger, others, Fault(wind_mps=wind), decides_s=8.0)


def _late(rng: Any, craft: Craft, unit: float) -> Case:
    danger, others = _ahead(rng, unit, (1.0, 5.0))
    there_s = (danger.x - 0.5 * danger.wide) / craft.speed_mps
    until = np.inf
    if rng.random() < 0.5:
        until = there_s - float(rng.uniform(0.0, 2.0)) * unit / craft.speed_mps
    begin = (danger.x - 12.0 * unit - danger.wide) / craft.speed_mps
    return Case("late decision", craft, danger, others, Fault(frozen_s=(begin, until)))


def _no_escape(rng: Any, craft: Craft, unit: float) -> Case:
    """A corridor with floor and ceiling that is closed at its end, too narrow to turn in."""
    half, long = float(rng.uniform(1.8, 2.6)) * unit, float(rng.uniform(20.0, 32.0)) * unit
    high, begin = float(rng.uniform(2.0, 2.8)) * unit, -6.0 * unit
    middle, length = 0.5 * (long + begin), long - begin
    thick = 0.4 * unit
    walls = [
        Shape(middle, side * (half + 0.5 * thick), length, thick, 2.0 * high + 2.0 * thick)
        for side in (-1.0, 1.0)
    ]
    walls += [
        Shape(middle, 0.0, length, 2.0 * half + 2.0 * thick, thick, up=side * (high + 0.5 * thick))
        for side in (-1.0, 1.0)
    ]
    end = Shape(long, 0.0, thick, 2.0 * half + 2.0 * thick, 2.0 * high + 2.0 * thick)
    return Case("no escape", craft, end, tuple(walls))


DRAW = {
    "unseen": _unseen,
    "seen late": _seen_late,
    "sensor dead": _sensor_dead,
    "wrong map": _wrong_map,
    "undeclared wind": _wind,
    "late decision": _late,
    "no escape": _no_escape,
}
