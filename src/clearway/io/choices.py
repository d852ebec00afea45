"""Keys of files whose value is a name of a registry: checked against it, listed from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticKnownError, core_schema

from clearway.base.errors import ClearwayError
from clearway.base.own_code import OWN_CODE_FORM, is_own_code
from clearway.base.variants import Variants, join_choices


@dataclass(frozen=True, eq=False)
class OneOf:
    """`Annotated[str, OneOf(REGISTRY)]`: a name that the registry has when the file is read.

    A user's own `module:name`, where the registry takes them, is loaded at once, and kept with its
    file, so that the value means the same from anywhere.
    """

    registry: Mapping[str, Any]
    without: tuple[str, ...] = ()
    """Names that have no place in this key."""
    besides: tuple[str, ...] = ()
    """Names that mean something in this key alone; told first."""

    @property
    def names(self) -> list[str]:
        """Valid names, in order."""
        return [*self.besides, *(name for name in self.registry if name not in self.without)]

    @property
    def takes_own(self) -> bool:
        """Whether `module:name` is valid too."""
        return isinstance(self.registry, Variants) and self.registry.takes_own

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.with_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        del schema, handler
        return (
            {"enum": self.names, "own": OWN_CODE_FORM} if self.takes_own else {"enum": self.names}
        )

    def _check(self, name: str, info: ValidationInfo) -> str:
        if name in self.names:
            return name
        if isinstance(self.registry, Variants) and self.registry.takes_own and is_own_code(name):
            try:
                return self.registry.locate(name, find_read_folder(info))
            except ClearwayError as error:
                raise ValueError(str(error)) from error
        quoted = [repr(one) for one in self.names]
        own = [f"your own as {OWN_CODE_FORM}"] if self.takes_own else []
        raise PydanticKnownError("literal_error", {"expected": join_choices([*quoted, *own])})


def find_read_folder(info: ValidationInfo) -> Path | None:
    """The folder of the file that is being read, where the reader said it."""
    return (info.context or {}).get("folder")
