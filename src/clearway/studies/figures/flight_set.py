"""All pictures of a flight by file name, in the order of figs. 6.14-6.22."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from clearway.base.checks import kind_of, time_problem
from clearway.base.errors import ClearwayError
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import World
from clearway.sim import Run, is_clearway_run
from clearway.sim.pilot import Steering
from clearway.studies.figures.comparison import draw_tracks
from clearway.view.plot.assessment import assessment_figures
from clearway.view.plot.flight import draw_snapshot, snapshot_decisions
from clearway.view.plot.flight_curves import Margins, draw_obstacle_distance, draw_tracking
from clearway.view.plot.notebook import for_notebooks
from clearway.view.plot.speed_flight import draw_speed_flight, draw_speed_moment, has_speeds
from clearway.view.plot.traffic import draw_collision_distance, draw_traffic, first_detection


def draw_flight(
    run: Run[Steering], at_s: float | None = None, *, title: str | None = None
) -> Figure:
    """Draw a flight: the way flown, what was seen and what was there, from above too.

    A notebook shows the figure, `savefig` of it writes a file.

    Parameters
    ----------
    run
        What `fly` or `simulate` gave.
    at_s
        Show the flight up to its last decision at that time in seconds, with plan and field of
        view; by default all of it.
    title
        Above the picture; by default mission and time.

    Returns
    -------
    Figure
        Of matplotlib; lengths are metres in the world frame.

    Raises
    ------
    ClearwayError
        Where no decision is that early, and for a moment of a planner that has no plan to show.

    Examples
    --------
    >>> import clearway as cw
    >>> run = cw.fly("static-obstacles")
    >>> cw.draw_flight(run).savefig("flight.png")
    >>> cw.draw_flight(run, 20.0).savefig("at-20-s.png")
    """
    kind_of("draw_flight", run, Run)
    if at_s is not None and (problem := time_problem("at_s", at_s)):
        raise ClearwayError(problem)
    name, world = run.mission.name, run.world or ObstacleMap()
    if not is_clearway_run(run) or not run.decisions:
        if at_s is not None:
            raise ClearwayError(f"at_s: planner {run.planner} tells of no plan; draw all of it")
        whole = title or f"{name} by {run.planner}: the whole flight"
        return for_notebooks(draw_tracks({run.planner: run}, world, whole))
    index = None if at_s is None else _last_decision(run, at_s)
    title = title or f"{name}: " + ("the whole flight" if at_s is None else f"at {at_s:g} s")
    if run.intruder_tracks:
        return for_notebooks(draw_traffic(run, index, title, world))
    return for_notebooks(_draw(run, index, title))


def _draw(run: Run, index: int | None, title: str) -> Figure:
    """A moment of a flight, or all of it; of a vehicle with inertia by its speed."""
    if not has_speeds(run):
        return draw_snapshot(run, index, title)
    return draw_speed_flight(run, title) if index is None else draw_speed_moment(run, index, title)


def _last_decision(run: Run, at_s: float) -> int:
    """Index of the last decision at or before a time."""
    times = np.array([entry.flight.time_s for entry in run.decisions])
    before = int(np.searchsorted(times, at_s + 1e-9)) - 1
    if before < 0:
        raise ClearwayError(f"at_s: no decision up to {at_s:g} s; the first is at {times[0]:g} s")
    return before


def flight_figures(
    run: Run, margins: Margins, world: World, kept_out: World | None = None
) -> Iterator[tuple[str, Figure]]:
    """(name, figure) one by one: snapshots, assessment at the first, distances, tracking.

    kept_out: volumes that rules keep out of.
    """
    name = run.mission.name
    snapshots = snapshot_decisions(run)
    for number, index in enumerate(snapshots, start=1):
        when = run.decisions[index].flight.time_s
        title = f"{name}: passing obstacles, {number} of {len(snapshots)}, at {when:.1f} s"
        yield f"snapshot-{number}", _draw(run, index, title)
    detected = first_detection(run)
    if detected is not None:
        when = run.decisions[detected].flight.time_s
        title = f"{name}: first intruder detected at {when:.1f} s"
        whole = f"{name}: the whole flight"
        yield "traffic-first", draw_traffic(run, detected, title, world, kept_out)
        yield "traffic", draw_traffic(run, None, whole, world, kept_out)
        yield "collision-distance", draw_collision_distance(run)
    else:
        yield "flight", _draw(run, None, f"{name}: the whole flight")
    telling = detected if detected is not None else next(iter(snapshots), None)
    if telling is not None:
        yield from _panels(run, telling).items()
    if np.isfinite(run.metrics.obstacle_distance_m).all():
        yield "obstacle-distance", draw_obstacle_distance(run, margins)
    yield "tracking", draw_tracking(run)


def track_figures(
    run: Run[Steering], world: World, margins: Margins
) -> Iterator[tuple[str, Figure]]:
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
    return assessment_figures(
        decision.cells,
        decision.reach,
        decision.prepared.reach_set,
        decision.frame.grid_points(decision.seen_m),
        f"{run.mission.name} at {entry.flight.time_s:.1f} s",
    )
