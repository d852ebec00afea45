"""What hatchling calls to build a wheel or an editable install: the compiled core goes in."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).parent
sys.path.insert(0, str(ROOT / "src"))


class CoreHook(BuildHookInterface[Any]):
    """Builds the core, and tells hatchling where it is and which machines it is for."""

    def dependencies(self) -> list[str]:
        """A compiler from PyPI, where it is needed."""
        from clearway_build.compiler import requirements
        from clearway_build.target import chosen_target

        return requirements(chosen_target())

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build; in a checkout that is installed to be edited, the core lands in the package."""
        from clearway_build.build import CORE, build_core
        from clearway_build.errors import BuildError
        from clearway_build.placed import place
        from clearway_build.target import chosen_target

        try:
            target = chosen_target()
            built = build_core(ROOT, target)
            if version == "editable":
                place(ROOT, built.path)
        except BuildError as error:
            self.app.abort(str(error))
        self.app.display_info(built.report)
        build_data["pure_python"] = False
        build_data["tag"] = target.tag
        if version != "editable":
            build_data["force_include"][str(built.path)] = f"clearway/base/{CORE}"
