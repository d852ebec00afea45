"""The search for a way out finds the first that keeps what is asked, as trying them all does."""

from __future__ import annotations

from copy import copy
from itertools import product

import numpy as np
import pytest

from clearway.avoidance.clear.clearance import make_span, moving_clearance
from clearway.avoidance.clear.hazards import MovingHazards, bin_points
from clearway.avoidance.escape.beginnings import KEEPS, begin_at, tips_of
from clearway.avoidance.escape.chains import chain_keeps, chain_room, rounds
from clearway.avoidance.escape.finder import WaysOut
from clearway.avoidance.escape.legs import EscapeTerms, carry_leg, pose_after, was_seen
from clearway.avoidance.escape.places import NEARLY, loop_places, places_are_clear
from clearway.avoidance.escape.search import first_escape, movements_of
from clearway.avoidance.escape.too_near import LONG, TooNear, are_near, fill_in, too_near
from clearway.avoidance.escape.wide_space import (
    MOST,
    OFTEN,
    fill_in_wide,
    first_wide,
    steps_within,
    wide_space,
)
from clearway.avoidance.plan.evidence import gather_in_reach
from clearway.avoidance.plan.held_escape import WayOut
from clearway.base.frames import world_from_body
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach.escapes.legs import Legs
from clearway.reach.escapes.upwind import ways_in_wind
from clearway.reach.escapes.ways import Ways
from clearway.sensors import simulate_scan
from clearway.sensors.observed.free_space import SHAPE
from clearway.sensors.observed.free_voxels import is_voxel_marked, pack_voxels
from clearway.sensors.observed.range_views import NO_VIEWS
from clearway.sensors.observed.seen_space import is_free
from worlds_for_tests import LIDAR, mission, planner

PLANNER = planner()
BALLS = ObstacleMap([Obstacle.ball([9.0, 1.5, 0.0], 1.0), Obstacle.ball([6.0, -4.0, 0.5], 1.0)])


@pytest.fixture(scope="module")
def ways() -> WaysOut:
    """What is known after a few movements straight on."""
    system = AvoidanceSystem(PLANNER, mission((40.0, 0.0, 0.0)), lidars=(LIDAR,))
    for at in range(4):
        here = State(np.array([float(at), 0.0, 0.0]), time_s=float(at))
        system.update(here)
        system.update(simulate_scan(LIDAR, BALLS, here))
        situation = system.situation(float(at))[0]
    assert PLANNER.escapes is not None
    return WaysOut(PLANNER, PLANNER.escapes, situation, gather_in_reach(PLANNER, situation))


def searched(
    ways: WaysOut, terms: EscapeTerms, pose, start_s, aloof_m, *, near: TooNear, often: bool
) -> tuple[int, float]:
    """The first escape from level flight, and the distance that it keeps; often: as in a search
    that has gone on for long."""
    escapes, legs = ways.library.ways[0], ways.library.legs
    wide = wide_space()
    wide.looked[0] = OFTEN if often else 0
    about = (terms, np.array(aloof_m), near, wide)
    places, tips = loop_places(escapes, legs), tips_of(escapes)
    found, _, kept_m = first_escape(escapes, legs, places, tips, 0, pose, start_s, *about)
    return found, kept_m


@pytest.mark.parametrize("aloof_m", [(0.2,), (0.6, 0.2), (0.6, 0.4), (1.5, 0.6), (3.0, 2.0)])
@pytest.mark.parametrize("ahead_m", [0.0, 2.0])
@pytest.mark.parametrize("wind_mps", [(0.0, 0.0, 0.0), (0.05, -0.1, 0.02)])
@pytest.mark.parametrize("often", [False, True])
def test_the_first_that_keeps_it(ways, aloof_m, ahead_m, wind_mps, often) -> None:
    library, legs = ways.library, ways.library.legs
    terms = ways._terms._replace(wind_mps=np.array(wind_mps))
    escapes, pose = library.ways[0], np.array([ahead_m, 0.0, 0.0, 0.1 * ahead_m])
    near = too_near(terms.margin_m)
    found, kept_m = searched(ways, terms, pose, 0.0, aloof_m, near=near, often=often)
    for unseen_m in aloof_m:
        asked = terms._replace(unseen_m=unseen_m)
        upto = found if found >= 0 else len(escapes.begins) - 1
        for escape in range(upto + 1):
            if chain_keeps(movements_of(escapes, escape), 0, pose, 0.0, legs, asked):
                assert (escape, unseen_m) == (found, kept_m)
                return
    assert found < 0
    assert np.isnan(kept_m)


