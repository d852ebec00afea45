"""Where results are kept that are only made to be found again."""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder() -> Path:
    """`CLEARWAY_CACHE`, else the user's cache folder."""
    chosen = os.environ.get("CLEARWAY_CACHE")
    if chosen:
        return Path(chosen)
    from platformdirs import user_cache_dir

    return Path(user_cache_dir("clearway", appauthor=False))
