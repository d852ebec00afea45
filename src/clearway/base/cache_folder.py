"""Where results are kept that are only made to be found again.

What lies there is loaded as indices of arrays, so nobody else may write into it.
"""

from __future__ import annotations

import logging
import os
import pwd
import stat
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from clearway.base.errors import InputError

NAMED = "CLEARWAY_CACHE"
"""Of the environment: names the folder."""
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
TRUSTED = "and what lies there is trusted"
INSTEAD = f"let {NAMED} name a folder of your own"
OWN_MODE = 0o755
"""Of folders that are made: whoever may read them may, but only their owner writes."""
_log = logging.getLogger("clearway")


def cache_folder() -> Path | None:
    """`CLEARWAY_CACHE`, else the user's cache folder.

    None where others can write into the user's one: a warning says so, once. Raises InputError
    where they can write into the one that is named.
    """
    chosen = os.environ.get(NAMED)
    if chosen:
        why = why_refused(Path(chosen))
        if why is not None:
            raise InputError(NAMED, why)
        return Path(chosen)
    from platformdirs import user_cache_dir

    folder = Path(user_cache_dir("clearway", appauthor=False))
    return folder if is_private_folder(folder) else None


@lru_cache(maxsize=64)
def is_private_folder(folder: Path) -> bool:
    """Whether nobody else can write into a folder; a warning says why not."""
    why = why_refused(folder)
    if why is not None:
        _log.warning("not used as a cache: %s", why)
    return why is None


def why_refused(folder: Path) -> str | None:
    """Why others could write into a folder, and what to type; None where they cannot.

    Of a folder that is not there, those above it count; those that cannot be asked about can be
    neither read nor written.
    """
    owners = {0, os.geteuid()}
    with suppress(OSError):
        whole = folder.absolute()
        for place in (whole, *whole.resolve().parents):
            if not place.is_dir():
                continue
            found, link = place.stat(), place.lstat()
            strangers = {found.st_uid, link.st_uid} - owners
            beyond = found.st_mode & OTHERS_WRITE
            if place != whole:  # The sticky bit keeps others from what is not theirs, as in /tmp.
                sticky = found.st_mode & stat.S_ISVTX
                strangers, beyond = set(), 0 if sticky else beyond & stat.S_IWOTH
            if strangers:
                return f"{place} belongs to {_name_of(strangers.pop())}, {TRUSTED}; {INSTEAD}"
            if beyond:
                return (
                    f"{place}: others can write into it (mode {stat.S_IMODE(found.st_mode):o}), "
                    f"{TRUSTED}; empty it and type `chmod go-w {place}`, or {INSTEAD}"
                )
    return None


def make_own(folder: Path) -> None:
    """Make a folder and those above it, for their owner alone to write into; raises OSError."""
    for place in (*reversed(folder.parents), folder):
        if not place.is_dir():
            place.mkdir(mode=OWN_MODE, exist_ok=True)


def _name_of(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"user {user}"
