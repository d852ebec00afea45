"""Who is believed when sensors contradict each other where their fields overlap.

A return is *refuted* by another sensor whose beams go on beyond it. That alone does not tell a
ghost from a sensor that is blind, so two more things count. A *steady* sensor has seen its own
earlier returns again from another place: real things stay where they are, and a fault that travels
with the vehicle does not. And weights: precision times trust of all that are steady.

- Refuted, not steady, and confirmed by nobody: the sensor itself loses trust. So it does if that
  holds for some of its returns only, verdict after verdict: dirt on a lens, for instance.
- Refuted by steady sensors that outweigh it and those that confirm it: it loses trust.
- Refuted, but steady: a sensor that refuted it unsteadily is taken as blind, and loses trust.
- Refuted by nobody, looked at by others, and steady: it regains trust, up to that of the start.
- Otherwise nothing is decided, and its returns count: what one believed sensor sees is there.

One verdict is taken each time the vehicle has moved on by a margin, so each rests on a new view.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, State
from clearway.sensors.beams.lidar import Scan
from clearway.sensors.range_sensor import RangeSensor, find_passed, find_returns
from clearway.sensors.standing import Standing

LEAST = 8
"""Returns that must be open to refutation, or nothing is judged."""
REFUTED_SHARE = 0.5
"""Of those, more than this must be refuted."""
MOST = 200
"""Returns of a reading that are judged, evenly picked."""
TOGETHER_S = 1.0
"""Readings further apart in time are not checked against each other."""
STEADY_S = 10.0
"""For so long after it was found steady a sensor counts as such."""
LOWERED = 0.7
RAISED = 1.2
"""Factors of trust by a verdict against a sensor, and for it."""
DOUBTED = 0.3
BELIEVED = 0.6
"""Shares of the trust at the start: below the first nobody believes, above the second again."""
MOST_COMPARED = 10_000
"""Returns of another sensor that a dynamic object is looked for among."""
SLACK = 0.3
"""Share of the margin by which places may be off, and by which a thing is wide."""


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A reading and where it was taken."""

    scan: Scan
    state: State


@dataclass(frozen=True, slots=True, eq=False)
class Statement:
    """A few returns of a reading, and where it was taken."""

    state: State
    points_m: FloatArray
    """[n, 3] world frame."""
    radius_m: FloatArray
    """[n]"""


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """What is held of one sensor."""

    standing: Standing
    trust: float
    """Now."""
    believed: bool = True
    latest: View | None = None
    judged: Statement | None = None
    """What the last verdict was about."""
    doubted: Statement | None = None
    """Those of its returns that were refuted then, if they were more than a few."""
    steady: bool | None = None
    """Whether it saw again what it had seen at the verdict before; None where it could not."""
    steady_s: float = -np.inf
    """When that was last so."""
    verdicts_against: int = 0

    @property
    def weight(self) -> float:
        return self.standing.precision * self.trust

    def is_steady(self, time_s: float) -> bool:
        return time_s - self.steady_s <= STEADY_S

    def lower(self) -> Record:
        trust = LOWERED * self.trust
        believed = self.believed and trust >= DOUBTED * self.standing.trust
        against = self.verdicts_against + 1
        return replace(self, trust=trust, believed=believed, verdicts_against=against)

    def raise_credit(self) -> Record:
        trust = min(self.standing.trust, RAISED * self.trust)
        believed = self.believed or trust > BELIEVED * self.standing.trust
        return replace(self, trust=trust, believed=believed)


@dataclass(frozen=True, slots=True, eq=False)
class Court:
    """Records of all sensors, and the lengths by which readings are compared."""

    margin_m: float
    reach_m: float
    """Returns from farther away are not judged."""
    speed_mps: float
    """What moves up to twice as fast is not refuted by a view of where it was or will be."""
    records: Mapping[str, Record]

    @classmethod
    def of(
        cls, sensors: Mapping[str, RangeSensor], margin_m: float, reach_m: float, speed_mps: float
    ) -> Court:
        """Everybody is believed as far as stated."""
        return cls(
            margin_m,
            reach_m,
            speed_mps,
            {name: Record(each.standing, each.standing.trust) for name, each in sensors.items()},
        )

    def believes(self, name: str) -> bool:
        return self.records[name].believed


def hear_reading(
    court: Court,
    sensors: Mapping[str, RangeSensor],
    scan: Scan,
    state: State,
    *,
    sigmas: float = 3.0,
    ground_m: float = -np.inf,
) -> Court:
    """The court after a reading; a verdict is taken if the vehicle has moved on since the last."""
    sensor, view = sensors[scan.sensor], View(scan, state)
    records = dict(court.records)
    records[sensor.name] = record = replace(records[sensor.name], latest=view)
    before = record.judged
    slack_m = SLACK * court.margin_m + sigmas * (state.position_std_m + 2.0 * sensor.sigma_m)
    if before is not None and _measure_moved_m(before.state, state) < max(
        court.margin_m, 2.0 * slack_m
    ):
        return replace(court, records=records)
    now = _statement(sensor, view, court.reach_m, ground_m)
    doubted = None
    if before is not None:
        record = _test(record, sensor, view, before, slack_m)
        haunted = record.doubted is not None and _mostly(
            _judge(sensor, view, record.doubted, slack_m)
        )
        opinions = _opinions(court, sensors, records, view, now, sigmas)
        doubted = _part(now, opinions)
        records[sensor.name] = record
        records |= _verdict(
            records, sensor.name, opinions, bool(haunted and doubted is not None), scan.time_s
        )
    records[sensor.name] = replace(records[sensor.name], judged=now, doubted=doubted)
    return replace(court, records=records)