@pytest.mark.parametrize("count", [0, 25, 80])
@pytest.mark.parametrize("margin_m", [0.0, 0.3, 0.6])
@pytest.mark.parametrize("wind_mps", [(0.0, 0.0, 0.0), (0.1, -0.2, 0.05)])
@pytest.mark.parametrize(("looked", "declared"), [(0, False), (LONG, False), (LONG, True)])
def test_so_it_does_where_what_nobody_has_seen_is_free(
    ways, count, margin_m, wind_mps, looked, declared
) -> None:
    """Among balls all about, which single places are held against first; level and pitched; looked
    up in cells from the beginning, and only in long searches. Likewise where it has to be declared
    free, and is for 100 m about."""
    window = ways._terms.seen.window.copy()
    window[7] = 100.0 if declared else window[7]
    rng = np.random.default_rng([count, int(10.0 * margin_m)])
    library = ways.library
    escapes, legs = library.ways[0], library.legs
    for pitch_rad in (0.0, 0.3):
        place = rng.uniform([-9.0, -9.0, -4.0], [9.0, 9.0, 4.0], (count, 3))
        place = place[np.linalg.norm(place, axis=1) > 1.0]
        terms = ways._terms._replace(
            must_see=declared,
            seen=ways._terms.seen._replace(window=window),
            margin_m=margin_m,
            bins=bin_points(place, rng.uniform(0.02, 0.3, len(place))),
            grid_from_level=world_from_body([0.0, pitch_rad, 0.0]).T.copy(),
            wind_mps=np.array(wind_mps),
        )
        pose = np.array([*rng.uniform(-1.0, 1.0, 3), rng.uniform(-np.pi, np.pi)])
        near, unseen_m = too_near(0.6), (terms.unseen_m,)
        near.looked[0] = looked
        found, _ = searched(ways, terms, pose, 0.5, unseen_m, near=near, often=looked > 0)
        upto = found if found >= 0 else len(escapes.begins) - 1
        kept = (
            escape
            for escape in range(upto + 1)
            if chain_keeps(movements_of(escapes, escape), 0, pose, 0.5, legs, terms)
        )
        assert next(kept, -1) == found


@pytest.mark.parametrize(
    ("seed", "often"),
    [
        (7, True),
        *(
            pytest.param(*one, marks=pytest.mark.nightly)
            for one in [(4, True), (4, False), (7, False)]
        ),
    ],
)
def test_likewise_where_beginnings_are_not_in_order(ways, seed, often) -> None:
    """As they are of loops against the wind: some come long before those that they begin with."""
    library, legs, rng = ways.library, ways.library.legs, np.random.default_rng(seed)
    found_last = 0
    for attitude in [0, 1, 2, 3, 4] * 8:
        wind = rng.uniform([-0.2, -0.2, 0.0], [0.2, 0.2, 0.0])
        # Seen but for holes here and there, which fail most loops, and few beginnings.
        free = pack_voxels(rng.random(SHAPE) < 1.0 - 10.0 ** rng.uniform(-2.9, -2.3))
        space = ways._terms.seen._replace(views=NO_VIEWS, free=free, whole=free)
        terms = ways._terms._replace(wind_mps=wind, least_s=20.0, seen=space)
        against = ways_in_wind(library, attitude, wind, 1.0)
        assert (np.diff(against.begins) < 0).any()
        pose = rng.uniform([-1.0, -1.0, -0.5, -3.0], [1.0, 1.0, 0.5, 3.0])
        search = (attitude, pose, 1.0, terms, np.array([0.5, 0.1]), too_near(terms.margin_m))
        wide = wide_space()
        wide.looked[0] = OFTEN if often else 0
        laid_out = loop_places(against, legs), tips_of(against)
        found, _, kept_m = first_escape(against, legs, *laid_out, *search, wide)
        least = first_that_keeps(against, legs, attitude, pose, terms, (0.5, 0.1))
        assert (found, kept_m if found >= 0 else 0.0) == least
        found_last += found > len(against.begins) - 200  # One of the library's, after those.
    assert found_last


