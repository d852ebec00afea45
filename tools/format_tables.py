"""Tables in the pages of docs that are made from registries, and of the missions, flown anew."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence

from clearway.io.maps.map_formats import JSON_FORMATS
from clearway.io.maps.map_formats import MAP_FORMATS as MAPS
from clearway.io.poses.bag_poses import SOURCES
from clearway.io.poses.pose_file import POSE_FORMATS as POSES
from clearway.io.scans.scan_formats import SCAN_FORMATS as SCANS
from clearway.io.traffic.traffic_formats import TRAFFIC_FORMATS as TRAFFIC
from clearway.missions.mission_file import list_built_in_missions, read_mission_file
from clearway.missions.rule_sections import KeepOutSection, RulesSection
from clearway.missions.setup import prepare
from clearway.reach.sets import METHODS, tuning_of
from tools.models import meanings_of, purpose_of


def _table(head: str, rows: Iterable[Sequence[str]]) -> str:
    lines = [head, re.sub(r"[^|]+", "---", head), *(f"| {' | '.join(row)} |" for row in rows)]
    return re.sub(r" +\|", " |", "\n".join(lines))


def _scan_formats() -> str:
    rows = []
    for one in SCANS:
        suffixes = ", ".join(f"`{suffix}`" for suffix in one.suffixes)
        known = f"{suffixes}, {one.known_by}" if one.known_by else suffixes
        rows.append((one.name, known, one.beams, one.time, one.needs))
    return _table("| format | recognised by | beams | time | needs |", rows)


def _traffic_formats() -> str:
    rows = [(one.name, one.known_by, one.time, one.needs) for one in TRAFFIC]
    return _table("| format | recognised by | time | needs |", rows)


def _map_formats() -> str:
    rows = []
    for one in MAPS:
        kinds = [one] if one.file else JSON_FORMATS
        rows += [(kind.file, kind.holds, kind.stands) for kind in kinds]
    return _table("| file | what is read | how it stands in the map |", rows)


def _poses() -> str:
    rows = [(one.holds, one.option) for one in SOURCES]
    for kind in POSES:
        needs = f", needs {kind.needs}" if kind.needs else ""
        rows.append((kind.holds, f"`--poses {kind.example}`{needs}"))
    return _table("| source | option |", rows)


def _rules() -> str:
    meanings = meanings_of(RulesSection)
    rows = [(f"`[rules] {key}`", meanings[key]) for key in RulesSection.model_fields]
    rows.insert(1, ("`[[keep_out]]`", purpose_of(KeepOutSection)))
    return _table("| key | rule |", rows)


def _methods() -> str:
    rows = []
    for name in METHODS:
        tuning = (f"`{key}` {value:g}" for key, value in tuning_of(name).items())
        kept = METHODS.about(name).rstrip(".")
        rows.append(
            (f"`{name}`", kept, ", ".join(one for one in tuning if "side_exits" not in one))
        )
    return _table("| method | keeps | tuning |", rows)


FLOWN_BY = (("clearway", "total"), ("clearway", "calibrated"), ("straight", ""))
"""Planner and rating of each row of the table of missions."""


def _missions() -> str:
    """The missions that come with clearway, seed of the file, as they fly today."""
    return fly_mission_table(sorted(list_built_in_missions()), FLOWN_BY)


def fly_mission_table(names: Iterable[str], flown_by: Iterable[tuple[str, str]]) -> str:
    """Fly missions by planners and ratings; a table with a row for each flight."""
    rows = [fly_mission_row(name, *one) for name, one in itertools.product(names, flown_by)]
    head = (
        "| mission | flown by | reached | nearest obstacle | nearest intruder | violations | path |"
    )
    return _table(f"{head} time |", rows)


def fly_mission_row(name: str, planner: str, rating: str) -> tuple[str, ...]:
    """Fly a built-in mission; what its row of the table says."""
    file = read_mission_file(name)
    changed = file.with_values("rating", name=rating) if rating else file
    told = prepare(changed).fly_with(planner).summary()
    nearest = (
        "" if told[key] is None else f"{told[key]:.2f} m"
        for key in ("min_obstacle_distance_m", "min_intruder_distance_m")
    )
    return (
        f"`{name}`",
        f"{planner}, `{rating}`" if rating else planner,
        "yes" if told["reached"] else "no",
        *nearest,
        str(told["margin_violations"]),
        f"{told['path_length_m']:.1f} m",
        f"{told['time_s']:.1f} s",
    )


PARTS: Mapping[tuple[str, str], Callable[[], str]] = {
    ("scans.md", "scan-formats"): _scan_formats,
    ("traffic.md", "traffic-formats"): _traffic_formats,
    ("reach-sets.md", "methods"): _methods,
    ("maps.md", "map-formats"): _map_formats,
    ("scans.md", "poses"): _poses,
    ("rules.md", "rules"): _rules,
    ("results/missions.md", "missions"): _missions,
}
"""(page, what stands between marks in it)"""
