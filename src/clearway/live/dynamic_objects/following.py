"""What moves and is seen by LiDAR alone: bodies followed from scan to scan, and their motion.

The visible part of what stands still changes as the vehicle flies, so a cluster that seems to move
proves nothing. Beams do: a body has moved if it is now where beams passed before, or if beams now
pass where it was. What stands still does neither, whatever its apparent speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.dynamic_objects.motion import FittedMotion, fit_motion
from clearway.sensors import Lidar, PointMemory, Scan
from clearway.sensors.memory.point_memory import forget_moved
from clearway.sensors.passing.sightings import (
    BeamFrame,
    Sighting,
    is_passed,
    place_beams,
    share_passed,
    sight_bodies,
)
from clearway.traffic import Intruder

CONSISTENT = 2.0
STILL_CONSISTENT = 9.0
"""Mean square of the residuals, in variances, up to which a straight track is believed: of what may
be a dynamic object, and of one that is known and may turn."""
AS_WIDE = 0.75
"""Share of its greatest width that one must show last: gaps in foliage make bodies of parts."""
CERTAIN = 3.0
"""Standard deviations of its velocity by which a dynamic object must be in motion."""
TURNED = 0.5
"""Share of what it flew since that one may be off: it may have turned by 30 degrees."""
PASSES_TO_END = 2
"""Scans in a row that look through the place of a dynamic object before it is given up."""


@dataclass(frozen=True, slots=True)
class DynamicObjectSettings:
    """What counts as a body in motion."""

    gap_m: float
    """Returns closer than this belong together."""
    largest_m: float
    """Half width of the largest body that is followed."""
    slowest_mps: float
    """Slower bodies stand still as far as avoidance is concerned: every scan shows them anew."""
    fastest_mps: float
    """How far off the next scan looks for a body."""
    returns: int = 5
    """Fewest returns of a body."""
    scans: int = 2
    """Fewest scans that must show it: what moves proves so by beams, not by its track."""
    share: float = 0.6
    """Share of its returns that beams must prove moved."""
    window_s: float = 4.0
    """Its motion is taken from the sightings of this time."""
    coast_s: float = 10.0
    """How long a dynamic object out of sight is believed in."""
    lost_s: float = 2.5
    """How long anything else is."""

    @classmethod
    def of(cls, margin_m: float, speed_mps: float, decides_s: float = 1.0) -> Self:
        """For a vehicle that keeps a margin at a speed, and decides so often.

        A slower body is hardly farther at the next decision than where the last scan showed it:
        less than half a margin, and a quarter of what the vehicle flies.
        """
        slowest_mps = min(0.25 * speed_mps, 0.5 * margin_m / decides_s)
        return cls(0.5 * margin_m, 4.0 * margin_m, slowest_mps, 3.0 * speed_mps)


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A cluster followed over scans; a dynamic object once it has a motion."""

    sightings: tuple[Sighting, ...]
    """Newest last."""
    since_s: float
    """First sighting of all."""
    motion: FittedMotion | None = None
    number: int = 0
    """Of a dynamic object, counting up from 1."""
    passed: int = 0
    """Scans in a row that looked through the place where it should be."""

    def expect_m(self, time_s: float) -> FloatArray:
        """[3] where its centre should be at a time."""
        if self.motion is not None:
            return self.motion.at(time_s)
        *_, last = self.sightings
        center = last.center_m(last.half_width_m)
        if len(self.sightings) < 2:
            return center
        before = self.sightings[-2]
        span = last.time_s - before.time_s
        share = (time_s - last.time_s) / span if span > 0.0 else 0.0
        return center + share * (center - before.center_m(before.half_width_m))

    def gate_m(self, time_s: float, settings: DynamicObjectSettings) -> float:
        """How far from there it may be found: what moves may turn, anything else may move off."""
        motion = self.motion
        if motion is None:
            return settings.gap_m + settings.fastest_mps * (time_s - self.sightings[-1].time_s)
        elapsed = time_s - motion.time_s
        unsure = motion.position_std_m + motion.velocity_std_mps * elapsed
        turned = TURNED * motion.speed_mps * elapsed
        return settings.gap_m + CERTAIN * unsure + turned


@dataclass(frozen=True, slots=True, eq=False)
class Following:
    """All bodies that are followed."""

    settings: DynamicObjectSettings
    bodies: tuple[Body, ...] = ()
    begun: int = 0
    """Dynamic objects so far."""

    def intruders(self) -> list[Intruder]:
        """The dynamic_objects as intruders, world frame, each at the time of its last sighting."""
        return [body.motion.intruder(f"lidar-{body.number}") for body in self.bodies if body.motion]


