"""Help that lists what there is, taken from the registries when the help is asked for.

Help texts name a list in braces, `{ratings}`; nothing is imported for it before `--help`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from typer.core import TyperCommand, TyperGroup

from clearway.base.variants import join_choices
from clearway.cli.empty_paths import refuse_empty
from clearway.cli.numbers import refuse_absurd


def _ratings() -> str:
    from clearway.avoidance.rate.fusion import RATINGS

    return RATINGS.choices


def _methods() -> str:
    from clearway.reach import METHODS

    return METHODS.choices


def _detection() -> str:
    from clearway.sensors.cells.detection import RULES

    return RULES.choices


def _patterns() -> str:
    from clearway.sensors import NAMED_PATTERNS

    return ", ".join(NAMED_PATTERNS)


def _planners() -> str:
    from clearway.sim.baselines import PLANNERS

    return PLANNERS.choices


def _campaigns() -> str:
    from clearway.studies.campaigns.file import list_built_in_campaigns

    return ", ".join(list_built_in_campaigns())


def _missions() -> str:
    from clearway.missions.mission_file import list_built_in_missions

    return ", ".join(sorted(list_built_in_missions()))


def _clouds() -> str:
    from clearway.io.scans.scan_formats import SCAN_FORMATS

    return ", ".join(suffix for one in SCAN_FORMATS if one.cloud for suffix in one.suffixes)


def _recordings() -> str:
    from clearway.io.scans.scan_formats import SCAN_FORMATS

    return ", ".join(suffix for one in SCAN_FORMATS if one.scans for suffix in one.suffixes)


def _poses() -> str:
    from clearway.io.poses.pose_file import POSE_FORMATS

    return ", ".join(one.name for one in POSE_FORMATS)


def _traffic() -> str:
    from clearway.io.traffic.traffic_formats import TRAFFIC_FORMATS

    return ", ".join(one.name for one in TRAFFIC_FORMATS)


def _maps() -> str:
    from clearway.io.maps.map_formats import MAP_FORMATS

    return "; ".join(f"{one.name} ({', '.join(one.suffixes)})" for one in MAP_FORMATS)


def _plans() -> str:
    from clearway.missions.planned import PLANS

    return join_choices(list(PLANS))


def _volumes() -> str:
    from clearway.traffic.volumes import VOLUME_SETS

    return VOLUME_SETS.choices


def _surveillances() -> str:
    from clearway.traffic.surveillance import SURVEILLANCES

    return SURVEILLANCES.choices


def _vehicles() -> str:
    from clearway.vehicle.performance import PERFORMANCES

    return PERFORMANCES.choices


LISTS: Mapping[str, Callable[[], str]] = {
    "campaigns": _campaigns,
    "clouds": _clouds,
    "detection": _detection,
    "methods": _methods,
    "maps": _maps,
    "missions": _missions,
    "patterns": _patterns,
    "planners": _planners,
    "plans": _plans,
    "poses": _poses,
    "ratings": _ratings,
    "recordings": _recordings,
    "surveillances": _surveillances,
    "traffic": _traffic,
    "vehicles": _vehicles,
    "volumes": _volumes,
}
"""What stands in braces in help texts."""


def fill_lists(text: str) -> str:
    """The text with its lists written out."""
    return re.sub(
        r"\{(\w+)\}", lambda found: LISTS[found[1]]() if found[1] in LISTS else found[0], text
    )


def _fill(params: list[Any]) -> None:
    for param in params:
        if getattr(param, "help", None):
            param.help = fill_lists(param.help)


class Command(TyperCommand):
    """A command whose help lists what there is, and whose numbers and files can be some."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        _fill(self.params)
        super().format_help(ctx, formatter)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        refuse_empty(ctx, self, args)
        rest = super().parse_args(ctx, args)
        refuse_absurd(ctx, self.params)
        return rest


class Group(TyperGroup):
    """A command with others below it, likewise."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        _fill(self.params)
        super().format_help(ctx, formatter)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        refuse_empty(ctx, self, args)
        rest = super().parse_args(ctx, args)
        refuse_absurd(ctx, self.params)
        return rest
