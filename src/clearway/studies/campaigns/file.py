"""The campaign file: families of cases, planners and seeds, as typed sections."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, ValidationInfo, model_validator

from clearway.base.errors import InputError
from clearway.base.suggest import did_you_mean
from clearway.io.choices import find_read_folder
from clearway.io.toml import Section, parse_model, read_toml
from clearway.missions.mission_file import MissionFile
from clearway.sim.baselines import PLANNERS, check_planner_name
from clearway.studies.campaigns.families import CAMPAIGN_FAMILIES

Names = Annotated[tuple[str, ...], Field(strict=False, min_length=1)]
Tables = dict[str, Any]
NAME = r"^[A-Za-z0-9][\w.-]*$"
"""Of what stands in keys of flights."""
CELL = r"^[^|\n]+$"
"""Of what stands in a cell of a table."""
MOST_SEEDS = 100_000
"""All flights of a campaign are listed before the first one starts."""


class VariantSection(Section):
    """`[variants.NAME]`: a planner whose missions are changed, as a column of its own."""

    planner: str
    """Who flies."""
    changes: dict[str, Tables]
    """As a family's, for this column alone; they take precedence over all others."""

    @model_validator(mode="after")
    def _is_known(self, info: ValidationInfo) -> Self:
        check_planner_name(self.planner, find_read_folder(info))
        _check_tables(self.changes)
        return self


class FamilySection(Section):
    """`[[family]]`: cases of one kind, each from a seed."""

    family: str
    """Its name in the registry."""
    label: str | None = Field(default=None, pattern=NAME)
    """Name in tables and keys; default: the family's."""
    seeds: int | None = Field(default=None, ge=1, le=MOST_SEEDS)
    """Number of cases; default: the campaign's."""
    planners: Names | None = None
    """Default: the campaign's."""
    leave_out: Annotated[tuple[str, ...], Field(strict=False)] = ()
    """Planners that do not fly here."""
    parameters: Tables = Field(default_factory=dict)
    """Of the family."""
    changes: dict[str, Tables] = Field(default_factory=dict)
    """Keys of the mission file to be flown with other values, by table; of every `[[table]]`."""
    published: str | None = Field(default=None, pattern=CELL)
    """What others published of such worlds, a column of the table beside them."""
    differs: str | None = Field(default=None, pattern=CELL)
    """What of the flights differs from theirs, a column too."""

    @property
    def name(self) -> str:
        """Label, or family."""
        return self.label or self.family

    def settings_id(self, changes: Mapping[str, Tables]) -> str:
        """The same for the same cases, however the file is written and however many it asks for.

        changes: all that are made.
        """
        settings = [self.family, self.parameters, changes]
        return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:16]

    @model_validator(mode="after")
    def _is_known(self) -> Self:
        if self.family not in CAMPAIGN_FAMILIES:
            near = did_you_mean(self.family, CAMPAIGN_FAMILIES)
            raise ValueError(
                f"family {self.family!r}{near}: there are {', '.join(CAMPAIGN_FAMILIES)}"
            )
        parse_model(f"family {self.name}: parameters", self.parameters, self.known.parameters)
        _check_tables(self.changes)
        return self

    @property
    def known(self) -> Any:
        """Its entry in the registry."""
        return CAMPAIGN_FAMILIES[self.family]


class CampaignFile(Section):
    """A campaign: every family with every planner and every seed."""

    name: str = Field(pattern=NAME)
    planners: Names = tuple(PLANNERS)
    """The first is the one that is looked at; default: all there are. Variants are named here."""
    variants: dict[Annotated[str, Field(pattern=NAME)], VariantSection] = Field(
        default_factory=dict
    )
    """Planners with other settings, by names of their own."""
    seeds: int = Field(default=1, ge=1, le=MOST_SEEDS)
    """Cases of each family."""
    first_seed: int = Field(default=0, ge=0)
    changes: dict[str, Tables] = Field(default_factory=dict)
    """As a family's, in all of them; what a family changes itself takes precedence."""
    family: Annotated[tuple[FamilySection, ...], Field(strict=False, min_length=1)]

    @model_validator(mode="after")
    def _is_possible(self, info: ValidationInfo) -> Self:
        self._check_planners(find_read_folder(info))
        _check_tables(self.changes)
        names = [section.name for section in self.family]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(
                f"family: give each a label of its own, {', '.join(twice)} is there twice"
            )
        return self

    def _check_planners(self, folder: Path | None) -> None:
        taken = sorted(set(self.variants) & set(PLANNERS))
        if taken:
            raise ValueError(f"variants: there is a planner called {', '.join(taken)} already")
        named = [self.planners]
        for section in self.family:
            named += [section.planners or (), section.leave_out]
        for name in dict.fromkeys(chain(*named)):
            if name not in self.variants:
                check_planner_name(name, folder)

    def find_flyer(self, planner: str) -> str:
        """Return the planner of a column: of a variant its own, else the column's name."""
        variant = self.variants.get(planner)
        return planner if variant is None else variant.planner

    def changes_of(self, section: FamilySection, planner: str) -> dict[str, Tables]:
        """Changes of a family for a planner: the campaign's, the family's over them, and over
        both those of a variant."""
        variant = self.variants.get(planner)
        made = [self.changes, section.changes, {} if variant is None else variant.changes]
        tables = dict.fromkeys(chain(*made))
        return {
            table: dict(chain(*(changes.get(table, {}).items() for changes in made)))
            for table in tables
        }


@dataclass(frozen=True, slots=True)
class Campaign:
    """A campaign as it was asked for."""

    source: str
    """Name or path, as given."""
    folder: str
    """What paths in it are relative to."""
    file: CampaignFile


def read_campaign(name_or_path: str) -> Campaign:
    """A campaign of clearway by name, or a campaign file.

    Raises InputError with every problem of a file.
    """
    built_in = list_built_in_campaigns()
    path = built_in.get(name_or_path, Path(name_or_path))
    if name_or_path not in built_in and not path.exists() and path.suffix != ".toml":
        names, near = ", ".join(sorted(built_in)), did_you_mean(name_or_path, built_in)
        raise InputError(
            name_or_path, f"no such campaign or file{near}; campaigns by name: {names}"
        )
    folder = path.resolve().parent
    file = parse_model(str(name_or_path), read_toml(path), CampaignFile, folder)
    return Campaign(name_or_path, str(folder), file)


def list_built_in_campaigns() -> dict[str, Path]:
    """Campaigns that come with clearway, by name."""
    folder = Path(str(resources.files("clearway.studies") / "campaigns"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def _check_tables(changes: Mapping[str, Tables]) -> None:
    tables = MissionFile.model_fields
    for table in changes:
        if table not in tables:
            raise ValueError(f"changes.{table}: a mission has {', '.join(tables)}")
