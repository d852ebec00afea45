"""A budget of unobserved metres: no escape spends more, and nothing seen to stand is crossed."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pytest

from clearway.avoidance.clear.hazards import bin_points
from clearway.avoidance.escape.beginnings import tips_of
from clearway.avoidance.escape.chains import chain_keeps, measure_unobserved
from clearway.avoidance.escape.finder import WaysOut
from clearway.avoidance.escape.legs import (
    EscapeTerms,
    carry_leg,
    leg_keeps_margin,
    leg_room,
    pose_after,
)
from clearway.avoidance.escape.library_search import Beginning
from clearway.avoidance.escape.places import loop_places
from clearway.avoidance.escape.search import first_escape, movements_of
from clearway.avoidance.escape.terms import count_unobserved_places
from clearway.avoidance.escape.too_near import too_near
from clearway.avoidance.escape.wide_space import OFTEN, wide_space
from clearway.avoidance.plan.evidence import gather_in_reach
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import IntArray, State
from clearway.live import AvoidanceSystem
from clearway.reach.escapes.legs import Legs
from clearway.reach.store import ReachLibrary
from clearway.sensors import simulate_scan
from clearway.sensors.observed.free_space import SHAPE
from clearway.sensors.observed.free_voxels import pack_voxels
from clearway.sensors.observed.range_views import NO_VIEWS
from clearway.vehicle.automaton import MovementAutomaton
from worlds_for_tests import LIDAR, mission, planner, static_world

Bools3 = npt.NDArray[np.bool_]
STRICT = planner()
BUDGETS_M = (1.0, 4.0, 9.0)
SHARES = (np.arange(12)[:, None] + 0.5) / 12.0
"""Of a chord, at which the tests look; as many on either side of its middle."""


def ways_of(who: Planner) -> WaysOut:
    """What is known after a few movements straight on towards a ball."""
    system = AvoidanceSystem(who, mission((40.0, 0.0, 0.0)), lidars=(LIDAR,))
    for at in range(4):
        here = State(np.array([float(at), 0.0, 0.0]), time_s=float(at))
        system.update(here)
        system.update(simulate_scan(LIDAR, static_world(), here))
        situation = system.situation(float(at))[0]
    assert who.escapes is not None
    return WaysOut(system.planner, who.escapes, situation, gather_in_reach(who, situation))


@pytest.fixture(scope="module")
def ways() -> WaysOut:
    return ways_of(STRICT)


def with_budget(terms: EscapeTerms, budget_m: float) -> EscapeTerms:
    return terms._replace(
        unobserved_m=budget_m, unseen_places=count_unobserved_places(budget_m, STRICT.automaton)
    )


def holes(ways: WaysOut, rng: np.random.Generator) -> tuple[EscapeTerms, Bools3]:
    """All seen but for some boxes about the vehicle; also voxel by voxel."""
    free = np.ones(SHAPE, dtype=np.bool_)
    per_m = ways._terms.seen.window[3]
    for _ in range(int(rng.integers(10, 200))):
        low = (ways._terms.origin_m + rng.uniform([-9, -9, -3], [9, 9, 3])) * per_m
        size = rng.integers(1, 12, 3)
        ticks = [(int(low[axis]) + np.arange(size[axis])) % SHAPE[axis] for axis in range(3)]
        free[np.ix_(*ticks)] = False
    voxels = pack_voxels(free)
    window = ways._terms.seen.window.copy()
    window[7] = 0.0  # Nothing is declared free.
    space = ways._terms.seen._replace(views=NO_VIEWS, free=voxels, whole=voxels, window=window)
    return ways._terms._replace(seen=space), free


def unseen_metres(
    movements: IntArray, pose: FloatArray, legs: Legs, terms: EscapeTerms, free: Bools3
) -> float:
    """Metres of a chain of whose tube some place lies in a voxel that was not seen: by places of
    the tests' own, on discs across the way, in still air."""
    angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    radii_m = terms.unseen_m * np.array([0.0, 0.5, 1.0])
    metres, at, width = 0.0, 0, 1.0 / terms.seen.window[3]
    for m in movements.tolist():
        corners = carry_leg(pose, legs.path[at, m], (0.0, 0.0), terms)
        for a, b in pairwise(corners):
            along = (b - a) / np.linalg.norm(b - a)
            left = np.array([-along[1], along[0], 0.0]) / np.hypot(along[0], along[1])
            ring = np.outer(np.cos(angles), left) + np.outer(np.sin(angles), np.cross(along, left))
            disc = (radii_m[:, None, None] * ring).reshape(-1, 3)
            places = (terms.origin_m + a + SHARES * (b - a))[:, None] + disc
            touched = np.floor(places / width).astype(np.int64) % np.array(SHAPE)
            unseen = ~free[tuple(touched.transpose(2, 0, 1))]
            metres += float(np.linalg.norm(b - a)) * float(unseen.any(axis=1).mean())
        pose, at = pose_after(pose, legs.path[at, m]), int(legs.following[at, m])
    return metres


