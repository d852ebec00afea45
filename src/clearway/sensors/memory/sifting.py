"""Rain, dust and the sun: lone returns wait until a second sweep bears them out.

A return that stands alone among its beams, and near nothing that is remembered, is a drop or a thin
thing. One sweep cannot tell which. While sweeps have many such returns, or a sensor declares them,
each waits for a few sweeps; two that agree are a thing. Clusters, and what is remembered, count at
once. So do lone returns within the distance that the vehicle needs to react one sweep later, unless
the sweep before looked through that very place.

What keeps this safe:

- A held return shows nothing to be free. Its beam ends there for range views, and it hides what is
  remembered behind it. Only once the next sweep has looked through its place does it count as lost.
- A drop beyond a thing replaces that thing's return, as if it were lost. A view shows a ball to be
  free only if all beams about it go on, and a thing is forgotten only after two sweeps in a row
  whose beams all go on. So one drop clears only what a single beam meets, and only in one sweep.
- A lone return so near that a thing one centimetre thick would meet several beams is none of such a
  thing; only clusters count there.
- What waits is farther off than the vehicle needs to react, and still is when the next sweep shows
  it; or it stands where the sweep before saw that no thing as wide as beams are apart stands; or
  where a flight with `strict` escapes does not go, since no view shows the place to be free.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from clearway.base.compiled import read_only
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray, State
from clearway.sensors.beams.binning import TINY
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.beams.raster import BeamRaster, beam_raster, directions_of
from clearway.sensors.memory.doubt import THINNEST_M
from clearway.sensors.memory.point_memory import NONE_HIDING
from clearway.sensors.memory.remembered import Balls
from clearway.sensors.passing.lone_returns import (
    OnBeams,
    mark_lone,
    mark_near_any,
    mark_same,
)
from clearway.sensors.passing.passed_points import (
    Sensor,
    find_passed_through,
    place_returns,
    sensor_at,
)

WAITS = 2
"""Sweeps for which a lone return waits: what shows in every other one is borne out."""
SAME_THING_BEAMS = 2.0
"""Beam spacings by which two returns of a thing may lie apart that single beams hit."""
NOISE_OF_TWO = 1.25
"""Of the noise of one return, three standard deviations, by which two may differ."""
NEVER_M = -1e9
"""How far to the side another return may lie of what is none."""
RATE_KEPT = 0.8
"""Of the averages, from sweep to sweep."""
RAINS = 3e-4
DRY = 1e-4
"""Shares of the beams that return alone where the sweep before saw that nothing stands: from the
first on returns wait, until there are fewer than the second."""
SURE_SWEEPS = 5
"""After so many the estimate counts."""


class Lone(NamedTuple):
    """Returns that wait."""

    returns: OnBeams
    """[k] world frame."""
    sweeps: IntArray
    """[k] sweeps since, ascending from the end."""


class SweepBefore(NamedTuple):
    """The latest sweep, and where it looked how far."""

    sensor: Sensor
    nearest_m: FloatArray
    scan: Scan
    held: IntArray
    """Numbers of its returns that wait."""


class Sifted(NamedTuple):
    """A sweep as memory takes it."""

    scan: Scan
    """What counts."""
    hiding_m: FloatArray
    """[k, 3] returns that wait, sensor frame: they hide what lies behind them, and no more."""
    before: Scan | None = None
    """The sweep before without returns through whose place this one has looked; None where it is as
    it was."""


NO_RETURNS = NONE_HIDING
NONE_WAIT = Lone(OnBeams(NO_RETURNS, NO_RETURNS, np.zeros(0)), np.zeros(0, dtype=np.int64))
NO_BALLS = Balls(NO_RETURNS, np.zeros(0))


@dataclass(frozen=True, slots=True, eq=False)
class RainSieve:
    """What is known of the lone returns of one LiDAR; `sift` makes the next one."""

    declared: bool = False
    """Whether the sensor declares false returns."""
    is_active: bool = False
    """Whether lone returns wait."""
    since_s: float = np.inf
    """Since when; inf while they do not."""
    alone: float = 0.0
    """Share of the beams with lone returns that nothing bears out, averaged since then: an estimate
    of the false ones."""
    contradicted: float = 0.0
    """Share of the beams with those that the sweep before contradicts, averaged."""
    sweeps: int = 0
    """Since then."""
    held: int = 0
    """Returns of the latest sweep that wait."""
    waiting: Lone = NONE_WAIT
    at_once: Balls = NO_BALLS
    """Those of the latest sweep that count meanwhile, world frame."""
    looked: SweepBefore | None = None

    @property
    def share(self) -> float:
        """Estimated share of beams with false returns; 0 while none wait, and at first."""
        return self.alone if self.is_active and self.sweeps >= SURE_SWEEPS else 0.0


def sift(
    sieve: RainSieve,
    lidar: Lidar,
    scan: Scan,
    state: State,
    remembered: Balls,
    near_m: float,
    *,
    tolerance_m: float = 0.0,
    reach_m: float = np.inf,
    ground_m: float = -np.inf,
) -> tuple[RainSieve, Sifted]:
    """Return what is known after a sweep taken at `state`, and the sweep as memory takes it.

    remembered: what earlier sweeps saw. near_m: what the vehicle needs to react to what it sees at
    the next sweep. tolerance_m: uncertainty of the pose. reach_m, ground_m: returns from farther
    away, at or below this height, and of the airframe are left alone.
    """
    noise = tolerance_m + 3.0 * lidar.sigma_m
    spacing, raster = float(lidar.pattern.spacing_rad), beam_raster(lidar.pattern)
    sensor, directions = sensor_at(lidar, state, noise), directions_of(scan.points_m, raster)
    noise *= NOISE_OF_TWO
    lone = np.flatnonzero(mark_lone(scan.points_m, directions, spacing, noise))
    points = read_only(scan.points_m[lone])
    placed = place_returns(points, sensor, float(reach_m), float(ground_m))
    apart_m = spacing * placed.distance_m
    wide_m = np.where(apart_m < THINNEST_M, NEVER_M, 0.5 * SAME_THING_BEAMS * apart_m)
    toward = (placed.points_m - sensor.origin) / np.maximum(placed.distance_m, TINY)[:, None]
    returns = OnBeams(placed.points_m, read_only(toward), wide_m)
    again, borne_out = mark_same(returns, sieve.waiting.returns, noise)
    against = _find_contradicted(sieve.looked, placed.points_m, raster)
    # While nothing waits, only what is contradicted counts.
    asked = np.flatnonzero(~again if sieve.is_active or sieve.declared else against)
    balls = read_only(remembered.position_m), read_only(remembered.radius_m)
    known = mark_near_any(placed.points_m[asked], SAME_THING_BEAMS * apart_m[asked] + noise, *balls)
    new = asked[~known]
    share = len(new) / lidar.pattern.beams, np.count_nonzero(against[new]) / lidar.pattern.beams
    sieve = _count(sieve, *share, scan)
    looked = SweepBefore(sensor, directions.nearest_m, scan, lone[placed.source[new]])
    if not sieve.is_active:
        sieve = replace(sieve, held=0, waiting=NONE_WAIT, at_once=NO_BALLS)
        return replace(sieve, looked=looked._replace(held=looked.held[:0])), Sifted(
            scan, NO_RETURNS
        )
    before = _correct(sieve, borne_out, looked, raster)
    urgent = new[(placed.distance_m[new] <= near_m) & ~against[new]]
    kept = np.ones(len(scan.points_m), dtype=np.bool_)
    kept[looked.held] = False
    at_once = Balls(placed.points_m[urgent], 0.5 * apart_m[urgent])
    waiting = _waiting_on(sieve.waiting, borne_out, _pick(returns, new))
    sieve = replace(sieve, held=len(new), waiting=waiting, at_once=at_once, looked=looked)
    counts = replace(scan, points_m=scan.points_m[kept])
    return sieve, Sifted(counts, read_only(scan.points_m[looked.held]), before)


def _find_contradicted(
    looked: SweepBefore | None, places_m: FloatArray, raster: BeamRaster
) -> BoolArray:
    """[n] whether a sweep looked through places [n, 3]."""
    if looked is None or not len(places_m):
        return np.zeros(len(places_m), dtype=np.bool_)
    whatever_size = read_only(np.full(len(places_m), np.inf))
    return find_passed_through(
        read_only(places_m), whatever_size, looked.nearest_m, looked.sensor, raster
    )


def _count(sieve: RainSieve, alone: float, contradicted: float, scan: Scan) -> RainSieve:
    """The sieve with its averages after a sweep, and whether returns wait by them."""
    against = sieve.contradicted + (1.0 - RATE_KEPT) * (contradicted - sieve.contradicted)
    if not (sieve.declared or against > (DRY if sieve.is_active else RAINS)):
        return replace(
            sieve, is_active=False, since_s=np.inf, alone=0.0, sweeps=0, contradicted=against
        )
    gain = max(1.0 - RATE_KEPT, 1.0 / (sieve.sweeps + 1))
    return replace(
        sieve,
        is_active=True,
        since_s=min(sieve.since_s, scan.time_s),
        alone=sieve.alone + gain * (alone - sieve.alone),
        contradicted=against,
        sweeps=sieve.sweeps + 1,
    )


def _correct(
    sieve: RainSieve, borne_out: BoolArray, now: SweepBefore, raster: BeamRaster
) -> Scan | None:
    """The sweep before without returns that nothing bears out, and through whose place beams have
    gone on now."""
    before = sieve.looked
    if before is None or not len(before.held):
        return None
    latest = slice(len(borne_out) - len(before.held), None)
    places = sieve.waiting.returns.position_m[latest]
    false = before.held[~borne_out[latest] & _find_contradicted(now, places, raster)]
    return replace(before.scan, points_m=np.delete(before.scan.points_m, false, axis=0))


def _pick(returns: OnBeams, which: IntArray | BoolArray) -> OnBeams:
    return OnBeams(*(column[which] for column in returns))


def _waiting_on(waiting: Lone, borne_out: BoolArray, news: OnBeams) -> Lone:
    """What waits after a sweep, the latest last."""
    sweeps = waiting.sweeps + 1
    stays = ~borne_out & (sweeps < WAITS)
    columns = zip(_pick(waiting.returns, stays), news, strict=True)
    fresh = np.zeros(len(news.wide_m), dtype=np.int64)
    return Lone(
        OnBeams(*(np.concatenate(both) for both in columns)),
        np.concatenate([sweeps[stays], fresh]),
    )
