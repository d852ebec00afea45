"""A session whose data grow old, stop, come late or come from another clock."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clearway.live.link.link_state import LinkState
from clearway.live.link.set_point import HOLDS
from clearway.mavlink.set_points import FOLLOW
from mavlink_for_tests import (
    SET_POINT,
    Bench,
    aircraft,
    attitude,
    distances,
    heartbeat,
    origin,
    position,
    sent,
    words,
)

# --- ageing, stale, lost ------------------------------------------------------------------------


def silent_from(bench: Bench, time_s: float, until_s: float, *still: Any) -> list[Any]:
    """Ticks every 0.1 s with heartbeats, and whatever `still` makes of the time, only."""
    steps = np.arange(time_s + 0.1, until_s + 1e-6, 0.1)
    return [bench.tick(t, heartbeat(), *(make(t) for make in still)) for t in steps.tolist()]


def test_the_margin_grows_with_the_age_of_the_position_then_the_plan_then_nothing() -> None:
    bench = Bench()
    for n in range(5):
        bench.all_well(1.0 + 0.1 * n, ned=(0.0, 0.1 * n, 0.0), sectors={10: 700})
    silent = silent_from(bench, 1.4, 5.0)
    states = [outcome.state for outcome in silent]
    order = [LinkState.FLYING, LinkState.AGEING, LinkState.STALE, LinkState.POSITION_LOST]
    assert sorted(set(states), key=order.index) == order
    assert states == sorted(states, key=order.index)
    margins = [outcome.flight.decision.margin_m for outcome in silent if outcome.flight is not None]
    assert margins == sorted(margins)
    late = [o for o in silent if o.state is LinkState.AGEING and o.flight is not None]
    for outcome in late:
        assert outcome.flight.decision.margin_m == pytest.approx(
            0.6 + 0.05 * (outcome.time_s - 1.4), abs=1e-6
        )
    stale = [outcome for outcome in silent if outcome.state is LinkState.STALE]
    assert all(outcome.flight is None for outcome in stale)
    # With something in reach a plan holds for one movement, no longer.
    last = max(outcome.flight.time_s for outcome in silent if outcome.flight is not None)
    for outcome in stale:
        moving = outcome.set_point is not None and outcome.set_point.velocity_mps is not None
        assert moving == (outcome.time_s <= last + 1.0 + 1e-9)
    # Then it is told to hold where it was led to, three times, since one may get lost.
    after = [outcome for outcome in silent if outcome.time_s > last + 1.0 + 1e-9]
    held = [outcome.set_point for outcome in after[:HOLDS]]
    led = next(o.set_point for o in reversed(silent) if o.time_s <= last + 1.0 + 1e-9)
    assert all(point.velocity_mps is None for point in held)
    assert all(point.position_m == pytest.approx(led.position_m) for point in held)
    assert all(outcome.set_point is None for outcome in after[HOLDS:])
    assert after[-1].state is LinkState.POSITION_LOST
    assert not sent(after[-1], SET_POINT)


def test_no_heartbeat_and_all_else_goes_on() -> None:
    bench = Bench()
    bench.all_well(1.0)
    for n in range(1, 60):
        t = 1.0 + 0.1 * n
        outcome = bench.tick(t, attitude(t), position(t, (0, 0.1 * n, 0)), distances(t))
        lost = t > 4.0 + 1e-6
        assert (outcome.state is LinkState.LINK_LOST) is lost
        led = [point for point in sent(outcome, SET_POINT) if point.type_mask == FOLLOW]
        assert bool(led) is not lost
    again = bench.all_well(7.0, ned=(0, 6.0, 0))
    assert again.state is LinkState.FLYING
    assert sent(again, SET_POINT)


def test_silence_is_told_once() -> None:
    bench = Bench()
    bench.all_well(1.0)
    told = "; ".join(filter(None, (words(bench.tick(1.0 + 0.25 * n)) for n in range(1, 40))))
    assert told == "clearway: ageing; clearway: stale position; clearway: link lost"


def test_without_distances_space_counts_as_unseen_and_then_it_ends() -> None:
    bench = Bench()
    bench.all_well(1.0, sectors={0: 900})

    def place(t: float) -> Any:
        return position(t, (0, 0, 0), (0, 0, 0))

    blind = silent_from(bench, 1.0, 9.0, attitude, place)
    for outcome in blind:
        age = outcome.time_s - 1.0
        if age > 6.0 + 1e-6:
            assert outcome.state is LinkState.SENSOR_LOST
            assert outcome.set_point is None or outcome.set_point.velocity_mps is None
        elif age > 3.0 + 1e-6:
            assert outcome.state is LinkState.BLIND
            if outcome.flight is not None:
                assert not outcome.flight.decision.cells.evidence.seen.any()
                assert len(outcome.flight.decision.hazards.points.radius_m)
        else:
            # It does not move, which is noticed.
            assert outcome.state in (LinkState.FLYING, LinkState.NOT_FOLLOWED)
    assert bench.system.counts["scan: none fresh of obstacle-distance"] > 0


def test_a_mission_without_a_sensor_asks_for_none() -> None:
    bench = Bench(sensor=False)
    outcome = bench.tick(1.0, heartbeat(), attitude(1.0), position(1.0), distances(1.0))
    assert outcome.state is LinkState.FLYING
    assert bench.counts == {"distances: the mission has no sensor": 1}


def test_late_reports_and_distances_count_at_once_if_they_endanger_the_plan() -> None:
    bench = Bench()
    bench.all_well(1.0)
    assert bench.all_well(1.1, ned=(0, 0.1, 0)).flight is None
    harmless = bench.tick(1.2, aircraft(0xA, tslc=2, lat=520_010_000))
    assert harmless.flight is None
    bench.tick(1.3, attitude(1.3), position(1.3, (0, 0.3, 0)))
    behind = bench.tick(1.4, distances(1.2, {36: 400}))
    assert behind.flight is None
    bench.tick(1.5, attitude(1.5), position(1.5, (0, 0.5, 0)))
    ahead = bench.tick(1.6, distances(1.4, {0: 400}))
    assert ahead.flight is not None
    assert ahead.why_now.startswith("the plan comes within ")
    assert ahead.why_now.endswith(" m of a return")
    assert ahead.flight.decision.intruders == ("00000a",)


def test_old_traffic_is_left_out() -> None:
    bench = Bench(sensor=False)
    bench.tick(1.0, heartbeat(), origin(), attitude(1.0), position(1.0, (0, 0, 0), (0, 0, 0)))
    bench.tell(1001.0, aircraft())
    seen = {}
    for n in range(1, 140):
        t = 1.0 + 0.1 * n
        outcome = bench.tick(t, heartbeat(), attitude(t), position(t, (0, 0, 0), (0, 0, 0)))
        if outcome.flight is not None:
            seen[round(t, 1)] = outcome.flight.decision.intruders
    assert all(names == ("abcdef",) for t, names in seen.items() if t < 11.0)
    assert min(seen) == 1.1
    assert seen[11.1] == ()


# --- the autopilot's clock ----------------------------------------------------------------------


def test_a_restart_ends_it_for_good() -> None:
    bench = Bench()
    bench.all_well(100.0)
    for n in range(5):
        bench.tell(1100.1 + 0.1 * n, heartbeat(), position(0.1 * n))
    outcome = bench.session.tick(1100.6)
    assert outcome.state is LinkState.RESTARTED
    assert not sent(outcome, SET_POINT)
    assert words(outcome) == "clearway: autopilot restarted"
    bench.tell(1100.7, heartbeat(), attitude(100.7), position(100.7), distances(100.7))
    assert bench.session.tick(1100.7).state is LinkState.RESTARTED


def test_stray_times_are_left_out() -> None:
    bench = Bench()
    bench.all_well(100.0)
    bench.tell(1100.1, position(3.0, (500, 500, 0)))
    outcome = bench.all_well(100.2, ned=(0, 0.2, 0))
    assert outcome.state is LinkState.FLYING
    (point,) = sent(outcome, SET_POINT)
    assert (point.x, point.y) == pytest.approx((0.0, 0.25), abs=1e-6)
    assert bench.counts == {"clock: from another time": 1}


# --- following the plan -------------------------------------------------------------------------


def turning(bench: Bench, **beat: Any) -> list[float]:
    """Yaw that decisions start from while the vehicle flies on east and a wall asks for a turn."""
    wall = dict.fromkeys(range(-12, 3), 450)
    yaws = []
    for n in range(8):
        t = 1.0 + 0.1 * n
        bench.tick(
            t, heartbeat(**beat), attitude(t), position(t, (0, 0.1 * n, 0)), distances(t, wall)
        )
        situation, _ = bench.system.situation(t)
        yaws.append(abs(math.degrees(situation.state.attitude_rad[2])))
    return yaws


def test_a_vehicle_that_lags_is_taken_to_be_on_its_plan() -> None:
    assert turning(Bench())[-1] > 5.0


@pytest.mark.parametrize(
    ("act", "beat"), [(False, {}), (True, {"base_mode": 128})], ids=["read-only", "other mode"]
)
def test_a_vehicle_that_does_not_follow_is_where_it_flies(act: bool, beat: Any) -> None:
    assert max(turning(Bench(act=act), **beat)) < 1e-3


def test_patience_begins_when_we_are_followed() -> None:
    bench = Bench(sensor=False)
    for n in range(200):
        t = 1.0 + n
        bench.tick(t, heartbeat(base_mode=0), attitude(t), position(t, velocity_ned=(0, 0, 0)))
    assert bench.system.progress.detours == 0
