"""Goal 4 of the paper: the probabilistic approach beside the deterministic one and other rivals."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

from clearway.missions.setup import FlightSetup
from clearway.sim import Run
from clearway.sim.baselines import CLEARWAY
from clearway.sim.baselines.notes import not_known
from clearway.sim.pilot import Steering
from clearway.studies.comparison import ComparedFlight, PlannerStanding, fly_all, sum_up_planner
from clearway.studies.reproduction.flights import flight_of
from clearway.studies.reproduction.target import Exhibit, Findings, Measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RIVALS = (
    "straight",
    "deterministic-reduced",
    "potential-field",
    "turn-back",
    "adaptive",
    "vfh",
    "velocity-obstacle",
    "mvp",
)
MISSIONS = (
    ("static-obstacles", "static obstacles"),
    ("intruders-collision", "intruders that collide"),
)


def comparison() -> tuple[Exhibit, ...]:
    """Every planner on the missions of 6.4 and 6.5, the latter with real collisions."""
    return tuple(_compare(mission, title) for mission, title in MISSIONS)


def _compare(mission: str, title: str) -> Exhibit:
    flight = flight_of(mission)
    flights = [
        ComparedFlight(CLEARWAY, flight.run),
        *fly_all(lambda _seed: flight.setup, RIVALS, (flight.run.seed,)),
    ]
    runs = {flown.planner: flown.run for flown in flights}
    places = {flown.planner: sum_up_planner([flown]) for flown in flights}
    judged = {name: place for name, place in places.items() if not place.hidden}
    safe = [name for name, place in judged.items() if place.safe]
    blind = "".join(
        f" {line}." for line in not_known((name, place.hidden) for name, place in places.items())
    )
    return Exhibit(
        f"Comparison {mission}",
        f"planners side by side, {title}",
        Findings(
            claim="The probabilistic approach comes nearer to obstacles than conservative and "
            "adaptive methods need to, and so outperforms them; the deterministic one is its "
            "predecessor.",
            ours=f"Safe, that is at the last waypoint and never inside a margin: {_list(safe)}. "
            f"Not safe: {_list([_fate(judged[n]) for n in judged if n not in safe])}.{blind}",
            difference="The paper compares margins, not flights; these fly the same mission with "
            "the same sensors, noise and movements. One flight each tells how, not how often: "
            "`clearway campaign` tells that.",
            measures=tuple(_measures(places)),
        ),
        partial(_draw, runs, flight.setup, f"Planners side by side: {title}"),
    )


def _list(names: list[str]) -> str:
    return ", ".join(names) if names else "none"


def _fate(place: PlannerStanding) -> str:
    if place.crashed:
        return f"{place.planner} (crashed)"
    if not place.reached:
        return f"{place.planner} (did not arrive)"
    return f"{place.planner} (came within {place.min_distance_m:.2f} m of a surface)"


def _measures(places: Mapping[str, PlannerStanding]) -> list[Measure]:
    measures: list[Measure] = []
    for name, place in places.items():
        if not place.hidden:
            nearest_m = place.min_distance_m
            measures.append(Measure(f"{name}: smallest distance to a surface, m", nearest_m))
            measures.append(Measure(f"{name}: margin violations", place.margin_violations))
        if place.reached:
            measures.append(Measure(f"{name}: time of flight, s", place.time_s))
    return measures


def _draw(runs: Mapping[str, Run[Steering]], setup: FlightSetup, title: str) -> Figure:
    from clearway.studies.figures.comparison import draw_tracks

    return draw_tracks(runs, setup.world, title)
