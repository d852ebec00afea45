"""Why a copter is as fast as it is, and what it saw to be free: as it was, and no more."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import clearway as cw
from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.past import past
from clearway.avoidance.speed_choice import DIRECTIONS, STEP_M, Sight, SpeedChoice, SpeedLimit
from clearway.missions.run_files import decision_record
from clearway.sensors.observed.seen_space import NOTHING_SEEN
from clearway.sensors.observed.sight import measure_sight
from clearway.sim import LoggedDecision, Run

UNTIL_S = 6.8


@cache
def flown() -> Run:
    mission = cw.read_mission("copter-columns")
    return cw.fly(mission.with_values("simulation", time_limit_s=UNTIL_S))


def told(entry: LoggedDecision) -> tuple[SpeedChoice, Sight]:
    speed, sight = entry.flight.decision.speed, entry.sight
    assert speed is not None
    assert sight is not None
    return speed, sight


def test_speeds_are_those_that_are_flown():
    run = flown()
    for entry, then in zip(run.decisions, run.decisions[1:], strict=False):
        speed, _ = told(entry)
        assert speed.next_mps == speed.plan_mps[0]
        assert told(then)[0].now_mps == pytest.approx(speed.next_mps)
        assert speed.greatest_mps == 10.0
    assert max(told(entry)[0].next_mps for entry in run.decisions) >= 8.0


def test_sight_limits_where_an_escape_lacks_nothing_but_sight():
    limits = [told(entry)[0].limit for entry in flown().decisions]
    assert {SpeedLimit.SIGHT, SpeedLimit.CLEARANCE, SpeedLimit.GAINING} <= set(limits)
    for entry, limit in zip(flown().decisions, limits, strict=True):
        decision = entry.flight.decision
        speed, ways = told(entry)[0], decision.ways
        assert ways is not None
        assert (limit is SpeedLimit.ESCAPE) == (decision.choice.basis is Basis.WAY_OUT)
        classes = decision.found_again.planner.automaton.classes
        assert classes is not None
        at = classes.class_at(float(decision.state.attitude_rad[0]))
        ends = classes.following[at]
        fastest = classes.speed_mps[ends[ends >= 0]].max()
        assert (limit is SpeedLimit.GAINING) == (speed.next_mps == fastest < speed.greatest_mps)
        if limit is SpeedLimit.SIGHT:
            faster = np.flatnonzero((ends >= 0) & (classes.speed_mps[ends] > speed.next_mps))
            refused = set(map(classes.names.index, decision.no_way_out)) & set(faster.tolist())
            blind = any(ways.after(movement, strict=False) is not None for movement in refused)
            assert blind or set(ways.shunned) & set(faster.tolist())


def test_nothing_that_stands_lies_in_what_was_seen_to_be_free():
    run = flown()
    assert run.world is not None
    for entry in run.decisions:
        sight = told(entry)[1]
        place = entry.flight.decision.state.position_m
        assert len(sight.free_m) == DIRECTIONS
        assert sight.free_m.max() > 8.0
        assert sight.ahead_m in sight.free_m
        for azimuth, far in zip(sight.azimuths_rad, sight.free_m, strict=True):
            away = np.arange(0.0, far + 1e-9, STEP_M)
            level = np.stack([np.cos(azimuth) * away, np.sin(azimuth) * away, 0.0 * away], axis=1)
            assert run.world.distance_m(place + level).min() > 0.0


def test_a_vehicle_stops_within_sight_from_the_speed_that_it_allows():
    for entry in flown().decisions:
        _, sight = told(entry)
        reaction_s, most = 0.4, 5.0
        needed = sight.cap_mps * reaction_s + sight.cap_mps**2 / (2.0 * most)
        assert needed <= sight.ahead_m + 1e-9
        assert needed == pytest.approx(sight.ahead_m) or sight.cap_mps == 10.0


def test_sight_ends_where_nothing_was_seen():
    seen = NOTHING_SEEN._replace(window=NOTHING_SEEN.window.copy())
    seen.window[7] = 5.0  # A ball about the origin is declared free.
    azimuths = np.array([0.0, 2.0, -1.0])
    free_m = measure_sight(seen, np.array([1.0, 0.0, 0.0]), azimuths, 0.5, 0.25, 40.0)
    assert free_m[0] == 3.5
    assert 4.5 < free_m[1] < 5.5
    assert not measure_sight(NOTHING_SEEN, np.zeros(3), azimuths, 0.2, 0.5, 40.0).any()
    assert measure_sight(seen, np.zeros(3), azimuths, 0.5, 0.25, 2.0) == pytest.approx(2.0)


def test_a_past_decision_tells_the_same():
    entry = flown().decisions[9]
    kept = past(entry.flight.decision)
    assert kept.ways is None
    assert kept.speed == entry.flight.decision.speed
    record = decision_record(entry)
    assert record["speed"]["limit"] == told(entry)[0].limit.name.lower()
    assert told(entry)[0].in_words in record["explanation"]
    assert len(record["sight"]["free_m"]) == DIRECTIONS


def test_a_plane_has_no_speed_to_choose():
    mission = cw.read_mission("static-obstacles").with_values("simulation", time_limit_s=3.0)
    entry = cw.fly(mission).decisions[0]
    assert entry.sight is None
    assert entry.flight.decision.speed is None
    assert not {"speed", "sight"} & decision_record(entry).keys()
