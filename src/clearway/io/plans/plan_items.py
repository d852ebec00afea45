"""The entries of a ground station's plan: where each leads, as ArduPilot and PX4 define it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from typing import Literal, NamedTuple

from clearway.base.checks import HIGHEST_M
from clearway.io.foreign import position_of
from clearway.io.maps.map_features import Geodetic
from clearway.io.plans.plan_commands import (
    ACTIONS,
    BENT,
    CHANGE_SPEED,
    DELAY,
    DO_JUMP,
    DO_JUMP_TAG,
    FENCE_AND_RALLY_ITEMS,
    JUMP_TAG,
    LOITERING,
    UNLIMITED,
    Action,
    name_command,
)
from clearway.io.plans.plan_limits import LimitsRead

FRAMES: Mapping[int, Literal["sea level", "home", "ground"]] = {
    0: "sea level",
    3: "home",
    5: "sea level",
    6: "home",
    10: "ground",
    11: "ground",
    2: "sea level",
}
"""What heights are above, by MAV_FRAME; ArduPilot takes MISSION (2) as GLOBAL."""
AIR_AND_GROUND_SPEED = (0, 1)
"""Kinds of DO_CHANGE_SPEED; the others are of climbs and descents."""
HERE = "waypoint at 0, 0: taken as where the vehicle is"
KEPT_HEIGHT = "waypoint of height 0: the height before it is kept, as ArduCopter does"


class Item(NamedTuple):
    """One entry of a plan that leads somewhere."""

    place: str
    """Where it stands in the file."""
    action: Action
    latitude_deg: float | None
    """None, like the longitude, where the vehicle is or was."""
    longitude_deg: float | None
    height_m: float | None
    """None for the height that the vehicle has."""
    above: Literal["sea level", "home", "ground"]
    last: bool = False
    """Whether nothing after it is flown."""


class Jump(NamedTuple):
    """An entry that sends the vehicle back or on; to a tag if `tagged`, else to an item."""

    place: str
    target: int
    repeats: int
    """-1 for ever."""
    tagged: bool


class Tag(NamedTuple):
    """A target of jumps."""

    value: int


Position = tuple[float | None, float | None, float | None]
"""Latitude, longitude, height, as far as the file has them."""


class Entry(NamedTuple):
    """An entry of the file by its numbers."""

    place: str
    number: int
    """What jumps call it."""
    command: int | None
    frame: int
    params: tuple[float | None, float | None]
    """The first two."""
    position: Position


class Step(NamedTuple):
    """An entry of the file as it is flown; `does` is None where it leads nowhere."""

    number: int
    does: Item | Jump | Tag | None


def item_of(entry: Entry, *, zero_keeps_height: bool) -> Item | None:
    """Return where an entry leads, or None where it leads nowhere.

    Raises ValueError saying what is missing or out of range.
    """
    action = ACTIONS.get(entry.command or 0)
    if action is None:
        return None
    if action == "return":
        return Item(entry.place, action, None, None, None, "home", last=True)
    above = FRAMES.get(entry.frame)
    if above is None:
        raise ValueError(f"frame {entry.frame}; valid: {', '.join(map(str, FRAMES))}")
    latitude, longitude, height = entry.position
    if height is None:
        raise ValueError("the height is missing")
    _check_height(height)
    kept = None if height == 0.0 and zero_keeps_height and action != "land" else height
    last = entry.command == UNLIMITED
    if not latitude and not longitude:
        if action == "waypoint" and (latitude is None or longitude is None):
            raise ValueError("latitude and longitude are missing")
        return Item(entry.place, action, None, None, kept, above, last)
    return Item(entry.place, action, *position_of([longitude, latitude]), kept, above, last)


def read_geodetic(latitude: float, longitude: float, height: float) -> Geodetic:
    """A place of a plan; raises ValueError saying what is out of range."""
    position_of([longitude, latitude])
    _check_height(height)
    return Geodetic(latitude, longitude, height)


def _check_height(height: float) -> None:
    if not abs(height) <= HIGHEST_M:
        raise ValueError(f"height {height:g} m is out of range; valid: +-{HIGHEST_M:g} m")


class ItemsRead:
    """The entries of a plan while it is read: steps, left out by reason, and what is wrong."""

    def __init__(self, *, zero_keeps_height: bool = True) -> None:
        self.steps: list[Step] = []
        self.left_out: Counter[str] = Counter()
        self.assumed: Counter[str] = Counter()
        self.problems: list[str] = []
        self.limits = LimitsRead()
        self.speed_mps: float | None = None
        """The one that the plan sets before its first place."""
        self._zero_keeps_height = zero_keeps_height
        self._begun = False

    def take(self, entry: Entry) -> None:
        """One entry of the file."""
        try:
            does = self._step(entry)
        except ValueError as cause:
            self.problems.append(f"{entry.place}: {cause}")
            return
        self.steps.append(Step(entry.number, does))
        self._begun |= isinstance(does, Item) and does.action != "take-off"

    def _step(self, entry: Entry) -> Item | Jump | Tag | None:
        command = entry.command
        if command in FENCE_AND_RALLY_ITEMS:
            self.limits.take(command or 0, entry.params[0], entry.position)
            return None
        if command in (DO_JUMP, DO_JUMP_TAG):
            return _jump(entry)
        if command == JUMP_TAG:
            return Tag(_whole(entry.params[0], "the tag"))
        if command == CHANGE_SPEED and not self._begun and self._takes_speed(entry):
            return None
        item = item_of(entry, zero_keeps_height=self._zero_keeps_height)
        if item is None:
            named = f"{name_command(command)}, which leads nowhere"
            self.left_out["waiting" if command == DELAY else named] += 1
            return None
        self.left_out["loitering at a waypoint"] += command in LOITERING
        self.assumed[HERE] += item.latitude_deg is None and item.action == "waypoint"
        self.assumed[KEPT_HEIGHT] += item.height_m is None and item.action == "waypoint"
        if command in BENT:
            self.assumed[BENT[command]] += 1
        return item

    def _takes_speed(self, entry: Entry) -> bool:
        kind, speed = entry.params
        if kind not in (None, *AIR_AND_GROUND_SPEED):
            return False
        if speed is not None and speed > 0.0:  # -1 keeps the speed
            self.speed_mps = speed
        return True


def _jump(entry: Entry) -> Jump:
    target, repeats = entry.params
    tagged = entry.command == DO_JUMP_TAG
    count = _whole(repeats, "the number of repeats")
    if count < -1:
        raise ValueError(f"{count} repeats; valid: -1 (for ever), 0 or more")
    return Jump(entry.place, _whole(target, "the target of the jump"), count, tagged)


def _whole(value: float | None, what: str) -> int:
    if value is None or not math.isfinite(value) or value != int(value):
        stated = "missing" if value is None else f"{value:g}"
        raise ValueError(f"{what} is {stated}; valid: a whole number")
    return int(value)
