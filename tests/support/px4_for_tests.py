"""clearway as a mode of a simulated PX4, both in one process and in simulated time."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from clearway.live.link.outcome import TickOutcome
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.px4.releases import RELEASES
from clearway.px4.setup import set_up_px4, set_up_px4_guard
from clearway.px4.simulated import ModePilot
from clearway.px4.simulated_commander import Px4Habits
from clearway.px4.simulated_px4 import SimulatedPx4
from clearway.ros2.bus import Quality, TopicMessage, wire_kind
from clearway.ros2.parameters import Names, NodeParameters

MISSION = """
[mission]
name = "wall"
waypoints_m = [[14.0, 8.0, 5.0]]
reach_radius_m = 1.5
[vehicle]
kind = "inertialess"
position_m = [0, 0, 5]
speed_mps = 1.0
pitch_limit_deg = 0
[safety]
margin_m = 0.6
obstacles_span_m = [0, 10]
[[lidar]]
name = "ring"
max_range_m = 10.0
[[obstacle]]
name = "wall"
shape = "cuboid"
position_m = [7.0, -2.0, 5.0]
size_m = [1.0, 10.0, 20.0]
"""
STEP_S = 0.1


class Topics:
    """Topics of one process, which any number of ends share."""

    def __init__(self) -> None:
        self.kinds: dict[str, str] = {}
        self.ends: list[End] = []
        self.kept: dict[str, bytes] = {}
        """Of latched topics, for those who come later."""


class End:
    """A `bus.TopicBus` of one of those who share topics."""

    def __init__(self, topics: Topics) -> None:
        self.name, self.recorded, self.lost = "shared topics", False, Counter[str]()
        self._topics = topics
        self.heard: dict[str, str] = {}
        self.told: set[str] = set()
        self.came: list[TopicMessage] = []
        topics.ends.append(self)

    def subscribe(self, topic: str, kind: str, quality: Quality) -> None:
        self._same(topic, kind)
        self.heard[topic] = kind
        if quality.latched and topic in self._topics.kept:
            self.came.append(TopicMessage(topic, kind, self._topics.kept[topic]))

    def advertise(self, topic: str, kind: str, quality: Quality) -> None:
        del quality
        self._same(topic, kind)
        self.told.add(topic)

    def _same(self, topic: str, kind: str) -> None:
        assert self._topics.kinds.setdefault(topic, wire_kind(kind)) == wire_kind(kind)

    def publish(self, topic: str, raw: bytes) -> bool:
        assert topic in self.told
        self._topics.kept[topic] = raw
        for end in self._topics.ends:
            if topic in end.heard:
                end.came.append(TopicMessage(topic, end.heard[topic], raw))
        return True

    def take(self) -> list[TopicMessage]:
        came, self.came = self.came, []
        return came

    def publishers(self, topic: str) -> int:
        return sum(topic in end.told for end in self._topics.ends)

    def why_unheard(self, topic: str) -> str:
        del topic
        return ""

    def wait(self, seconds: float) -> None:
        del seconds

    def close(self) -> None:
        self._topics.ends.remove(self)


class Px4Bench:
    """Both sides, stepped by hand; our clock and PX4's run together."""

    def __init__(
        self,
        folder: Path,
        release: str,
        habits: Px4Habits | None = None,
        *,
        guard: dict[str, Any] | None = None,
        px4: dict[str, Any] | None = None,
        mission: str = MISSION,
        cloud_topic: str = "",
        **parameters: Any,
    ) -> None:
        path = folder / "mission.toml"
        path.write_text(mission)
        self.topics, self.said = Topics(), list[str]()
        file = read_mission_file(str(path))
        self.px4 = SimulatedPx4(
            End(self.topics), file, prepare(file), RELEASES[release], habits, cloud_topic
        )
        told = {"distances": "/fmu/in/obstacle_distance", "wait_s": 0.5} | (px4 or {})
        given: dict[str, Any] = {"mission": path, "act": True, "px4": told} | parameters
        set_up = set_up_px4
        if guard is not None:
            given["guard"], set_up = guard, set_up_px4_guard  # type: ignore[assignment]
        node = NodeParameters.model_validate(given)
        self.loop, self.link = set_up(node, Names(), self.open_bus, self.said.append)
        self.session, self.commander = self.link.session, self.px4.commander
        self.pilot = ModePilot(self.px4, "clearway")
        self.last: TickOutcome | None = None

    def open_bus(self) -> End:
        return End(self.topics)

    def step(self, count: int = 1, *, pilot: bool = True, node: bool = True) -> None:
        """The pilot, PX4, and our node, in this order."""
        for _ in range(count):
            if pilot:
                self.pilot.act()
            self.px4.step(STEP_S)
            if node:
                self.link.hear(self.px4.time_s)
                self.last = self.link.tick(self.px4.time_s)
                self.px4.listen()

    def until(self, true: Any, seconds: float = 60.0, **how: bool) -> bool:
        """Whether something becomes true within a time of PX4's."""
        end_s = self.px4.time_s + seconds
        while self.px4.time_s < end_s and not true():
            self.step(**how)
        return bool(true())

    def counts_of(self, word: str) -> list[str]:
        """Reasons for which something was left out that have a word."""
        return [reason for reason in self.session.left_out if word in reason]

    def flies(self) -> bool:
        return self.px4.flies_external

    def holds(self) -> bool:
        return self.commander.nav_state == 4


def flying(folder: Path, release: str = "1.18", flown_s: float = 3.0, **how: Any) -> Px4Bench:
    bench = Px4Bench(folder, release, **how)
    assert bench.until(bench.flies), bench.said
    bench.step(round(flown_s / 0.1))
    assert bench.flies()
    return bench


def each(by_day: str) -> pytest.MarkDecorator:
    """Every release; all but one by night."""
    found = [
        pytest.param(one, marks=() if one == by_day else pytest.mark.nightly) for one in RELEASES
    ]
    return pytest.mark.parametrize("release", found)