def searched(ways: WaysOut, terms: EscapeTerms, pose: FloatArray, *, often: bool) -> int:
    escapes, legs, wide = ways.library.ways[0], ways.library.legs, wide_space()
    wide.looked[0] = OFTEN if often else 0
    about = (terms, np.array([terms.unseen_m]), too_near(terms.margin_m), wide)
    laid_out = loop_places(escapes, legs), tips_of(escapes)
    return first_escape(escapes, legs, *laid_out, 0, pose, 0.0, *about)[0]


@pytest.mark.parametrize(
    "seed", [*range(4), *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(4, 8))]
)
@pytest.mark.parametrize("often", [False, True])
def test_no_escape_crosses_more_than_its_budget(ways, seed: int, often: bool) -> None:
    """By places of the tests' own; and some spend more than none, so that this can fail."""
    rng = np.random.default_rng([seed, 54])
    legs, spent = ways.library.legs, 0
    for _ in range(12):
        terms, free = holes(ways, rng)
        pose = np.array([0.5, 0.0, 0.0, float(rng.uniform(-0.5, 0.5))])
        for budget_m in BUDGETS_M:
            asked = with_budget(terms, budget_m)
            found = searched(ways, asked, pose, often=often)
            if found < 0:
                continue
            movements = movements_of(ways.library.ways[0], found)
            told = measure_unobserved(movements, 0, pose, 0.0, legs, asked)
            truly = unseen_metres(movements, pose, legs, asked, free)
            assert truly <= told + 1e-9 <= budget_m + 2e-9
            assert chain_keeps(movements, 0, pose, 0.0, legs, asked)
            spent += truly > 0.0
    assert spent


@pytest.mark.parametrize("seed", range(6))
def test_a_budget_finds_an_escape_wherever_there_is_one_without(ways, seed: int) -> None:
    rng = np.random.default_rng([seed, 55])
    more = 0
    for _ in range(12):
        terms, pose = holes(ways, rng)[0], np.array([0.5, 0.0, 0.0, 0.0])
        strict = searched(ways, terms, pose, often=False)
        wider = searched(ways, with_budget(terms, 4.0), pose, often=False)
        assert wider >= 0 or strict < 0
        more += wider >= 0 and strict < 0
    assert more


@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_spent_where_an_escape_is_all_seen(ways, seed: int) -> None:
    """And what a decision takes is then the same as without a budget."""
    rng = np.random.default_rng([seed, 56])
    for _ in range(8):
        terms, _ = holes(ways, rng)
        start = Beginning(0, np.array([0.5, 0.0, 0.0, 0.0]), 0.0, ways.library.legs)
        distances = np.array([terms.margin_m, terms.unseen_m])
        strict, kept_m = ways._search.first(start, terms, distances)
        budgeted, also_m = ways._search.first(start, with_budget(terms, 4.0), distances)
        if strict is not None:
            assert budgeted is not None
            assert (budgeted.movements, also_m) == (strict.movements, kept_m)
            assert budgeted.unobserved_m == 0.0


