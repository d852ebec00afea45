"""What has been heard, topic by topic: how much, how fast, how old; and what is missing."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from clearway.ros2.bus import TopicBus

RATE_OVER = 20
"""Messages over which a rate is taken."""


@dataclass(slots=True)
class HeardTopic:
    """One topic."""

    kind: str
    needed: bool
    messages: int = 0
    refused: int = 0
    age_s: float = math.nan
    """Of the last stamp, by the newest time that any message told."""
    _came: deque[float] = field(default_factory=lambda: deque(maxlen=RATE_OVER))

    def take(self, came_s: float) -> None:
        """came_s: by our clock, or when it was recorded."""
        self.messages += 1
        self._came.append(came_s)

    @property
    def rate_hz(self) -> float:
        span = self._came[-1] - self._came[0] if len(self._came) > 1 else 0.0
        return (len(self._came) - 1) / span if span > 0.0 else 0.0

    def words(self, topic: str, bus: TopicBus) -> str:
        """One line on a topic of a bus."""
        if not self.messages:
            publishers = bus.publishers(topic)
            who = f"{publishers} publishers, but" if publishers else "no publisher and"
            why = "" if publishers else bus.why_unheard(topic)
            return f"{topic} ({self.kind}): {why or f'{who} no message'}"
        age = "" if math.isnan(self.age_s) else f", {1e3 * self.age_s:.0f} ms old"
        bad = f", {self.refused} not usable" if self.refused else ""
        return f"{topic} ({self.kind}): {self.messages} at {self.rate_hz:.1f} Hz{age}{bad}"
