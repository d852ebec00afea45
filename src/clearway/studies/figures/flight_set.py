"""All pictures of a flight by file name, in the order of figs. 6.14-6.22."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from clearway.obstacles.world import World
from clearway.sim import Run
from clearway.sim.pilot import Steering
from clearway.studies.figures.comparison import draw_tracks
from clearway.view.plot.assessment import draw_assessment
from clearway.view.plot.flight import (
    Margins,
    draw_obstacle_distance,
    draw_snapshot,
    draw_tracking,
    snapshot_decisions,
)
from clearway.view.plot.traffic import draw_collision_distance, draw_traffic, first_detection


def draw_flight(
    run: Run, margins: Margins, world: World, kept_out: World | None = None
) -> Iterator[tuple[str, Figure]]:
    """(name, figure) one by one: snapshots, assessment at the first, distances, tracking.

    kept_out: volumes that rules keep out of.
    """
    name = run.mission.name
    snapshots = snapshot_decisions(run)
    for number, index in enumerate(snapshots, start=1):
        when = run.decisions[index].flight.time_s
        title = f"{name}: approach {number} at {when:.1f} s"
        yield f"snapshot-{number}", draw_snapshot(run, index, title)
    detected = first_detection(run)
    if detected is not None:
        when = run.decisions[detected].flight.time_s
        title = f"{name}: first intruder detected at {when:.1f} s"
        whole = f"{name}: the whole flight"
        yield "traffic-first", draw_traffic(run, detected, title, world, kept_out)
        yield "traffic", draw_traffic(run, None, whole, world, kept_out)
        yield "collision-distance", draw_collision_distance(run)
    else:
        yield "flight", draw_snapshot(run, None, f"{name}: the whole flight")
    telling = detected if detected is not None else next(iter(snapshots), None)
    if telling is not None:
        yield from _panels(run, telling).items()
    if np.isfinite(run.metrics.obstacle_distance_m).all():
        yield "obstacle-distance", draw_obstacle_distance(run, margins)
    yield "tracking", draw_tracking(run)


def draw_track(run: Run[Steering], world: World, margins: Margins) -> Iterator[tuple[str, Figure]]:
    """(name, figure) of a flight by another planner: what needs no assessment of cells."""
    name = run.mission.name
    yield "flight", draw_tracks({"flown": run}, world, f"{name}: the whole flight")
    if run.metrics.intruders is not None:
        yield "collision-distance", draw_collision_distance(run)
    if np.isfinite(run.metrics.obstacle_distance_m).all():
        yield "obstacle-distance", draw_obstacle_distance(run, margins)
    yield "tracking", draw_tracking(run)


def _panels(run: Run, index: int) -> dict[str, Figure]:
    """Reachability, obstacle and visibility at one decision."""
    entry = run.decisions[index]
    decision = entry.flight.decision
    return draw_assessment(
        decision.cells,
        decision.reach,
        decision.prepared.reach_set,
        decision.hazards.points.position_m,
        f"{run.mission.name} at {entry.flight.time_s:.1f} s",
    )
