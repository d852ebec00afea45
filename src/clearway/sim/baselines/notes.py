"""What is stated beside tables of several planners: what they share, and what some cannot know."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from clearway.base.own_code import shorten_own_name
from clearway.sim.baselines.knowledge import NOT_APPLICABLE
from clearway.sim.baselines.registry import PLANNERS

COMMON = "all fly the same vehicle, by the same readings and mission control"


def list_shared_notes(planners: Sequence[str]) -> list[str]:
    """What planners have in common with clearway, a line for those that share the same."""
    if len(planners) < 2:
        return []
    groups: dict[str, list[str]] = {}
    references = []
    for name in planners:
        if name not in PLANNERS:
            continue  # What a user's own one uses is theirs to say.
        planner = PLANNERS[name]
        if planner.shares:
            groups.setdefault(planner.shares, []).append(name)
        if planner.reference:
            references.append(name)
    lines = [COMMON + ("; of clearway's own:" if groups else "")]
    lines += [f"{', '.join(names)}: {shares}" for shares, names in groups.items()]
    return lines + [f"{name} avoids nothing: it is the reference" for name in references]


def not_known(hidden: Iterable[tuple[str, str]]) -> list[str]:
    """Why planners have n/a in a table; hidden: (planner, what it cannot know or nothing)."""
    groups: dict[str, list[str]] = {}
    for name, what in dict.fromkeys(hidden):
        if what:
            groups.setdefault(what, []).append(shorten_own_name(name))
    return [
        f"{NOT_APPLICABLE}: {', '.join(names)} cannot know {what}" for what, names in groups.items()
    ]
