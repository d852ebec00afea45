"""Help that lists what there is, taken from the registries when the help is asked for.

Help texts name a list in braces, `{ratings}`; nothing is imported for it before `--help`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from typer.core import TyperCommand, TyperGroup


def _ratings() -> str:
    from clearway.avoidance.fusion import RATINGS

    return RATINGS.choices


def _methods() -> str:
    from clearway.reach import METHODS

    return METHODS.choices


def _detection() -> str:
    from clearway.sensors.detection import RULES

    return RULES.choices


def _patterns() -> str:
    from clearway.sensors import NAMED_PATTERNS

    return ", ".join(NAMED_PATTERNS)


def _planners() -> str:
    from clearway.sim.baselines import PLANNERS

    return PLANNERS.choices


def _campaigns() -> str:
    from clearway.studies.campaigns.file import built_in_campaigns

    return ", ".join(built_in_campaigns())


def _missions() -> str:
    from clearway.missions.mission_file import built_in_missions

    return ", ".join(sorted(built_in_missions()))


LISTS: Mapping[str, Callable[[], str]] = {
    "campaigns": _campaigns,
    "detection": _detection,
    "methods": _methods,
    "missions": _missions,
    "patterns": _patterns,
    "planners": _planners,
    "ratings": _ratings,
}
"""What stands in braces in help texts."""


def filled(text: str) -> str:
    """The text with its lists written out."""
    return re.sub(
        r"\{(\w+)\}", lambda found: LISTS[found[1]]() if found[1] in LISTS else found[0], text
    )


def _fill(params: list[Any]) -> None:
    for param in params:
        if getattr(param, "help", None):
            param.help = filled(param.help)


class Command(TyperCommand):
    """A command whose help lists what there is."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        _fill(self.params)
        super().format_help(ctx, formatter)


class Group(TyperGroup):
    """A command with others below it, likewise."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        _fill(self.params)
        super().format_help(ctx, formatter)
