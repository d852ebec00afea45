"""`[rules]` and `[[keep_out]]` of a mission file, and the rules that they ask for."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.avoidance.rules.airspace import (
    GroundHeights,
    altitude_ceiling,
    altitude_floor,
    keep_out,
    near_route,
    terrain_clearance,
)
from clearway.avoidance.rules.own import OWN_RULES
from clearway.avoidance.rules.rule import Rule
from clearway.avoidance.rules.traffic import horizontal_only, right_of_way, vertical_only
from clearway.base.errors import InputError
from clearway.io.choices import OneOf
from clearway.io.toml import Section
from clearway.missions.sections import ObstacleSection


class RulesSection(Section):
    """`[rules]`: rules of flight, obeyed while something that obeys keeps the margin."""

    terrain_m: Annotated[float, Field(ge=0.0)] | None = None
    """Least height above the ground; needs a terrain raster among the files of `[map]`."""
    floor_m: float | None = None
    """Lowest height, world frame."""
    ceiling_m: float | None = None
    """Highest height, world frame."""
    right_of_way: bool = False
    """Head on turn right, pass behind who comes from the right, overtake on the right."""
    separation: Literal["any", "horizontal", "vertical"] = "any"
    """How to keep clear of traffic: by turning only, by height only, or by both."""
    separation_within_m: Annotated[float, Field(gt=0.0)] | None = None
    """How near traffic has to be for that; default: wherever it is known."""
    route_m: Annotated[float, Field(gt=0.0)] | None = None
    """Half the width of a corridor along the legs. Ways round obstacles keep to it."""
    own: Annotated[tuple[Annotated[str, OneOf(OWN_RULES)], ...], Field(strict=False)] = ()
    """Rules of your own, after these, the most important first; see [rules.md](rules.md)."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        low = -np.inf if self.floor_m is None else self.floor_m
        high = np.inf if self.ceiling_m is None else self.ceiling_m
        if not low < high:
            raise ValueError(f"floor_m {low:g} is not below ceiling_m {high:g}")
        if self.separation_within_m is not None and self.separation == "any":
            raise ValueError(
                'separation_within_m needs separation = "horizontal" or separation = "vertical"'
            )
        return self


class KeepOutSection(ObstacleSection):
    """`[[keep_out]]`: a volume to keep out of; a rule, no obstacle: safety may ask to enter it."""

    from_s: float | None = None
    """Time of the mission from which it is in force; default: from the start."""
    until_s: float | None = None
    """Time of the mission until which it is; default: for ever."""

    @model_validator(mode="after")
    def _is_some_time(self) -> Self:
        begin, end = self.in_force_s
        if not begin < end:
            raise ValueError(f"from_s {begin:g} is not before until_s {end:g}")
        return self

    @property
    def in_force_s(self) -> tuple[float, float]:
        """From when until when."""
        begin = -np.inf if self.from_s is None else self.from_s
        return begin, np.inf if self.until_s is None else self.until_s

    def to_rule(self) -> Rule:
        return keep_out([self.to_obstacle()], *self.in_force_s, self.name)


def mission_rules(
    section: RulesSection,
    volumes: tuple[KeepOutSection, ...],
    ground: GroundHeights | None,
    mission: str,
) -> tuple[Rule, ...]:
    """Rules of a mission, the most important first: places, separation, the route, users' own.

    Raises InputError where a height above ground is asked for and no ground is known.
    """
    known = ground is not None and bool(np.isfinite(ground.height_m).any())
    if section.terrain_m is not None and not known:
        raise InputError(
            f"mission {mission!r}",
            "rules.terrain_m: needs a terrain raster (.tif) among map.files and the mission's "
            "place in it",
        )
    rules = []
    if section.terrain_m is not None and ground is not None:
        rules.append(terrain_clearance(ground, section.terrain_m))
    rules += [volume.to_rule() for volume in volumes]
    if section.floor_m is not None:
        rules.append(altitude_floor(section.floor_m))
    if section.ceiling_m is not None:
        rules.append(altitude_ceiling(section.ceiling_m))
    if section.right_of_way:
        rules.append(right_of_way())
    within = np.inf if section.separation_within_m is None else section.separation_within_m
    if section.separation == "horizontal":
        rules.append(horizontal_only(within))
    elif section.separation == "vertical":
        rules.append(vertical_only(within))
    if section.route_m is not None:
        rules.append(near_route(section.route_m))
    rules += [OWN_RULES.find(name) for name in section.own]
    return tuple(rules)
