"""The entries of a ground station's plan: commands of MAVLink, and which of them lead somewhere."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Literal, NamedTuple

from clearway.base.checks import HIGHEST_M
from clearway.io.foreign import position_of
from clearway.io.maps.map_features import Geodetic

Action = Literal["take-off", "waypoint", "return", "land"]
ACTIONS: Mapping[int, Action] = {
    16: "waypoint",
    17: "waypoint",
    18: "waypoint",
    19: "waypoint",
    20: "return",
    21: "land",
    22: "take-off",
    31: "waypoint",
    82: "waypoint",
    84: "take-off",
    85: "land",
}
"""Commands of MAVLink that lead somewhere."""
LOITERING = (17, 18, 19, 31)
CHANGE_SPEED = 178
FRAMES: Mapping[int, Literal["sea level", "home", "ground"]] = {
    0: "sea level",
    3: "home",
    5: "sea level",
    6: "home",
    10: "ground",
    11: "ground",
}
"""What heights are above, by MAV_FRAME."""


class Item(NamedTuple):
    """One entry of a plan that leads somewhere."""

    place: str
    """Where it stands in the file."""
    action: Action
    latitude_deg: float | None
    """None, like the longitude, where the vehicle is or was."""
    longitude_deg: float | None
    height_m: float
    above: Literal["sea level", "home", "ground"]


Position = tuple[float | None, float | None, float | None]
"""Latitude, longitude, height, as far as the file has them."""


def item_of(place: str, command: int, frame: int, position: Position) -> Item | None:
    """An entry of a plan by its numbers: latitude, longitude, height; None if it leads nowhere.

    Raises ValueError saying what is missing or out of range.
    """
    action = ACTIONS.get(command)
    if action is None:
        return None
    if action == "return":
        return Item(place, action, None, None, 0.0, "home")
    above = FRAMES.get(frame)
    if above is None:
        raise ValueError(f"frame {frame}; valid: {', '.join(map(str, FRAMES))}")
    latitude, longitude, height = position
    if height is None:
        raise ValueError("the height is missing")
    _check_height(height)
    # Take-off and landing without a place, or with zeros for it, mean wherever the vehicle is.
    if not latitude and not longitude:
        if action == "waypoint":
            raise ValueError("latitude and longitude are missing")
        return Item(place, action, None, None, height, above)
    return Item(place, action, *position_of([longitude, latitude]), height, above)


def geodetic_of(latitude: float, longitude: float, height: float) -> Geodetic:
    """A place of a plan; raises ValueError saying what is out of range."""
    position_of([longitude, latitude])
    _check_height(height)
    return Geodetic(latitude, longitude, height)


def _check_height(height: float) -> None:
    if not abs(height) <= HIGHEST_M:
        raise ValueError(f"height {height:g} m is out of range; valid: +-{HIGHEST_M:g} m")


class ItemsRead:
    """The items of a plan while it is read: found, left out by reason, and what is wrong."""

    def __init__(self) -> None:
        self.found: list[Item] = []
        self.left_out: Counter[str] = Counter()
        self.problems: list[str] = []

    def take(self, place: str, command: int | None, frame: int, position: Position) -> None:
        """One entry of the file, by its numbers as in `item_of`."""
        try:
            item = item_of(place, command or 0, frame, position)
        except ValueError as cause:
            self.problems.append(f"{place}: {cause}")
            return
        if item is None:
            self.left_out[f"command {command}, which leads nowhere"] += 1
            return
        self.found.append(item)
        if command in LOITERING:
            self.left_out["loitering at a waypoint"] += 1
