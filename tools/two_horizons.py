"""A mission of two horizons, seed by seed: `python -m tools.two_horizons --journal flights.jsonl`.

Whether both margins are kept, that of obstacles and the volumes of traffic; how often the side is
changed; and what the long range adds to a decision: every decision is taken twice, once
without volumes, and the difference in time of a core is what they add. A journal goes on
where it was cut off; `--write` puts the table into docs/volumes.md.
"""

from __future__ import annotations

import argparse
import gc
import json
import statistics
import time
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.avoidance import decide as decided
from clearway.avoidance.choose.candidates import Commitment
from clearway.avoidance.decision import Decision
from clearway.avoidance.long_range.resolve import PassingSide
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation
from clearway.base.intervals import wilson
from clearway.io.marked_page import put_between_marks
from clearway.live import system
from clearway.live.outputs.alerting import TrafficPicture, traffic_picture
from clearway.live.outputs.flight_decision import FlightDecision
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import prepare
from clearway.sim import Run

MISSION = Path("examples/missions/wood-and-circuit.toml")
PAGE, MARK = Path("docs/volumes.md"), "two-horizons"
UP_TO_MS = 3.0
"""What may be added to a decision."""
WHOLE = 2
"""Generation of the garbage collector's whole collections."""
AGAIN = 3
"""Times that a decision with more is taken once more."""


class Look(NamedTuple):
    """A decision with an aircraft about, taken with volumes and without."""

    decision: Decision
    more_ms: float
    again_ms: float | None
    """The least that it took more when taken again; None where it took little."""
    collected: bool
    """Whether Python collected all its garbage meanwhile."""


def flown(file: MissionFile, seed: int) -> dict[str, Any]:
    """One flight, and what is asked of it."""
    looks: list[Look] = []
    pictures_ms: list[float] = []
    full: list[int] = []

    def collecting(_phase: str, told: dict[str, int]) -> None:
        full.extend(n for n in [told["generation"]] if n == WHOLE)

    def twice(planner: Planner, situation: Situation, commitment: Commitment | None) -> Decision:
        if not situation.intruders:
            return decided(planner, situation, commitment=commitment)
        alone = planner.with_values(volumes=None)

        def added() -> tuple[float, Decision]:
            took: dict[bool, float] = {}
            decisions: dict[bool, Decision] = {}
            # What comes second finds much in the processor's memory: it is each in turn.
            for volumes in (True, False)[:: 1 if len(looks) % 2 else -1]:
                began = time.thread_time()
                found = decided(planner if volumes else alone, situation, commitment=commitment)
                took[volumes] = 1e3 * (time.thread_time() - began)
                decisions[volumes] = found
            return took[True] - took[False], decisions[True]

        full.clear()
        more_ms, decision = added()
        collected = bool(full)
        # Where it is much: is it the decision, or the moment?
        again_ms = min(added()[0] for _ in range(AGAIN)) if more_ms > UP_TO_MS else None
        looks.append(Look(decision, more_ms, again_ms, collected))
        return decision

    def pictured(*given: Any) -> TrafficPicture:
        began = time.thread_time()
        picture = traffic_picture(*given)
        pictures_ms.append(1e3 * (time.thread_time() - began))
        return picture

    gc.callbacks.append(collecting)
    system.decide, system.traffic_picture = twice, pictured  # type: ignore[assignment, attr-defined]
    try:
        run = prepare(file.with_values("simulation", seed=seed)).fly_with("clearway")
    finally:
        gc.callbacks.remove(collecting)
        system.decide, system.traffic_picture = decided, traffic_picture  # type: ignore[attr-defined]
    taken = {
        id(entry.flight.decision)
        for entry in run.decisions
        if isinstance(entry.flight, FlightDecision)
    }
    looks = [look for look in looks if id(look.decision) in taken]
    sides = [
        choice.side
        for entry in run.decisions
        if isinstance(entry.flight, FlightDecision)
        and (choice := entry.flight.decision.long_range) is not None
        and choice.wanted_tier
    ]
    return {
        "seed": seed,
        "reached": run.reached,
        "crashed": run.crashed_s is not None,
        "obstacle_m": run.metrics.min_obstacle_distance_m,
        "margin_m": run.safety_margin_m,
        "entered": entered(run, file),
        "intruder_m": None
        if run.metrics.intruders is None
        else run.metrics.intruders.min_distance_m,
        "side_changes": changes(sides),
        "decisions": len(run.decisions),
        "with_aircraft": len(looks),
        "added_ms": [round(look.more_ms, 3) for look in looks],
        "again_ms": [round(look.again_ms, 3) for look in looks if look.again_ms is not None],
        "collected_ms": [round(look.more_ms, 3) for look in looks if look.collected],
        "pictures_ms": [round(one, 3) for one in pictures_ms],
        "path_m": run.metrics.path_length_m,
        "time_s": run.metrics.time_s,
    }


