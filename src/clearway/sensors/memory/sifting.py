"""Rain, dust and the sun: lone returns wait until a second sweep bears them out.

A return that stands alone among its beams, and near nothing that is remembered, is a drop or a thin
thing. One sweep cannot tell which. While sweeps have many such returns, or a sensor declares them,
each waits for a few sweeps; two that agree are a thing. Clusters, and what is remembered, count at
once. So do lone returns within the distance that the vehicle needs to react one sweep later, unless
the sweep before looked through that very place.

What keeps this safe:

- A held return shows nothing to be free. Its beam ends there for range views, and it hides what is
  remembered behind it.
- A drop beyond a thing replaces that thing's return, as if it were lost. A view shows a ball to be
  free only if all beams about it go on, and a thing is forgotten only after two sweeps in a row
  whose beams all go on. So one drop clears only what a single beam meets, and only in one sweep.
- What waits is farther off than the vehicle needs to react, and still is when the next sweep shows
  it; or it stands where the sweep before saw that no thing as wide as beams are apart stands.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from clearway.base.compiled import read_only
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray, State
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.beams.raster import BeamRaster, beam_raster, directions_of
from clearway.sensors.memory.point_memory import NONE_HIDING
from clearway.sensors.memory.remembered import Balls
from clearway.sensors.passing.lone_returns import mark_contradicted, mark_lone, mark_near_any
from clearway.sensors.passing.passed_points import Placed, Sensor, place_returns, sensor_at

WAITS = 2
"""Sweeps for which a lone return waits: what shows in every other one is borne out."""
SAME_THING_BEAMS = 2.0
"""Beam spacings by which two returns of a thing may lie apart that single beams hit."""
NOISE_OF_TWO = 1.5
"""Of the noise of one return, by which two may differ."""
RATE_KEPT = 0.8
"""Of the averages, from sweep to sweep."""
RAINS, DRY = 3e-4, 1e-4
"""Shares of the beams that return alone where the sweep before saw that nothing stands: from the
first on returns wait, until there are fewer than the second."""
POURS = 0.01
"""Share of beams with lone returns, above which an alarm is raised."""


class Lone(NamedTuple):
    """Returns that wait."""

    position_m: FloatArray
    """[k, 3] world frame."""
    sweeps: IntArray
    """[k] sweeps since."""


class Seen(NamedTuple):
    """Where the latest sweep looked, and how far."""

    sensor: Sensor
    nearest_m: FloatArray


class Sifted(NamedTuple):
    """A sweep as memory takes it."""

    scan: Scan
    """What counts."""
    hiding_m: FloatArray
    """[k, 3] returns that wait, sensor frame: they hide what lies behind them, and no more."""


NONE_WAIT = Lone(np.zeros((0, 3)), np.zeros(0, dtype=np.int64))
NO_BALLS = Balls(np.zeros((0, 3)), np.zeros(0))


@dataclass(frozen=True, slots=True, eq=False)
class Sieve:
    """What is known of the lone returns of one LiDAR; `sift` makes the next one."""

    declared: bool = False
    """Whether the sensor declares false returns."""
    is_active: bool = False
    """Whether lone returns wait."""
    since_s: float = np.inf
    """Since when; inf while they do not."""
    alone: float = 0.0
    """Share of the beams that return alone, averaged: with `is_active` an estimate of false ones."""
    contradicted: float = 0.0
    """The same of those that the sweep before contradicts."""
    sweeps: int = 0
    held: int = 0
    """Returns of the latest sweep that wait."""
    waiting: Lone = NONE_WAIT
    at_once: Balls = NO_BALLS
    """Those of the latest sweep that count meanwhile, world frame."""
    seen: Seen | None = None

    @property
    def pours(self) -> bool:
        """Whether so many returns are false that an alarm is due."""
        return self.is_active and self.alone > POURS


def sift(
    sieve: Sieve,
    lidar: Lidar,
    scan: Scan,
    state: State,
    remembered: Balls,
    near_m: float,
    *,
    tolerance_m: float = 0.0,
    reach_m: float = np.inf,
    ground_m: float = -np.inf,
) -> tuple[Sieve, Sifted]:
    """Return what is known after a sweep taken at `state`, and the sweep as memory takes it.

    remembered: what earlier sweeps saw. near_m: what the vehicle needs to react to what it sees at
    the next sweep. tolerance_m: uncertainty of the pose. reach_m, ground_m:
    returns from farther away, at or below this height, and of the airframe are left alone.
    """
    noise = tolerance_m + 3.0 * lidar.sigma_m
    spacing, raster = float(lidar.pattern.spacing_rad), beam_raster(lidar.pattern)
    sensor, directions = sensor_at(lidar, state, noise), directions_of(scan.points_m, raster)
    lone = np.flatnonzero(
        mark_lone(scan.points_m, directions, spacing, NOISE_OF_TWO * noise)
    )
    points = scan.points_m[lone]
    placed = place_returns(read_only(points), sensor, float(reach_m), float(ground_m))
    apart = NOISE_OF_TWO * noise + SAME_THING_BEAMS * spacing * placed.distance_m
    new, borne_out = _news(sieve.waiting, placed, apart, remembered)
    against = _contradicted(sieve.seen, placed.points_m[new], raster)
    share = np.array([len(new), np.count_nonzero(against)]) / lidar.pattern.beams
    sieve = _counted(sieve, *share.tolist(), scan)
    sieve = replace(sieve, seen=Seen(sensor, directions.nearest_m))
    if not sieve.is_active:
        return replace(sieve, held=0, waiting=NONE_WAIT, at_once=NO_BALLS), Sifted(
            scan, NONE_HIDING
        )
    urgent = new[(placed.distance_m[new] <= near_m) & ~against]
    held = lone[placed.source[new]]
    kept = np.ones(len(scan.points_m), dtype=np.bool_)
    kept[held] = False
    counts = replace(scan, points_m=scan.points_m[kept])
    at_once = Balls(placed.points_m[urgent], 0.5 * spacing * placed.distance_m[urgent])
    waiting = _waiting_on(sieve.waiting, borne_out, placed.points_m[new])
    sieve = replace(sieve, held=len(new), waiting=waiting, at_once=at_once)
    return sieve, Sifted(counts, read_only(scan.points_m[held]))


def _news(
    waiting: Lone, placed: Placed, apart: FloatArray, remembered: Balls
) -> tuple[IntArray, BoolArray]:
    """Numbers of the placed returns that nothing bears out, and which of those waiting are borne
    out by one of these."""
    zeros = np.zeros(len(waiting.sweeps))
    places = placed.points_m
    again = mark_near_any(places, apart, waiting.position_m, zeros)
    borne_out = mark_near_any(waiting.position_m, zeros, places, apart)
    fresh = np.flatnonzero(~again)
    known = mark_near_any(places[fresh], apart[fresh], remembered.position_m, remembered.radius_m)
    return fresh[~known], borne_out


def _contradicted(seen: Seen | None, places_m: FloatArray, raster: BeamRaster) -> BoolArray:
    """[n] whether the sweep before looked through places [n, 3]."""
    if seen is None or not len(places_m):
        return np.zeros(len(places_m), dtype=np.bool_)
    return mark_contradicted(places_m, seen.nearest_m, seen.sensor, raster)


def _counted(sieve: Sieve, alone: float, contradicted: float, scan: Scan) -> Sieve:
    """The sieve with its averages after a sweep, and whether returns wait by them."""
    gain = max(1.0 - RATE_KEPT, 1.0 / (sieve.sweeps + 1))
    against = sieve.contradicted + (1.0 - RATE_KEPT) * (contradicted - sieve.contradicted)
    active = sieve.declared or against > (DRY if sieve.is_active else RAINS)
    since_s = np.inf if not active else min(sieve.since_s, scan.time_s)
    return replace(
        sieve,
        is_active=active,
        since_s=since_s,
        alone=sieve.alone + gain * (alone - sieve.alone),
        contradicted=against,
        sweeps=sieve.sweeps + 1,
    )


def _waiting_on(waiting: Lone, borne_out: BoolArray, news_m: FloatArray) -> Lone:
    """What waits after a sweep."""
    sweeps = waiting.sweeps + 1
    stays = ~borne_out & (sweeps < WAITS)
    return Lone(
        np.concatenate([waiting.position_m[stays], news_m]),
        np.concatenate([sweeps[stays], np.zeros(len(news_m), dtype=np.int64)]),
    )