def _measure_moved_m(before: State, now: State) -> float:
    return float(np.linalg.norm(now.position_m - before.position_m))


def _statement(sensor: RangeSensor, view: View, reach_m: float, ground_m: float) -> Statement:
    points, radii = find_returns(sensor, view.scan, view.state, reach_m, ground_m)
    pick = slice(None, None, 1 + len(points) // MOST)
    return Statement(
        view.state, np.ascontiguousarray(points[pick]), np.ascontiguousarray(radii[pick])
    )


def _test(
    record: Record, sensor: RangeSensor, view: View, before: Statement, slack_m: float
) -> Record:
    """The record after its sensor has looked again at what it stated before."""
    refuted = _mostly(_judge(sensor, view, before, slack_m))
    if refuted is None:
        return replace(record, steady=None)
    steady_s = record.steady_s if refuted else view.scan.time_s
    return replace(record, steady=not refuted, steady_s=steady_s)


class Opinion(NamedTuple):
    """What a view says of the returns of a statement."""

    looks: BoolArray
    """[n] whether it could refute them."""
    refuted: BoolArray
    """[n]"""


def _judge(witness: RangeSensor, view: View, accused: Statement, slack_m: float) -> Opinion:
    wide = accused.radius_m + slack_m
    nothing = replace(view.scan, points_m=np.zeros((0, 3)))
    balls = (view.state, accused.points_m, wide, slack_m)
    looks = find_passed(witness, nothing, *balls)
    passed = find_passed(witness, view.scan, *balls)
    return Opinion(looks, looks & passed)


def _mostly(opinion: Opinion) -> bool | None:
    """Whether most returns are refuted; None where too few are looked at."""
    count = int(np.count_nonzero(opinion.looks))
    if count < LEAST:
        return None
    return int(np.count_nonzero(opinion.refuted)) > REFUTED_SHARE * count


def _opinions(
    court: Court,
    sensors: Mapping[str, RangeSensor],
    records: Mapping[str, Record],
    said: View,
    now: Statement,
    sigmas: float,
) -> dict[str, Opinion]:
    """What the other sensors that are believed say of a statement, by name."""
    name, time_s = said.scan.sensor, said.scan.time_s
    opinions: dict[str, Opinion] = {}
    for other, record in records.items():
        view = record.latest
        if other == name or view is None or not record.believed:
            continue
        elapsed_s = time_s - view.scan.time_s
        if elapsed_s > TOGETHER_S + 1e-6:
            continue
        sigma = sensors[name].sigma_m + sensors[other].sigma_m
        slack_m = SLACK * court.margin_m + sigmas * (said.state.position_std_m + sigma)
        opinion = _judge(sensors[other], view, now, slack_m)
        if np.count_nonzero(opinion.refuted) >= LEAST:
            reach_m = 2.0 * court.reach_m
            seen, _ = find_returns(sensors[other], view.scan, view.state, reach_m, -np.inf)
            near_m = 2.0 * court.speed_mps * elapsed_s + slack_m
            moved = _near_any(now.points_m, seen, near_m)
            opinion = Opinion(opinion.looks, opinion.refuted & ~moved)
        opinions[other] = opinion
    return opinions


def _near_any(points_m: FloatArray, others_m: FloatArray, reach_m: float) -> BoolArray:
    """[n] whether any of some other points [m, 3] is within reach."""
    if not len(others_m):
        return np.zeros(len(points_m), dtype=np.bool_)
    middle = points_m.mean(axis=0)
    one, other = points_m - middle, others_m[:: 1 + len(others_m) // MOST_COMPARED] - middle
    squared = (one**2).sum(axis=1)[:, None] + (other**2).sum(axis=1) - 2.0 * one @ other.T
    return np.asarray(squared.min(axis=1) <= reach_m**2)


def _part(now: Statement, opinions: Mapping[str, Opinion]) -> Statement | None:
    """The returns that somebody refutes and nobody confirms, if they are more than a few."""
    refuted = np.zeros(len(now.radius_m), dtype=np.bool_)
    confirmed = refuted.copy()
    for opinion in opinions.values():
        refuted |= opinion.refuted
        confirmed |= opinion.looks & ~opinion.refuted
    doubted = np.flatnonzero(refuted & ~confirmed)
    if len(doubted) < LEAST:
        return None
    return Statement(now.state, now.points_m[doubted], now.radius_m[doubted])


def _verdict(
    records: Mapping[str, Record],
    name: str,
    opinions: Mapping[str, Opinion],
    haunted: bool,
    time_s: float,
) -> dict[str, Record]:
    """The records that change; haunted: what others refute of it, it does not see again itself."""
    record = records[name]
    against = [other for other, opinion in opinions.items() if _mostly(opinion)]
    confirming = [other for other, opinion in opinions.items() if _mostly(opinion) is False]
    if haunted:
        return {name: record.lower()}
    if not against:
        return {name: record.raise_credit()} if confirming and record.steady else {}
    steady = [other for other in against if records[other].is_steady(time_s)]
    own = record.weight + sum(records[other].weight for other in confirming)
    outvoted = sum(records[other].weight for other in steady) > own
    if outvoted or (record.steady is False and not confirming):
        return {name: record.lower()}
    if record.steady:
        return {other: records[other].lower() for other in against if other not in steady}
    return {}