@pytest.mark.parametrize("seed", range(6))
def test_what_was_seen_to_stand_is_never_crossed(ways, seed: int) -> None:
    """Returns in space that nobody saw to be free are kept clear of by the margin, whatever the
    budget."""
    rng = np.random.default_rng([seed, 57])
    legs, met = ways.library.legs, 0
    for _ in range(12):
        terms = with_budget(holes(ways, rng)[0], 30.0)
        places = rng.uniform([-9.0, -9.0, -3.0], [9.0, 9.0, 3.0], (40, 3))
        places = places[np.linalg.norm(places, axis=1) > 1.5]
        terms = terms._replace(
            bins=bin_points(places, np.full(len(places), 0.05)), grid_from_level=np.eye(3)
        )
        pose, at, room = np.array([0.5, 0.0, 0.0, 0.0]), 0, leg_room(8, terms.shapes)
        found = searched(ways, terms, pose, often=False)
        if found < 0:
            continue
        for m in movements_of(ways.library.ways[0], found).tolist():
            path, sagitta_m = legs.path[at, m], float(legs.sagitta_m[at, m])
            corners = carry_leg(pose, path, (0.0, 0.0), terms)
            shares = np.linspace(0.0, 1.0, 20)[:, None, None]
            along = (corners[:-1] + shares * np.diff(corners, axis=0)).reshape(-1, 3)
            away_m = np.linalg.norm(along[:, None] - places, axis=2).min() - 0.05
            assert away_m >= terms.margin_m - 1e-6
            assert leg_keeps_margin(pose, path, sagitta_m, (0.0, 0.0), terms, room)
            pose, at = pose_after(pose, path), int(legs.following[at, m])
        met += 1
    assert met


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("share", [0.0, 0.25])
def test_the_body_keeps_off_all_that_is_known_where_it_can(ways, seed: int, share: float) -> None:
    """About what was hit nothing is seen to be free: a budget does not lead into that."""
    rng = np.random.default_rng([seed, 58])
    legs, spent = ways.library.legs, 0
    start = Beginning(0, np.array([0.5, 0.0, 0.0, 0.0]), 0.0, legs)
    for _ in range(12):
        terms = with_budget(holes(ways, rng)[0], 30.0)
        places = rng.uniform([-9.0, -9.0, -3.0], [9.0, 9.0, 3.0], (200, 3))
        places = places[np.linalg.norm(places, axis=1) > 1.5]
        terms = terms._replace(
            bins=bin_points(places, np.full(len(places), 0.05)),
            grid_from_level=np.eye(3),
            margin_m=share * terms.margin_m,
            unseen_m=0.3,
        )
        found, _ = ways._search.first(start, terms, np.array([terms.unseen_m]))
        if found is None or found.unobserved_m == 0.0:
            continue
        along_m = found.path_m - terms.origin_m
        away_m = np.linalg.norm(along_m[:, None] - places, axis=2).min() - 0.05
        assert away_m >= found.margin_m - 1e-6
        begins = ways._search.numbers(found.begins)
        again = ways._search.keep_held(found, begins, start, terms)
        assert again is not None
        assert again.margin_m == found.margin_m
        clear = terms._replace(margin_m=terms.unseen_m)
        if found.margin_m < terms.unseen_m:
            assert ways._search.first(start, clear, np.array([terms.unseen_m]))[0] is None
        hit = bin_points(along_m[len(along_m) // 2][None], np.full(1, 0.05))
        assert ways._search.keep_held(found, begins, start, terms._replace(bins=hit)) is None
        spent += found.margin_m == terms.unseen_m
    assert spent


def test_the_first_movement_is_all_seen_whatever_the_budget(ways) -> None:
    """Only the escape behind it may spend."""
    generous = ways_of(replace(STRICT, settings=replace(
        STRICT.settings, escape="budgeted", unobserved_m=1e3)))  # fmt: skip
    left = ways.library.automaton.names.index("Left")
    assert generous.after(left) is not None
    blind, _ = holes(ways, np.random.default_rng(0))
    nothing = np.zeros_like(blind.seen.free)
    space = blind.seen._replace(free=nothing, whole=nothing)
    generous._terms = generous._terms._replace(seen=space)
    generous._after = {}
    assert all(generous.after(m) is None for m in range(len(ways.library.automaton.names)))
    assert generous.now() is not None


def test_who_stays_where_nobody_has_looked_is_never_few_metres_off() -> None:
    """A stop crosses no metre, but the body is there for ever."""
    automaton = MovementAutomaton.inertialess(speed_mps=1.0)
    library = ReachLibrary.load_or_build(automaton, AvoidanceGrid.uniform())
    who = Planner.of(library, AvoidanceSettings(escape="budgeted", unobserved_m=50.0))
    looked = ways_of(who)
    nothing = np.zeros_like(looked._terms.seen.free)
    window = looked._terms.seen.window.copy()
    window[7] = 0.0
    space = looked._terms.seen._replace(free=nothing, whole=nothing, views=NO_VIEWS, window=window)
    looked._terms = looked._terms._replace(seen=space)
    way = looked.now()
    assert way is None or way.loop != ("Hold",)


def test_a_budget_is_refused_where_it_has_no_meaning() -> None:
    with pytest.raises(InputError, match="unobserved_m: above 0 where escape is"):
        AvoidanceSettings(unobserved_m=4.0)
    with pytest.raises(InputError, match="unobserved_m"):
        AvoidanceSettings(escape="budgeted")
    with pytest.raises(InputError, match="unobserved_m"):
        AvoidanceSettings(escape="budgeted", unobserved_m=-1.0)
    copter = MovementAutomaton.multirotor(speed_mps=3.0)
    library = ReachLibrary.load_or_build(copter, AvoidanceGrid.uniform())
    with pytest.raises(InputError, match="a vehicle with inertia brakes to rest"):
        Planner.of(library, AvoidanceSettings(escape="budgeted", unobserved_m=4.0))
