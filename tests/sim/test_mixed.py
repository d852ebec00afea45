"""Obstacles, map and traffic at once, and traffic that only a LiDAR sees."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from clearway.avoidance.clear.verify import path_clearance
from clearway.base.errors import InputError
from clearway.base.state import State
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile, list_built_in_missions, read_mission_file
from clearway.missions.setup import FlightSetup, prepare
from clearway.missions.world_file import read_mission
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import simulate_scan
from clearway.sim import LoggedDecision, Run
from clearway.sim.scripted import ScriptedIntruder, Traffic
from clearway.sim.worlds import WORLD_FAMILIES
from worlds_for_tests import LIDAR, mission

MARGIN_M, RADIUS_M = 0.6, 0.6


@lru_cache
def setup(escape: str = "off") -> FlightSetup:
    mixed = prepare(read_mission_file("mixed"))
    settings = replace(mixed.planner.settings, escape=escape)
    return replace(mixed, planner=replace(mixed.planner, settings=settings))


@lru_cache
def flown(seed: int, escape: str = "off") -> Run:
    mixed = setup(escape)
    return replace(mixed, simulation=replace(mixed.simulation, seed=seed)).fly()


@pytest.mark.parametrize(
    ("seed", "escape"),
    [
        (0, "off"),
        (0, "strict"),
        (1, "strict"),
        (3, "off"),
        (11, "strict"),
    ],
)
def test_the_mixed_mission_keeps_both_margins(seed: int, escape: str) -> None:
    run = flown(seed, escape)
    assert run.reached
    assert run.metrics.min_obstacle_distance_m >= MARGIN_M
    assert run.metrics.intruders is not None
    assert len(run.metrics.intruders.names) == 3
    assert run.metrics.intruders.min_distance_m >= MARGIN_M + RADIUS_M
    assert run.emergencies == 0


def test_straight_flight_would_meet_everything() -> None:
    times = np.arange(0.0, 66.0, 0.05)
    straight = times[:, None] * [1.0, 0.0, 0.0]
    assert setup().world.distance_m(straight).min() < 0.0
    for scripted in setup().script:
        track = scripted.position_m + (times - scripted.appears_s)[:, None] * scripted.velocity_mps
        assert np.linalg.norm(track - straight, axis=1).min() < 0.1


def known(run: Run) -> set[str]:
    """Who is reckoned with at any decision of a flight."""
    return {name for entry in run.decisions for name in entry.flight.decision.intruders}


def test_without_following_nobody_knows_of_the_silent_one() -> None:
    there = setup()
    run = replace(there, planner=there.planner.with_values(follow_movers=False)).fly()
    assert known(run)
    assert known(run) < known(flown(0))


def test_where_traffic_rules_ways_out_the_one_taken_keeps_clear_of_trees_too() -> None:
    among = [entry for entry in flown(0).decisions if entry.flight.decision.passings]
    assert among
    for entry in among:
        decision = entry.flight.decision
        path = path_clearance(decision.prepared.paths, decision.choice.node, decision.hazards)
        assert path.distance_m >= decision.margin_m


def in_sight(entry: LoggedDecision, place_m: np.ndarray) -> bool:
    """Whether anything of a body there can be seen past the obstacles."""
    own = entry.flight.decision.state.position_m
    rng = np.random.default_rng(0)
    offsets = rng.normal(size=(200, 3))
    surface = place_m + RADIUS_M * offsets / np.linalg.norm(offsets, axis=1, keepdims=True)
    ways = surface - own
    far = np.linalg.norm(ways, axis=1)
    free = setup().world.cast(own, ways / far[:, None], 100.0)
    return bool((free >= far).any())


def place_of(name: str, entry: LoggedDecision) -> np.ndarray:
    """[3] where an intruder truly is at a decision."""
    track = flown(0).intruder_tracks[name]
    return track[np.searchsorted(track[:, 0], entry.flight.time_s - 1e-6), 1:]


def test_a_hidden_intruder_counts_though_nothing_sees_it() -> None:
    reckoned_with = by_name = 0
    for entry in flown(0).decisions:
        decision = entry.flight.decision
        if "hidden" not in decision.intruders or in_sight(entry, place_of("hidden", entry)):
            continue
        there = decision.frame.grid_points(place_of("hidden", entry))
        number = decision.intruders.index("hidden")
        np.testing.assert_allclose(decision.hazards.moving.position_m[number], there, atol=1e-6)
        evidence = decision.cells.evidence
        reckoned_with += 1
        by_name += any(one.name == "hidden" for one in decision.passings)
        cell = int(evidence.grid.cell_of(there[None])[0])
        if cell >= 0:
            assert evidence.visibility[cell] < 0.5
            assert evidence.intruder[cell] > 0.9
            assert decision.cells.rating[cell] < 0.1
    assert reckoned_with >= 2
    assert by_name >= 1, "it is being passed before anything sees it"


def test_what_the_lidar_adds_is_the_silent_one_alone() -> None:
    added = 0
    for entry in flown(0).decisions:
        decision = entry.flight.decision
        for name, place in zip(decision.intruders, decision.hazards.moving.position_m, strict=True):
            if name.startswith("lidar"):
                added += 1
                found = decision.frame.world_points(place)
                assert np.linalg.norm(found - place_of("silent", entry)) < 0.4
    assert added >= 5


def intruder(**more: object) -> dict[str, object]:
    section = {"name": "a", "appears_s": 0.0, "position_m": [5, 0, 0], "velocity_mps": [0, 1, 0]}
    return section | more


def mission_with(**more: object) -> MissionFile:
    tables = {"mission": {"name": "m", "waypoints_m": [[20, 0, 0]]}, "intruder": [intruder(**more)]}
    return parse_model("test", tables, MissionFile)


def test_lidars_see_intruders_that_do_not_report_themselves() -> None:
    for said, seen in (
        ({}, False),
        ({"transponder": False, "radius_m": 1.0}, True),
        ({"visible": True, "radius_m": 1.0}, True),
        ({"transponder": False, "visible": False}, False),
    ):
        assert mission_with(**said).intruder[0].seen_by_lidar is seen


def test_the_ownships_own_name_is_no_intruders() -> None:
    """Its reports would be taken for echoes of the own transponder."""
    with pytest.raises(InputError, match="'ownship' is what the ownship calls itself"):
        mission_with(name="ownship")


def test_what_a_lidar_sees_needs_a_size() -> None:
    with pytest.raises(InputError, match="radius_m must be above 0"):
        mission_with(transponder=False)


def test_silent_traffic_reports_nothing_and_is_seen_where_it_was() -> None:
    scripted = ScriptedIntruder(
        "silent",
        1.0,
        np.array([6.0, 0.0, 0.0]),
        np.array([0.0, 1.0, 0.0]),
        radius_m=0.5,
        spawn="world",
        transponder=False,
        visible=True,
    )
    traffic = Traffic([scripted], mission((20, 0, 0)), 1.0)
    for step in range(61):
        traffic.step(State(np.zeros(3), time_s=0.05 * step))
        assert traffic.reports(0.05 * step) == []
    assert traffic.bodies(0.5) == []
    for time_s, across in ((1.0, 0.0), (2.5, 1.5)):
        (body,) = traffic.bodies(time_s)
        np.testing.assert_allclose(body.position_m, [6.0, across, 0.0], atol=1e-9)
        scan = simulate_scan(LIDAR, ObstacleMap([body]), State(np.zeros(3)))
        assert abs(scan.points_m[:, 1].mean() - across) < 0.1


def test_no_made_up_world_takes_the_name_of_a_mission() -> None:
    assert not set(WORLD_FAMILIES) & set(list_built_in_missions())
    for name in list_built_in_missions():
        assert read_mission(name).effective() == read_mission_file(name).effective()
