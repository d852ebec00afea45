"""All pictures of a flight by file name, in the order of figs. 6.14-6.22."""

from __future__ import annotations

from collections.abc import Iterator

from matplotlib.figure import Figure

from clearway.plot.assessment import draw_assessment
from clearway.plot.flight import (
    Margins,
    draw_obstacle_distance,
    draw_snapshot,
    draw_tracking,
    snapshot_decisions,
)
from clearway.simulation import Run


def draw_flight(run: Run, margins: Margins) -> Iterator[tuple[str, Figure]]:
    """(name, figure) one by one: snapshots, assessment of the first of them, distance, tracking."""
    name = run.mission.name
    snapshots = snapshot_decisions(run)
    for number, index in enumerate(snapshots, start=1):
        when = run.decisions[index].flight.time_s
        title = f"{name}: approach {number} at {when:.1f} s"
        yield f"snapshot-{number}", draw_snapshot(run, index, title)
    yield "flight", draw_snapshot(run, None, f"{name}: the whole flight")
    if snapshots:
        entry = run.decisions[snapshots[0]]
        decision = entry.flight.decision
        panels = draw_assessment(
            decision.cells,
            decision.reach,
            decision.repertoire.reach_set,
            decision.hazards.points.position_m,
            f"{name} at {entry.flight.time_s:.1f} s",
        )
        yield from panels.items()
    yield "obstacle-distance", draw_obstacle_distance(run, margins)
    yield "tracking", draw_tracking(run)
