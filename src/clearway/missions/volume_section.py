"""`[[volume]]`: volumes of one's own that no two aircraft should share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from clearway.io.toml import Section, read_model
from clearway.missions.sections import NotNegative, Positive, state_problems
from clearway.traffic.volumes import VOLUME_SETS, AirVolume, VolumeSet


class VolumeSection(Section):
    """`[[volume]]`: a volume that no two aircraft should share; the outermost comes first."""

    name: Annotated[str, Field(min_length=1)]
    """What alerts and logs call it."""
    radius_m: Positive
    """Of the cylinder."""
    half_height_m: Positive
    """Of the cylinder."""
    tau_s: NotNegative = 0.0
    """Modified tau at which it begins for those that converge, as in DO-365; 0: a plain
    cylinder."""
    buffer_m: NotNegative = 0.0
    """Kept beside the radius."""
    buffer_height_m: NotNegative = 0.0
    """Kept beside the half height."""
    growth_mps: NotNegative = 0.0
    """Of the radius with the time looked ahead."""

    def to_volume(self) -> AirVolume:
        return AirVolume(**self.model_dump())


def volumes_of(tables: Sequence[VolumeSection], name: str = "own") -> VolumeSet:
    """The set of some tables, the outermost first; InputError where they are not nested."""
    return VolumeSet.of(name, tuple(one.to_volume() for one in tables))


class VolumesFile(Section):
    """A file of `[[volume]]` tables."""

    volume: Annotated[tuple[VolumeSection, ...], Field(strict=False, min_length=1)]

    @model_validator(mode="after")
    def _are_nested(self) -> Self:
        state_problems(self.to_set)
        return self

    def to_set(self, name: str = "own") -> VolumeSet:
        return volumes_of(self.volume, name)


def volumes_named(name_or_path: str) -> VolumeSet:
    """A set of volumes by name, or of a TOML file with `[[volume]]` tables; InputError names every
    problem of the file, ClearwayError the valid names."""
    if name_or_path.endswith(".toml"):
        return read_model(Path(name_or_path), VolumesFile).to_set(Path(name_or_path).stem)
    return VOLUME_SETS.find(name_or_path)
