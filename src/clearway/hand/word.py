"""Who may speak to the vehicle: one lock that two processes share, and a mark that stays.

The sender holds the lock while it sends. A process that dies loses it by the kernel's doing.
The mark says that the second process has taken over for good.
"""

from __future__ import annotations

import fcntl
import os
import tempfile

MARK = b"relieved"


class Word:
    """The lock, by the descriptor of a nameless file that both processes have open."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor

    @classmethod
    def new(cls) -> Word:
        """A lock of one pair of processes."""
        descriptor, path = tempfile.mkstemp(prefix="clearway-hand-")
        os.unlink(path)
        return cls(descriptor)

    def take(self) -> bool:
        """Take the word, and say whether this process has it; never waits."""
        try:
            fcntl.lockf(self.descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        return True

    def give(self) -> None:
        fcntl.lockf(self.descriptor, fcntl.LOCK_UN)

    def mark(self) -> None:
        """The deciding process is relieved, whatever becomes of the second one."""
        os.pwrite(self.descriptor, MARK, 0)

    @property
    def is_marked(self) -> bool:
        return os.pread(self.descriptor, len(MARK), 0) == MARK

    def close(self) -> None:
        os.close(self.descriptor)
