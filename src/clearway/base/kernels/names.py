"""Names of compiled code, of which no two processes give one to two things.

numba makes several functions of one name and one type, such as what `sort` and what `argsort` go
by, and tells them apart by a number that begins at 1 in every process. Code that several processes
have kept would so hold two under one name; where both are loaded, the first one runs for both.
"""

from __future__ import annotations

import os
import secrets
from itertools import count
from typing import Any

from numba.core import bytecode

# What numba does not type.
_numbered: Any = bytecode.FunctionIdentity
BITS = 60


def number_apart() -> None:
    """Number what is compiled from here on from where no other process does; after a fork anew."""
    _number_from_anywhere()
    os.register_at_fork(after_in_child=_number_from_anywhere)


def _number_from_anywhere() -> None:
    _numbered._unique_ids = count(secrets.randbits(BITS))
