"""What the machine's kernel does with clouds: how large its buffers may be, and what it dropped."""

from __future__ import annotations

from pathlib import Path

CORE_RMEM = Path("/proc/sys/net/core/rmem_max")
COUNTS = Path("/proc/net/snmp")
WANTED_BYTES = 16 << 20
"""Of a socket's buffer: a cloud of 100,000 points is 1.6 MB and more, and several wait."""


def buffer_warnings(core_rmem: Path = CORE_RMEM) -> list[str]:
    """What of the machine's settings loses clouds."""
    try:
        most = int(core_rmem.read_text())
    except (OSError, ValueError):
        return []
    if most >= WANTED_BYTES:
        return []
    return [
        f"net.core.rmem_max is {most} bytes: large clouds get lost where this machine is busy; "
        f"sudo sysctl -w net.core.rmem_max={WANTED_BYTES}"
    ]


def count_dropped_datagrams(counts: Path = COUNTS) -> int | None:
    """Datagrams that came when a buffer was full, of all programs; None where nobody counts."""
    try:
        rows = [line.split() for line in counts.read_text().splitlines() if line.startswith("Udp:")]
        return int(dict(zip(rows[0], rows[1], strict=True))["RcvbufErrors"])
    except (OSError, ValueError, KeyError, IndexError):
        return None
