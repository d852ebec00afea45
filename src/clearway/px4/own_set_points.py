"""Set-points of ours: PX4's topic brings them back, and any other is another program's."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Final

KEPT: Final = 256
"""Set-points of this process that are known again."""
KEPT_HANDED: Final = 16
"""Hand-overs to the second process whose set-points are known again: those of 0.16 s or more."""


class OwnSetPoints:
    """Remembers serialised set-points of this process and of its second one."""

    def __init__(self) -> None:
        self._sent: deque[bytes] = deque(maxlen=KEPT)
        self._handed: deque[frozenset[bytes]] = deque(maxlen=KEPT_HANDED)

    def note_sent(self, raw: bytes) -> None:
        """This process sends it."""
        self._sent.append(raw)

    def note_handed(self, raws: Iterable[bytes]) -> None:
        """The second process may send any of them."""
        self._handed.append(frozenset(raws))

    def has(self, raw: bytes) -> bool:
        """Whether it is one of ours."""
        return raw in self._sent or any(raw in one for one in self._handed)
