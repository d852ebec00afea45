"""Whether what is seen on the straight way leaves a way out: `python -m tools.sight forest-narrow`.

Worlds of the campaign `dead-ends` are flown by who knows all that stands there and asks for no way
out, and at every few decisions all motions through what was seen until then are searched, not only
the escapes of a library: movements one after another, places that lie in one cell, with one heading
and one attitude, once. Where that comes to an end without coming back to a cell, nothing that is
flown from there can be flown for ever, whatever the library.
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from clearway.avoidance.escape.finder import STANDING, WaysOut
from clearway.avoidance.escape.legs import EscapeTerms, leg_keeps
from clearway.avoidance.escape.terms import limit_carried_m, make_escape_terms
from clearway.avoidance.plan.evidence import gather_in_reach
from clearway.base.frames import FloatArray
from clearway.base.intervals import wilson
from clearway.base.state import IntArray
from clearway.live import AvoidanceSystem, Reading
from clearway.live.outputs.flight_decision import FlightDecision
from clearway.missions.setup import FlightSetup
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach.escapes.legs import Legs
from clearway.sim import simulate
from clearway.sim.baselines import CLEARWAY
from clearway.studies.campaigns.families import make_case
from clearway.studies.campaigns.file import read_campaign

MOST_STATES = 400_000
CELL_STEPS = 0.3
"""Width of a cell in which places are one, in movements."""


def leads_on(
    pose: FloatArray,
    attitude: int,
    start_s: float,
    legs: Legs,
    terms: EscapeTerms,
    cell_m: float,
    most: int,
) -> tuple[IntArray, bool]:
    """[states, movements] to which state each leads, -1 to none; and whether that is all of them.

    pose [4]: where the first state is. What wind does is left out.
    """
    movements, last = legs.path.shape[1], legs.path.shape[2] - 1
    poses, attitudes = np.empty((most, 4)), np.empty(most, dtype=np.int64)
    to = np.full((most, movements), -1, dtype=np.int64)
    known = {_key(pose, attitude, cell_m): 0}
    poses[0], attitudes[0], count, at = pose, attitude, 1, 0
    end = np.empty(4)
    while at < count:
        cosine, sine = np.cos(poses[at, 3]), np.sin(poses[at, 3])
        for m in range(movements):
            then, path = legs.following[attitudes[at], m], legs.path[attitudes[at], m]
            if then < 0:
                continue
            times = (start_s, start_s + legs.duration_s[m])
            sagitta = legs.sagitta_m[attitudes[at], m]
            if not leg_keeps(poses[at], path, sagitta, times[0], times[1], terms):
                continue
            end[0] = poses[at, 0] + cosine * path[last, 0] - sine * path[last, 1]
            end[1] = poses[at, 1] + sine * path[last, 0] + cosine * path[last, 1]
            end[2], end[3] = poses[at, 2] + path[last, 2], poses[at, 3] + path[last, 3]
            key = _key(end, then, cell_m)
            if key in known:
                to[at, m] = known[key]
            elif count == most:
                return to, False
            else:
                known[key], to[at, m] = count, count
                poses[count], attitudes[count] = end, then
                count += 1
        at += 1
    return to[:count], True


def _key(pose: FloatArray, attitude: int, cell_m: float) -> tuple[int, int, int, int, int]:
    """Of the cell that a pose lies in, with its heading."""
    turned = int(np.round(pose[3] / (np.pi / 36.0))) % 72
    return (
        int(np.floor(pose[0] / cell_m)),
        int(np.floor(pose[1] / cell_m)),
        int(np.floor(pose[2] / cell_m)),
        turned,
        int(attitude),
    )


def goes_on(to: IntArray) -> bool:
    """Whether something that is flown from the first state never has to end."""
    alive = np.ones(len(to), dtype=np.bool_)
    while True:
        left = alive & (alive[to] & (to >= 0)).any(axis=1)
        if left.sum() == alive.sum():
            return bool(alive[0])
        alive = left


class Watched(AvoidanceSystem):
    """Who knows all that stands, and asks at every few decisions what who goes by sight has."""

    def __init__(self, flown: FlightSetup, sighted: FlightSetup, every: int) -> None:
        world = sighted.world
        assert isinstance(world, ObstacleMap)
        super().__init__(flown.planner, flown.mission, lidars=flown.sensors, obstacle_map=world)
        self._sight = sighted.system()
        self._every, self._asked = every, 0
        self.found: Counter[str] = Counter()

    def update(self, reading: Reading) -> None:
        super().update(reading)
        self._sight.update(reading)

    def decide(self, now_s: float) -> FlightDecision:
        decision = super().decide(now_s)
        self._asked += 1
        if self._asked % self._every == 0:
            self.found[self._in_sight(now_s, decision.movements[0])] += 1
        return decision

    def _in_sight(self, now_s: float, movement: str) -> str:
        """What there is after a movement: "an escape", another "motion", "nothing", or "unknown"
        where the search did not come to its end."""
        planner, (situation, _) = self._sight.planner, self._sight.situation(now_s)
        library = planner.escapes
        assert library is not None
        reach_m = planner.escape_reach_m + limit_carried_m(planner, situation)
        near = gather_in_reach(
            planner, situation, max(reach_m, planner.grid.range_m), planner.horizon_s
        )
        first = library.automaton.names.index(movement)
        if WaysOut(planner, library, situation, near).after(first) is not None:
            return "an escape"
        roll, pitch, _ = situation.state.attitude_rad.tolist()
        legs, at = library.legs_at(roll, pitch), library.nearest(roll, pitch)
        terms, end_s = (
            make_escape_terms(planner, library, situation, near),
            float(legs.duration_s[first]),
        )
        path, then = legs.path[at, first], int(legs.following[at, first])
        if not leg_keeps(STANDING, path, float(legs.sagitta_m[at, first]), 0.0, end_s, terms):
            return "nothing"
        cell_m = CELL_STEPS * library.automaton.step_m
        to, whole = leads_on(path[-1].copy(), then, end_s, legs, terms, cell_m, MOST_STATES)
        if goes_on(to):
            return "a motion"
        return "nothing" if whole else "unknown"


def looked_at(label: str, seed: int, range_m: float, every: int) -> Counter[str]:
    """What was found on the way through one world."""
    campaign = read_campaign("dead-ends").file
    section = next(one for one in campaign.family if one.name == label)
    changes: dict[str, dict[str, Any]] = dict(campaign.changes_of(section, CLEARWAY))
    changes["lidar"] = {"max_range_m": range_m}
    sighted, flown = (
        make_case(
            section.family, seed, section.parameters, changes | {"safety": {"escape": one}}, Path()
        ).setup
        for one in ("strict", "off")
    )
    pilot = Watched(flown, sighted, every)
    simulate(pilot, flown.world, lidars=flown.lidars, settings=flown.simulation)
    return pilot.found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("label", help="kind of world of the campaign, such as forest-narrow")
    parser.add_argument("--range-m", type=float, default=15.0)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument(
        "--every", type=int, default=3, help="of so many decisions one is looked at"
    )
    given = parser.parse_args()
    found: Counter[str] = Counter()
    for seed in range(given.seeds):
        found += looked_at(given.label, seed, given.range_m, given.every)
        print(f"seed {seed}: {dict(found)} so far", flush=True)
    asked = found.total() - found["unknown"]
    for what in ("an escape", "a motion", "nothing"):
        low, high = wilson(found[what], asked)
        print(f"{what}: {found[what]} of {asked} ({low:.1%} to {high:.1%})")


if __name__ == "__main__":
    main()
