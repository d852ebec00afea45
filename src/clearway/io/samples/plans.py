"""Flight plans of ground stations: up, two legs, and back, one of them with a fence."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.samples.encounter import LATITUDE, LONGITUDE

HOME = (LATITUDE, LONGITUDE, 100.0)
WAYPOINTS = ((0.0, 0.00025), (0.00015, 0.00025))
"""North and east of home, in degrees."""
HEIGHT_M = 30.0
TAKE_OFF = 22
WAYPOINT = 16
RELATIVE = 3
GEOID_M = 48.0
"""Height of the sea level above the ellipsoid, about there."""
XML = '<?xml version="1.0" encoding="UTF-8"?>\n'
NAMESPACES = 'xmlns="http://www.opengis.net/kml/2.2" xmlns:wpml="http://www.dji.com/wpmz/1.0.2"'
MADE = (2026, 1, 1, 0, 0, 0)


def write_plan_sample(path: Path, rng: np.random.Generator) -> None:
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


def write_kml(path: Path, rng: np.random.Generator) -> None:
    """A path of Google Earth, above the ground, with a place called home."""
    del rng
    way = " ".join(f"{lon:.7f},{lat:.7f},{HEIGHT_M:g}" for lat, lon in _places())
    path.write_text(
        f"""{XML}<kml xmlns="http://www.opengis.net/kml/2.2">
<Document>
 <name>up, two legs</name>
 <Placemark><name>home</name><Point><altitudeMode>absolute</altitudeMode>
  <coordinates>{HOME[1]:.7f},{HOME[0]:.7f},{HOME[2]:g}</coordinates></Point></Placemark>
 <Placemark><name>way</name><LineString><altitudeMode>relativeToGround</altitudeMode>
  <coordinates>{way}</coordinates></LineString></Placemark>
</Document>
</kml>
"""
    )


def _places() -> list[tuple[float, float]]:
    return [(HOME[0] + north, HOME[1] + east) for north, east in WAYPOINTS]


def write_wpml(path: Path, rng: np.random.Generator) -> None:
    """A mission of DJI as its remote controls keep it: template and waylines, packed."""
    del rng
    reference = f"{HOME[0]:.6f},{HOME[1]:.6f},{HOME[2] + GEOID_M:.6f}"
    config = (
        "<wpml:missionConfig><wpml:flyToWaylineMode>safely</wpml:flyToWaylineMode>"
        "<wpml:finishAction>goHome</wpml:finishAction>"
        "<wpml:takeOffSecurityHeight>20</wpml:takeOffSecurityHeight>{}"
        "</wpml:missionConfig>"
    )
    template = config.format(f"<wpml:takeOffRefPoint>{reference}</wpml:takeOffRefPoint>")
    coordinates = (
        "<wpml:waylineCoordinateSysParam><wpml:coordinateMode>WGS84</wpml:coordinateMode>"
        "<wpml:heightMode>EGM96</wpml:heightMode></wpml:waylineCoordinateSysParam>"
    )
    above_sea = HOME[2] + HEIGHT_M
    marks = {"template": "", "waylines": ""}
    for index, (lat, lon) in enumerate(_places()):
        point = f"<Point><coordinates>{lon:.7f},{lat:.7f}</coordinates></Point>"
        head = f"<Placemark>{point}<wpml:index>{index}</wpml:index>"
        marks["template"] += (
            f"{head}<wpml:ellipsoidHeight>{above_sea + GEOID_M:g}</wpml:ellipsoidHeight>"
            f"<wpml:height>{above_sea:g}</wpml:height></Placemark>\n"
        )
        marks["waylines"] += (
            f"{head}<wpml:executeHeight>{above_sea + GEOID_M:g}</wpml:executeHeight>"
            "<wpml:waypointSpeed>1</wpml:waypointSpeed></Placemark>\n"
        )
    flown = "<wpml:executeHeightMode>WGS84</wpml:executeHeightMode>"
    speed = "<wpml:autoFlightSpeed>1</wpml:autoFlightSpeed>"
    documents = {
        "wpmz/template.kml": f"{template}<Folder>{coordinates}{speed}{marks['template']}</Folder>",
        "wpmz/waylines.wpml": f"{config.format('')}<Folder>{flown}{speed}{marks['waylines']}"
        "</Folder>",
    }
    with zipfile.ZipFile(path, "w") as packed:
        for name, inside in documents.items():
            text = f"{XML}<kml {NAMESPACES}><Document>\n{inside}\n</Document></kml>\n"
            packed.writestr(zipfile.ZipInfo(name, MADE), text)
