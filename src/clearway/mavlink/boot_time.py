"""Milliseconds since boot, counted in 32 bits, and seconds."""

from __future__ import annotations

WRAP_S = 2**32 / 1000.0


def time_of(boot_ms: int, newest_s: float) -> float:
    """A time since boot in seconds, without the wrap of its counter; near the newest one told."""
    time_s = boot_ms / 1000.0
    return time_s + round((newest_s - time_s) / WRAP_S) * WRAP_S


def boot_ms(time_s: float) -> int:
    """The counter at a time."""
    return round(time_s * 1000.0) % 2**32
