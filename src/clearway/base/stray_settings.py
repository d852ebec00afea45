"""Libraries loaded without the settings that anybody may have left in the working folder.

matplotlib reads `matplotlibrc` there, which names programs to run; numba `.numba_config.yaml`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

LIBRARIES = ("matplotlib", "numba")
"""Those that read a file of settings in the working folder while they are loaded."""
NUMBA_CONFIG = "numba.core.config"
"""Of numba: looks for its file again whenever a loop is compiled."""


class _Elsewhere:
    """A finder that has such a library loaded in the root folder."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec = PathFinder.find_spec(name, path, target) if name in LIBRARIES else None
        if spec is None or spec.loader is None:
            return None
        load = spec.loader.exec_module

        def load_elsewhere(module: ModuleType) -> None:
            with _in_root_folder():
                load(module)
            config = sys.modules.get(NUMBA_CONFIG)
            if config is not None:
                vars(config)["_config_fname"] = ""

        vars(spec.loader)["exec_module"] = load_elsewhere
        return spec


def ignore_stray_settings() -> None:
    """Have the libraries that are loaded from here on ignore settings of the working folder."""
    if not any(isinstance(one, _Elsewhere) for one in sys.meta_path):
        sys.meta_path.insert(0, _Elsewhere())


@contextmanager
def _in_root_folder() -> Iterator[None]:
    try:
        here = os.open(".", getattr(os, "O_PATH", os.O_RDONLY))
    except OSError:  # The working folder is gone: nothing can lie in it.
        yield
        return
    try:
        os.chdir("/")
        yield
    finally:
        os.fchdir(here)
        os.close(here)
