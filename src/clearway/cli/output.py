"""Standard output whose reader may go away: results are there at once, files are written after."""

from __future__ import annotations

import io
import os
import sys

READER_GONE = 141
"""Exit status of what SIGPIPE ends, as `| head` does."""
TOLD_ANYWAY = "backslashreplace"
"""How a terminal that lacks a character is written to: no name is worth losing a result."""


class _Output(io.FileIO):
    """Takes everything; what nobody reads any more is dropped."""

    reader_gone = False
    refused = ""
    """Why something could not be written, as on a full disk."""

    def write(self, data: object) -> int:
        try:
            return super().write(data)  # type: ignore[arg-type]
        except BrokenPipeError:
            self.reader_gone = True
        except OSError as cause:
            self.refused = cause.strerror or str(cause)
        return len(memoryview(data))  # type: ignore[arg-type]


def take_over_output() -> _Output | None:
    """Standard output, from now on a line at a time; None where it is no file of the system's.

    A result stands there before files are written, whatever ends the process meanwhile; and where
    the reader has gone away, they are written all the same.
    """
    before = sys.stdout
    if before is None:  # Closed by who began the process: nobody wants to read it.
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
        return None
    if not isinstance(before, io.TextIOWrapper):
        return None
    output = _Output(before.fileno(), "w", closefd=False)
    before.flush()
    sys.stdout = io.TextIOWrapper(
        io.BufferedWriter(output),
        encoding=before.encoding,
        errors=TOLD_ANYWAY,
        line_buffering=True,
    )
    return output