def first_that_keeps(
    against: Ways, legs: Legs, attitude, pose, terms, aloof_m
) -> tuple[int, float]:
    """By trying them all."""
    for unseen_m in aloof_m:
        asked = terms._replace(unseen_m=unseen_m)
        for escape in range(len(against.begins)):
            loop = against.loop[escape]
            once = against.loop_movement[against.loop_at[loop] : against.loop_at[loop + 1]]
            before = movements_of(against, escape)[: -len(once)]
            chain = np.concatenate([before, rounds(once, legs, asked.least_s)])
            if chain_keeps(chain, attitude, pose, 1.0, legs, asked):
                return escape, unseen_m
    return -1, 0.0


@pytest.mark.parametrize("often", [False, True])
def test_some_are_found_and_some_not(ways, often) -> None:
    near, far = (
        searched(ways, ways._terms, np.zeros(4), 0.0, (unseen_m,), near=too_near(0.6), often=often)[
            0
        ]
        for unseen_m in (0.2, 30.0)
    )
    assert near > 0 > far


@pytest.mark.parametrize("seed", range(20))
def test_no_place_is_passed_over_about_which_all_was_seen(ways, seed: int) -> None:
    """And others are where a voxel is missing so many steps from theirs: loops of one place each,
    anywhere about the vehicle, in and beyond the voxels that are looked up and in the ball that is
    declared free, by any radius; the vehicle about the middle of the window, anywhere."""
    rng = np.random.default_rng(seed)
    free = rng.random(SHAPE) < 0.5
    for _ in range(200):  # Rooms of all sizes.
        low = rng.integers(0, SHAPE)
        high = low + rng.integers(1, 40, 3)
        free[low[0] : high[0], low[1] : high[1], low[2] : high[2]] = True
    window = ways._terms.seen.window.copy()
    window[:3] = rng.integers(-300, 300, 3)
    per_m = window[3]
    middle = (window[:3] + np.array(SHAPE) / 2) / per_m
    origin = middle + rng.uniform([-15, -15, -4], [15, 15, 4])
    window[4:7], window[7] = origin + rng.uniform(-3.0, 3.0, 3), float(rng.choice([0.0, 2.5]))
    if window[7] > 0.0:  # Nothing was seen in it, and all about it.
        a, b, c = np.floor((window[4:7] - 5.0) * per_m).astype(np.int64)
        ticks = np.arange(int(10.0 * per_m))
        voxels = np.stack(np.meshgrid(a + ticks, b + ticks, c + ticks, indexing="ij"), axis=-1)
        away = np.linalg.norm((voxels + 0.5) / per_m - window[4:7], axis=-1)
        at = voxels & (np.array(SHAPE) - 1)
        free[at[..., 0], at[..., 1], at[..., 2]] = away > window[7] - np.sqrt(0.75) / per_m
    voxels = pack_voxels(free)
    space = ways._terms.seen._replace(views=NO_VIEWS, free=voxels, whole=voxels, window=window)
    terms = ways._terms._replace(seen=space, origin_m=origin)
    wide = wide_space()
    fill_in_wide(wide, terms)
    where = rng.uniform([-40, -40, -24], [40, 40, 24], (4000, 3))
    where[:1000] = window[4:7] - origin + rng.uniform(-4.0, 4.0, (1000, 3))
    where[1000:2000] *= 0.25
    places = np.column_stack([where, np.zeros(len(where))])
    count, one = len(places), np.zeros(1, dtype=np.int64)
    loops = np.arange(count)
    each = Ways(
        one - 1, one - 1, one, np.zeros(count, dtype=np.int64), loops,
        np.zeros(count, dtype=np.int64), np.arange(count + 1), np.zeros(count, dtype=np.int64),
    )  # fmt: skip
    begun = begin_at(np.zeros(4), 0.0, tips_of(each), terms)
    unknown = np.zeros(count, dtype=np.int8)
    clear, seen = np.full(1, KEEPS, dtype=np.int8), np.full(1, KEEPS, dtype=np.int8)
    radius = float(rng.uniform(0.01, 0.9))
    steps = steps_within(wide, radius, terms)
    assert steps == np.searchsorted([np.sqrt(2.75), np.sqrt(6.75)], radius * per_m)
    kept, at = set(), 0
    while at < count:
        about = (unknown, unknown, clear, seen, radius, steps, wide, space)
        at = first_wide(at, each, places, begun, np.zeros(3), *about)
        kept.add(at)
        at += 1
    truly = {n for n, place in enumerate(origin + where) if is_free(space, *place, radius)}
    assert truly <= kept
    beyond_m = window[7] + np.sqrt(3.0) * (radius + 2.1 / per_m) if window[7] > 0.0 else 0.0
    near = (np.abs(where) < [11.0, 11.0, 6.0]).all(axis=1)
    far = (np.abs(where) > [17.0, 17.0, 13.0]).any(axis=1)  # The window may end there.
    for n in np.flatnonzero(near | far).tolist():
        if np.linalg.norm(origin + where[n] - window[4:7]) > beyond_m:
            a, b, c = np.floor((origin + where[n]) * per_m).astype(np.int64).tolist()
            more = steps if near[n] else 0
            about = range(-more, more + 1)
            met = (
                (a + i, b + j, c + k)
                for i, j, k in product(about, about, about)
                # Of one step along the axes alone; of two all next to it as well.
                if sorted((abs(i), abs(j), abs(k)))[1] == 0
                or (more == MOST and max(abs(i), abs(j), abs(k)) == 1)
            )
            assert (n in kept) == all(is_voxel_marked(space.whole, window, *each) for each in met)


