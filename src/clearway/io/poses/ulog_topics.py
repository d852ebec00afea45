"""Topics of a ULog by pyulog, to be run in a process of its own: damage may keep it busy."""

from __future__ import annotations

import contextlib
import io
from typing import Any, NamedTuple

from clearway.base.errors import InputError
from clearway.io.foreign_errors import damage_told

LOADED_APART = ("pyulog",)
"""Before a reader is forked, see `io.readers`."""
READ_OVER = 20
READ_MORE_BYTES = 10_000_000
CALLS_A_BYTE = 3
CALLS_MORE = 1_000
"""How much pyulog may read, and how often, of a log of so many bytes: where one is damaged it looks
for where it goes on, byte by byte, and at the end of some it does so for ever."""


class Log(NamedTuple):
    """Some topics of a log."""

    topics: list[tuple[str, dict[str, Any]]]
    """Name and columns of each instance."""
    damaged: bool
    """Whether parts were left out."""


class _BoundedReads(io.BytesIO):
    """A log in memory that may be read so often."""

    def __init__(self, content: bytes) -> None:
        super().__init__(content)
        self._bytes = READ_OVER * len(content) + READ_MORE_BYTES
        self._calls = CALLS_A_BYTE * len(content) + CALLS_MORE

    def read(self, size: int | None = -1, /) -> bytes:
        data = super().read(size)
        self._bytes -= len(data)
        self._calls -= 1
        if self._bytes < 0 or self._calls < 0:
            raise RuntimeError("reading it does not come to an end")
        return data


def read_logged(source: str, content: bytes, names: list[str]) -> Log:
    """The topics of these names; InputError naming the source where nothing can be read."""
    from pyulog import ULog
    from pyulog.exceptions import ULogException

    printed = io.StringIO()  # pyulog prints its complaints
    with contextlib.redirect_stdout(printed), damage_told(source, "ULog", (ULogException,)):
        log: Any = ULog(_BoundedReads(content), names)
    if log.file_corruption and not log.data_list:
        raise InputError(source, "damaged or truncated ULog: nothing of it can be read")
    return Log([(one.name, one.data) for one in log.data_list], bool(log.file_corruption))