def changes(sides: Iterable[PassingSide]) -> int:
    """From left to right or back, straight ahead between them or not."""
    kept = [side for side in sides if side is not PassingSide.AHEAD]
    return sum(one is not other for one, other in pairwise(kept))


def entered(run: Run[Any], file: MissionFile) -> list[str]:
    """Names of the volumes, without their buffers, that an aircraft truly was in."""
    inside = set()
    volumes = file.to_volumes()
    assert volumes is not None  # The mission has some.
    for track in run.intruder_tracks.values():
        own_m = np.stack(
            [np.interp(track[:, 0], run.time_s, run.states[:, axis]) for axis in range(3)], axis=1
        )
        off = track[:, 1:] - own_m
        aside, above = np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])
        for volume in volumes.volumes:
            if np.any((aside < volume.radius_m) & (above < volume.half_height_m)):
                inside.add(volume.name)
    return sorted(inside)


def table(rows: list[dict[str, Any]], name: str) -> str:
    """What came of the flights, as Markdown."""
    n = len(rows)

    def share(kept: Iterable[bool]) -> str:
        count = sum(kept)
        low, high = wilson(count, n)
        return f"{count} of {n} | {100 * low:.1f} to {100 * high:.1f} %"

    added = [one for row in rows for one in row["added_ms"]]
    pictures = [one for row in rows for one in row["pictures_ms"]]
    over = sum(one > UP_TO_MS for one in added)
    less = sum(one < -UP_TO_MS for one in added)
    again = [one for row in rows for one in row["again_ms"]]
    still = sum(one > UP_TO_MS for one in again)
    collected = sum(abs(one) > UP_TO_MS for row in rows for one in row["collected_ms"])
    low, high = wilson(len(added) - over, len(added))
    clear = [row["obstacle_m"] for row in rows]
    apart = [row["intruder_m"] for row in rows]
    lines = [
        f"| `{name}`, {n} seeds | flights | 95 % |",
        "| --- | --- | --- |",
        f"| arrived | {share(row['reached'] and not row['crashed'] for row in rows)} |",
        f"| margin of {rows[0]['margin_m']:g} m kept from obstacles | "
        f"{share(row['obstacle_m'] >= row['margin_m'] for row in rows)} |",
        f"| out of both volumes | {share(not row['entered'] for row in rows)} |",
        f"| at most one change of side | {share(row['side_changes'] <= 1 for row in rows)} |",
        f"| no change of side | {share(not row['side_changes'] for row in rows)} |",
        f"| decisions with at most {UP_TO_MS:g} ms added | {len(added) - over} of {len(added)} | "
        f"{100 * low:.1f} to {100 * high:.1f} % |",
        "",
        f"Nearest to a tree: {min(clear):.1f} to {max(clear):.1f} m; to the aircraft: "
        f"{min(apart):.0f} to {max(apart):.0f} m. Time added to a decision with an aircraft about: "
        f"{_spread(added)}. Over all flights {over} took more than {UP_TO_MS:g} ms more, "
        f"{less} as much less: {collected} of these {over + less} while Python collected all its "
        f"garbage. Of the {over}, taken {AGAIN} times again at once, {still or 'none'} took so "
        f"much more each time. That of alerts and bands, which any "
        f"mission with volumes has: {_spread(pictures)}. "
        f"Flights are {np.mean([row['path_m'] for row in rows]):.0f} m long in the mean.",
    ]
    return "\n".join(lines)


def _spread(taken_ms: list[float]) -> str:
    return (
        f"{statistics.median(taken_ms):.2f} ms in the middle, "
        f"{np.percentile(taken_ms, 99):.1f} ms in 99 %, {max(taken_ms):.1f} ms at most"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mission", nargs="?", type=Path, default=MISSION)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--journal", type=Path, default=Path("two-horizons.jsonl"))
    parser.add_argument("--only", type=int, nargs="*", help="these seeds")
    parser.add_argument("--collector-off", action="store_true", help="no garbage is collected")
    parser.add_argument("--write", action="store_true", help=f"the table into {PAGE}")
    given = parser.parse_args()
    file = read_mission_file(str(given.mission))
    lines = given.journal.read_text().splitlines() if given.journal.exists() else []
    rows = {row["seed"]: row for row in map(json.loads, lines)}
    if given.collector_off:
        gc.disable()
    seeds = range(given.seeds) if given.only is None else given.only
    for seed in seeds:
        if seed in rows:
            continue
        rows[seed] = flown(file, seed)
        with given.journal.open("a", encoding="utf-8") as journal:
            journal.write(json.dumps(rows[seed]) + "\n")
    made = table([rows[seed] for seed in seeds], given.mission.name)
    print(made)
    if given.write:
        put_between_marks(PAGE, MARK, made)


if __name__ == "__main__":
    main()