@pytest.mark.parametrize("seed", range(20))
def test_cells_tell_of_no_place_that_it_is_nearer_than_it_is(ways, seed: int) -> None:
    """And of most that are near that they are."""
    rng = np.random.default_rng(seed)
    count, margin_m = int(rng.integers(1, 400)), float(rng.uniform(0.2, 1.0))
    tilted = world_from_body(rng.uniform(-0.5, 0.5, 3)).T.copy()
    place, radius_m = rng.uniform(-8.0, 8.0, (count, 3)), rng.uniform(0.0, 0.8, count)
    bins, wind = bin_points(place, radius_m), rng.uniform(-0.3, 0.3, 3)
    terms = ways._terms._replace(bins=bins, grid_from_level=tilted, wind_mps=wind)
    near = too_near(margin_m)
    fill_in(near, terms)
    told = truly = 0
    pose, start_s = np.array([*rng.uniform(-2.0, 2.0, 3), 1.0]), 3.0
    for where in rng.uniform([-12, -12, -6, 0], [12, 12, 6, 4], (2000, 4))[:, None]:
        within_m = float(rng.uniform(0.5, 1.0) * margin_m)
        asked = terms._replace(margin_m=within_m / NEARLY)
        is_near = not places_are_clear(where, 0, 1, pose, start_s, asked)
        if are_near(where, 0, 1, pose, start_s, within_m, wind, near):
            told += 1
            assert is_near
        truly += is_near
    assert told >= 0.2 * truly > 0


@pytest.mark.parametrize("seed", range(12))
def test_a_way_counts_as_seen_only_where_all_that_the_body_passes_was(ways, seed: int) -> None:
    """Held against places all over the body all along the way."""
    rng = np.random.default_rng(seed)
    free = rng.random(SHAPE) < 0.999
    voxels = pack_voxels(free)
    space = ways._terms.seen._replace(views=NO_VIEWS, free=voxels, whole=voxels)
    terms = ways._terms._replace(seen=space, unseen_m=float(rng.uniform(0.05, 0.5)))
    assert terms.yaw_rad == 0.0, "level frame and world differ by a place alone"
    ball = rng.normal(size=(300, 3))
    ball *= (rng.random(300) ** (1.0 / 3.0) / np.linalg.norm(ball, axis=1))[:, None]
    seen = 0
    for _ in range(20):
        corners = rng.uniform(2.0, 6.0, 3) + np.cumsum(rng.uniform(-0.4, 0.4, (6, 3)), axis=0)
        if not was_seen(corners, 0.0, terms):
            continue
        seen += 1
        shares = np.linspace(0.0, 5.0, 51)
        along = np.stack([np.interp(shares, range(6), corners[:, axis]) for axis in range(3)], 1)
        places = terms.origin_m + (along[:, None] + terms.unseen_m * ball).reshape(-1, 3)
        a, b, c = np.floor(places * space.window[3]).astype(np.int64).T
        assert free[a % SHAPE[0], b % SHAPE[1], c % SHAPE[2]].all()
    assert seen