def follow(
    following: Following,
    lidar: Lidar,
    scan: Scan,
    state: State,
    *,
    sigmas: float = 3.0,
    ground_m: float = -np.inf,
) -> Following:
    """Bodies after a scan taken at `state`: seen again, new, in motion, or gone.

    sigmas: standard deviations of range and own position by which beams must pass what they prove
    gone. ground_m: returns at or below this height of the world frame are ground.
    """
    settings = following.settings
    frame = place_beams(lidar, scan, state, sigmas)
    sightings = sight_bodies(
        frame,
        lidar,
        scan,
        state,
        gap_m=settings.gap_m,
        largest_m=settings.largest_m,
        returns=settings.returns,
        ground_m=ground_m,
    )
    again = _assign(following.bodies, sightings, scan.time_s, settings)
    bodies, begun = [], following.begun
    for number, body in enumerate(following.bodies):
        if number not in again:
            bodies += _out_of_sight(body, frame, settings)
            continue
        seen = _see_again(body, sightings[again[number]], settings)
        if seen.motion is not None and seen.number == 0:
            begun += 1
            seen = replace(seen, number=begun)
        bodies.append(seen)
    known = set(again.values())
    new = [Body((s,), s.time_s) for n, s in enumerate(sightings) if n not in known]
    return Following(settings, (*bodies, *new), begun)


def forget_dynamic_objects(memory: PointMemory, following: Following) -> PointMemory:
    """Memory without what dynamic objects returned, now and before they were known to be any."""
    settings = following.settings
    for body in following.bodies:
        if body.motion is not None:
            motion = body.motion
            spare = CERTAIN * motion.position_std_m + memory.voxel_m
            memory = forget_moved(
                memory,
                motion.position_m,
                motion.velocity_mps,
                motion.time_s,
                motion.radius_m + spare,
                max(body.since_s, motion.time_s - settings.window_s) - settings.lost_s,
            )
    return memory


def find_unreported(
    dynamic_objects: Sequence[Intruder], reported: Sequence[Intruder]
) -> list[Intruder]:
    """Those that no reported intruder accounts for, by place at their own time."""

    def accounts(report: Intruder, moving: Intruder) -> bool:
        there = report.at(moving.time_s)
        apart = np.linalg.norm(there.position_m - moving.position_m)
        spare = CERTAIN * np.hypot(there.position_std_m, moving.position_std_m)
        return bool(apart <= max(report.radius_m, moving.radius_m) + spare)

    return [
        moving
        for moving in dynamic_objects
        if not any(accounts(report, moving) for report in reported)
    ]


def _assign(
    bodies: Sequence[Body],
    sightings: Sequence[Sighting],
    time_s: float,
    settings: DynamicObjectSettings,
) -> dict[int, int]:
    """Sighting by body, at the least total distance from where the bodies should be."""
    from scipy.optimize import linear_sum_assignment

    if not bodies or not sightings:
        return {}
    expected = np.array([body.expect_m(time_s) for body in bodies])
    found = np.array([s.center_m(s.half_width_m) for s in sightings])
    gates = np.array([body.gate_m(time_s, settings) for body in bodies])
    apart = np.linalg.norm(expected[:, None] - found, axis=2)
    never = 1e3 * (float(gates.max()) + settings.gap_m)
    rows, columns = linear_sum_assignment(np.where(apart <= gates[:, None], apart, never))
    return {int(r): int(c) for r, c in zip(rows, columns, strict=True) if apart[r, c] <= gates[r]}


def _out_of_sight(body: Body, frame: BeamFrame, settings: DynamicObjectSettings) -> list[Body]:
    """The body carried on, or nothing once it is given up."""
    unseen_s = frame.time_s - body.sightings[-1].time_s
    if body.motion is None:
        return [body] if unseen_s <= settings.lost_s else []
    place = body.motion.at(frame.time_s)
    passed = body.passed + 1 if is_passed(frame, place, body.motion.radius_m) else 0
    kept = unseen_s <= settings.coast_s and passed < PASSES_TO_END
    return [replace(body, passed=passed)] if kept else []


def _see_again(body: Body, sighting: Sighting, settings: DynamicObjectSettings) -> Body:
    """The body after its next sighting, with a motion if it is a dynamic object."""
    oldest = sighting.time_s - settings.window_s - 1e-9
    sightings = (*(s for s in body.sightings if s.time_s >= oldest), sighting)
    body = replace(body, sightings=sightings, passed=0)
    if len({s.time_s for s in sightings}) < settings.scans:
        # Too few to fit: a dynamic object that comes out of hiding flies on as it did.
        return body
    if body.motion is None:
        return replace(body, motion=_first_motion(sightings, settings))
    motion = fit_motion(sightings)
    if motion.misfit > STILL_CONSISTENT:
        motion = fit_motion(sightings[-settings.scans :])
    still = motion.speed_mps < 0.5 * settings.slowest_mps
    return replace(body, motion=None if still else motion)


def _first_motion(
    sightings: Sequence[Sighting], settings: DynamicObjectSettings
) -> FittedMotion | None:
    """The motion of what has proved to move; None for anything else."""
    first, last = sightings[0], sightings[-1]
    if last.half_width_m < AS_WIDE * max(s.half_width_m for s in sightings):
        return None
    moved = float(np.linalg.norm(last.mean_m - first.mean_m))
    if moved < settings.slowest_mps * (last.time_s - first.time_s):
        return None
    proof = max(share_passed(first.frame, last), share_passed(last.frame, first))
    if proof < settings.share:
        return None
    motion = fit_motion(sightings)
    slowest = max(settings.slowest_mps, CERTAIN * motion.velocity_std_mps)
    return motion if motion.misfit <= CONSISTENT and motion.speed_mps >= slowest else None
