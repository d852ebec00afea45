"""What planners know, and what of a flight is hidden from them.

A planner that no source tells of a danger cannot avoid it: whether it did says nothing of how well
it avoids, so tables say n/a there, and why.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from enum import StrEnum

NOT_APPLICABLE = "n/a"
"""In tables, where a planner cannot know."""


class Source(StrEnum):
    """Who tells of a danger."""

    SENSORS = "sensors"
    MAP = "map"
    TRAFFIC = "traffic"


Danger = frozenset[Source]
"""Something that can be hit, by the sources that tell of it; empty where none does."""

EVERYTHING = frozenset(Source)
NOTHING: frozenset[Source] = frozenset()
REPORTED_TRAFFIC: Danger = frozenset({Source.TRAFFIC})
WORDS: Mapping[Source, str] = {
    Source.SENSORS: "what sensors see",
    Source.MAP: "what maps tell",
    Source.TRAFFIC: "what traffic reports",
}


def describe_hidden(knows: Collection[Source], dangers: Iterable[Danger]) -> str:
    """What is reported of by sources that a planner does not know alone, in words; empty for
    nothing.

    Dangers that nobody tells of are hidden from every planner, and count for all alike.
    """
    unheard = {source for told_by in dangers if told_by.isdisjoint(knows) for source in told_by}
    return join_sources(unheard)


def join_sources(sources: Collection[Source]) -> str:
    """Sources in a fixed order: a, b and c."""
    *first, last = [WORDS[source] for source in Source if source in sources] or [""]
    return f"{', '.join(first)} and {last}" if first else last