def movers(seed: int, count: int = 6) -> MovingHazards:
    """On all kinds of paths; the last two may turn."""
    rng = np.random.default_rng(seed)
    turns = np.where(np.arange(count) < count - 2, 0.0, 0.2)
    return MovingHazards(
        rng.uniform([2, -8, -3], [14, 8, 3], (count, 3)), rng.normal(size=(count, 3)),
        rng.uniform(0.1, 1.0, count), rng.uniform(0.0, 0.4, count), turns, np.full(count, 0.7),
    )  # fmt: skip


def only(moving: MovingHazards, k: int) -> MovingHazards:
    return MovingHazards(*(part[k : k + 1] for part in moving))


@pytest.mark.parametrize("seed", range(4))
def test_the_distance_from_many_intruders_is_the_least_of_any(seed) -> None:
    moving, rng = movers(seed), np.random.default_rng(seed)
    for _ in range(20):
        corners = np.cumsum(rng.normal(size=(5, 3)), axis=0)
        span = make_span(corners, 1.0, float(rng.uniform(2.0, 9.0)))
        each = [moving_clearance(span, only(moving, k), np.inf)[0] for k in range(6)]
        least = int(np.argmin(each))
        assert moving_clearance(span, moving, np.inf) == (each[least], 3, least)
        assert moving_clearance(span, moving, each[least] + 1e-6) == (each[least], 3, least)
        assert moving_clearance(span, moving, each[least] - 1e-6)[2] < 0


@pytest.mark.parametrize("seed", range(4))
def test_the_room_of_a_chain_is_the_least_of_its_movements(ways, seed) -> None:
    escapes, legs = ways.library.ways[0], ways.library.legs
    terms = ways._terms._replace(moving=movers(seed))
    for escape in (0, 7, 300):
        movements, pose, at, time_s = movements_of(escapes, escape), np.zeros(4), 0, 0.5
        rooms = []
        for m in movements.tolist():
            end_s = time_s + legs.duration_s[m]
            corners = carry_leg(pose, legs.path[at, m], (time_s, end_s), terms)
            span = make_span(corners @ terms.grid_from_level.T, time_s, end_s)
            rooms.append(moving_clearance(span, terms.moving, np.inf)[0] - legs.sagitta_m[at, m])
            pose, at, time_s = pose_after(pose, legs.path[at, m]), legs.following[at, m], end_s

        def room(enough: float, stop: float, chain=movements, terms=terms) -> float:
            return chain_room(chain, 0, np.zeros(4), 0.5, legs, terms, enough, stop)

        least = min(rooms)
        assert room(100.0, -np.inf) == pytest.approx(least, abs=1e-9)
        assert room(least - 1.0, -np.inf) == least - 1.0
        assert room(100.0, least - 0.1) == pytest.approx(least, abs=1e-9)
        assert least - 1e-9 <= room(100.0, least + 0.5) <= least + 0.5


def test_whether_there_is_a_way_out_does_not_depend_on_intruders(ways) -> None:
    found = set()
    for margin_m in (0.6, 1.5, 2.0, 2.5, 3.0, 4.0):
        among = copy(ways)
        among._full_m, among._after, among._left = margin_m, {}, {}
        among._terms = ways._terms._replace(moving=movers(1))
        told = [among.leaves(m) for m in range(len(ways.library.automaton.names))]
        assert told == [among.after(m) is not None for m in range(len(told))]
        among._left = {}
        assert told == [among.leaves(m) for m in range(len(told))]
        found.update(told)
    assert found == {True, False}


def test_what_is_left_after_several_movements_is_what_is_left_after_one_and_one_more() -> None:
    for way in (WayOut(("a", "b"), ("c", "d", "e"), 1.0, True, under_way_s=0.5),
                WayOut((), ("c", "d"), 1.0, True, under_way_s=0.5)):  # fmt: skip
        flown, left = list(way.begins) + 5 * list(way.loop), way
        for count in range(8):
            after = way.after(count)
            assert (after.begins, after.loop, after.under_way_s) == (
                left.begins, left.loop, left.under_way_s)  # fmt: skip
            assert left.movements[0] == flown[count]
            left = left.after_one
