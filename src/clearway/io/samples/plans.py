"""Flight plans of ground stations: up, two legs, and back, with a fence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.samples.encounter import LATITUDE, LONGITUDE

HOME = (LATITUDE, LONGITUDE, 100.0)
WAYPOINTS = ((0.0, 0.00025), (0.00015, 0.00025))
"""North and east of home, in degrees."""
HEIGHT_M = 30.0
TAKE_OFF, WAYPOINT, RELATIVE = 22, 16, 3


def write_plan(path: Path, rng: np.random.Generator) -> None:
    """A plan of QGroundControl, with a fence to stay in and one to keep out of."""
    del rng
    items = [_item(1, TAKE_OFF, HOME[0], HOME[1])]
    items += [
        _item(number, WAYPOINT, HOME[0] + north, HOME[1] + east)
        for number, (north, east) in enumerate(WAYPOINTS, start=2)
    ]
    circle = {"center": [HOME[0] + 0.0001, HOME[1] + 0.0001], "radius": 200.0}
    path.write_text(
        json.dumps(
            {
                "fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
                "mission": {"version": 2, "firmwareType": 12, "vehicleType": 2, "cruiseSpeed": 1,
                            "hoverSpeed": 1, "globalPlanAltitudeMode": 1,
                            "plannedHomePosition": list(HOME), "items": items},
                "geoFence": {"version": 2, "polygons": [],
                             "circles": [{"circle": circle, "inclusion": True, "version": 1}]},
                "rallyPoints": {"version": 2, "points": []},
            },
            indent=1,
        )
    )  # fmt: skip


def _item(number: int, command: int, latitude: float, longitude: float) -> dict[str, Any]:
    place = [round(latitude, 7), round(longitude, 7), HEIGHT_M]
    return {
        "type": "SimpleItem", "command": command, "frame": RELATIVE, "autoContinue": True,
        "doJumpId": number, "AltitudeMode": 1, "Altitude": HEIGHT_M,
        "AMSLAltAboveTerrain": None, "params": [0, 0, 0, None, *place],
    }  # fmt: skip


def write_waypoints(path: Path, rng: np.random.Generator) -> None:
    """QGC WPL 110: home and one item a line."""
    del rng
    rows = [(0, 1, 0, WAYPOINT, *HOME), (1, 0, RELATIVE, TAKE_OFF, *HOME[:2], HEIGHT_M)]
    rows += [
        (number, 0, RELATIVE, WAYPOINT, HOME[0] + north, HOME[1] + east, HEIGHT_M)
        for number, (north, east) in enumerate(WAYPOINTS, start=2)
    ]
    lines = [
        f"{number}\t{now}\t{frame}\t{command}\t0\t0\t0\t0\t{lat:.7f}\t{lon:.7f}\t{height:g}\t1\n"
        for number, now, frame, command, lat, lon, height in rows
    ]
    path.write_text("QGC WPL 110\n" + "".join(lines))
