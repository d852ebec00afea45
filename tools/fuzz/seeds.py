"""Whole files to damage: made here for every format, and small real ones where they are at hand."""

from __future__ import annotations

import gzip
import io
import json
import os
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

REPOSITORY = Path(__file__).parents[2]
DATA = Path(os.environ.get("CLEARWAY_DATA", REPOSITORY.parent / "shared" / "data"))
MOST_REAL = 8_000
"""Bytes that are taken of a real file of text."""
SMALL = ("--layers", "3", "--columns", "4", "--rows", "3")


class Format(NamedTuple):
    """A kind of file, whole ones of it, and the command that reads it."""

    suffix: str
    command: tuple[str, ...]
    """{} is the file."""
    make: Callable[[Path], list[bytes]]
    """From a scratch folder."""
    beside: Callable[[Path], dict[str, bytes]] = lambda folder: {}
    """Whole files that lie beside it, by suffix or name."""
    apart: bool = False
    """Whether it is read in a process of its own, which takes a while."""


SCAN = ("assess", "--scan", "{}", *SMALL, "--no-plots", "--out", "out")
SCENE = ("assess", "{}", "--no-plots", "--out", "out")
POSES = ("assess", "--scan", "scan.bin", "--poses", "{}", *SMALL, "--no-plots", "--out", "out")
MAP = ("map", "{}", "--no-plots")
TRAFFIC = ("traffic", "{}")
FLY = ("fly", "{}", "--no-plots", "--no-mcap", "--out", "out")
REPLAY = ("replay", "{}", "--html", "page.html", "--no-browser")


def points() -> Any:
    """[n, 3] of a wall and a pole ahead, in the sensor's frame."""
    azimuth, elevation = np.meshgrid(np.linspace(-0.6, 0.6, 25), np.linspace(-0.2, 0.2, 5))
    distance = np.where(np.abs(azimuth) < 0.1, 4.0, 8.0)
    flat = distance * np.cos(elevation)
    return np.stack(
        [flat * np.cos(azimuth), flat * np.sin(azimuth), distance * np.sin(elevation)], axis=-1
    ).reshape(-1, 3)


def _text(*texts: str) -> Callable[[Path], list[bytes]]:
    return lambda folder: [text.encode() for text in texts]


def _json(*values: Any) -> Callable[[Path], list[bytes]]:
    return lambda folder: [json.dumps(value).encode() for value in values]


def real(*names: str, most: int = MOST_REAL) -> list[bytes]:
    """Beginnings of real files; none where they are not at hand."""
    found = []
    for name in names:
        for path in sorted(DATA.glob(name)):
            data = path.read_bytes()
            if path.suffix == ".gz":
                data = gzip.decompress(data)
            found.append(data[:most])
    return found


def _with_real(make: Callable[[Path], list[bytes]], *names: str, most: int = MOST_REAL) -> Any:
    return lambda folder: [*make(folder), *real(*names, most=most)]


def _pcd(folder: Path) -> list[bytes]:
    table = points().astype("<f4")
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {len(table)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(table)}\nDATA "
    )
    rows = "\n".join(" ".join(f"{value:.3f}" for value in row) for row in table)
    found = [f"{head}ascii\n{rows}\n".encode(), f"{head}binary\n".encode() + table.tobytes()]
    import lzf

    columns = table.T.tobytes()
    packed = lzf.compress(columns)
    if packed is not None:
        sizes = struct.pack("<II", len(packed), len(columns))
        found.append(f"{head}binary_compressed\n".encode() + sizes + packed)
    return found


def _ply(folder: Path) -> list[bytes]:
    table = points()
    head = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
    head += "property float z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"
    rows = "\n".join(" ".join(f"{value:.3f}" for value in row) for row in table)
    return [
        (head.format("ascii", len(table)) + rows + "\n").encode(),
        head.format("binary_little_endian", len(table)).encode() + table.astype("<f4").tobytes(),
        head.format("binary_big_endian", len(table)).encode() + table.astype(">f4").tobytes(),
    ]


def _las(suffix: str) -> Callable[[Path], list[bytes]]:
    def make(folder: Path) -> list[bytes]:
        import laspy
        import pyproj

        found = []
        for form, version, crs in ((6, "1.4", 25832), (1, "1.2", None)):
            header = laspy.LasHeader(point_format=form, version=version)
            header.scales = [0.001] * 3
            if crs is not None:
                header.add_crs(pyproj.CRS.from_epsg(crs))
            las = laspy.LasData(header)
            las.x, las.y, las.z = points().T
            las.classification = np.full(len(las.x), 2, dtype=np.uint8)
            path = folder / f"a{suffix}"
            las.write(path)
            found.append(path.read_bytes())
        return found

    return make


def _table(folder: Path) -> list[bytes]:
    rows = "\n".join(",".join(f"{value:.3f}" for value in row) for row in points())
    return [f"x,y,z\n{rows}\n".encode(), rows.replace(",", " ").encode() + b"\n"]


def _npy(folder: Path) -> list[bytes]:
    found = []
    records = np.zeros(20, dtype=[("x", "f4"), ("y", "f4"), ("z", "f4"), ("i", "u1")])
    records["x"] = np.arange(20)
    for array in (points(), points().astype("f4"), records):
        file = io.BytesIO()
        np.save(file, array)
        found.append(file.getvalue())
    return found


def _bin(folder: Path) -> list[bytes]:
    table = np.hstack([points(), np.full((len(points()), 1), 0.5)])
    return [table.astype("<f4").tobytes()]


def _robot(kind: str) -> Callable[[Path], list[bytes]]:
    def make(folder: Path) -> list[bytes]:
        sys.path.insert(0, str(REPOSITORY / "tests" / "support"))
        import recordings_for_tests as recordings
        from robot_messages import Message

        maker = getattr(recordings, kind)
        types = recordings.types_of(maker)
        place = folder / kind
        place.mkdir()
        cloud = types.cloud2(1.0, "lidar", points())
        path = maker(place, [Message("/points", 1.0 + 0.1 * n, cloud) for n in range(3)])
        return [recordings.storage(path).read_bytes()]

    return make


def _both(*makers: Callable[[Path], list[bytes]]) -> Callable[[Path], list[bytes]]:
    return lambda folder: [one for maker in makers for one in maker(folder)]


def _tif(folder: Path) -> list[bytes]:
    import rasterio
    from rasterio.transform import from_origin

    heights = 50.0 + np.add.outer(np.arange(12.0), np.arange(16.0))
    found = []
    for kind, packed, crs in (("float32", None, 25832), ("int16", "deflate", 4326)):
        path = folder / "a.tif"
        step = 25.0 if crs == 25832 else 0.0003
        corner = (356_000.0, 5_645_000.0) if crs == 25832 else (6.9, 50.9)
        with rasterio.open(
            path, "w", driver="GTiff", width=16, height=12, count=1, dtype=kind, compress=packed,
            crs=f"EPSG:{crs}", transform=from_origin(*corner, step, step), nodata=-9999,
        ) as raster:  # fmt: skip
            raster.write(heights.astype(kind), 1)
        found.append(path.read_bytes())
    return found


def _run(folder: Path) -> list[bytes]:
    """The recording of a short flight."""
    import subprocess

    mission = folder / "mission.toml"
    mission.write_text(MISSIONS[0])
    command = "from clearway.cli.app import main; main()"
    subprocess.run(
        [sys.executable, "-c", command, "fly", str(mission), "--no-plots", "--out", "run"],
        cwd=folder, capture_output=True, check=False,
    )  # fmt: skip
    return [(folder / "run" / "run.mcap").read_bytes()]


def _metadata(folder: Path) -> dict[str, bytes]:
    return {".json": real("lidar/ouster/OS-0*.json", most=10**6)[0]}


def _packets(folder: Path) -> dict[str, bytes]:
    return {".pcap": real("lidar/ouster/OS-0*.pcap", most=200_000)[0]}


def _scan_beside(folder: Path) -> dict[str, bytes]:
    return {"scan.bin": _bin(folder)[0]}


MISSIONS = (
    """[mission]
name = "short"
waypoints_m = [[4, 0, 0]]
[grid]
range_m = 6
layers = 3
columns = 4
rows = 3
[vehicle]
position_m = [0, 0, 0]
speed_mps = 1.0
[simulation]
seed = 1
time_limit_s = 3.0
[[lidar]]
beams_per_cell = [4, 3]
sigma_m = 0.02
[[obstacle]]
shape = "cuboid"
position_m = [3, 3, 0]
size_m = [1, 2, 3]
orientation_deg = [0, 0, 30]
""",
    """[mission]
name = "traffic"
waypoints_m = [[3, 0, 0], [3, 2, 0.5]]
reach_radius_m = 1.5
[simulation]
time_limit_s = 2
wind_mps = [0.1, 0, 0]
[safety]
margin_m = 0.6
[rating]
name = "visible"
[prices]
turn = 0.3
[[intruder]]
name = "crossing"
appears_s = 0
position_m = [12, 7, 0]
velocity_mps = [0, -0.8, 0.1]
spread_deg = [5, 5]
radius_m = 0.5
""",
)
SCENES = (
    """[grid]
range_m = 6
layers = 3
columns = 4
rows = 3
[vehicle]
position_m = [1, 2, 3]
attitude_deg = [0, 5, 30]
[[obstacle]]
shape = "ball"
name = "front"
position_m = [3, 0, 0]
radius_m = 1.0
[scan.simulate]
beams_per_cell = [4, 3]
sigma_m = 0.02
[[intruder]]
position_m = [6, 5, 0]
velocity_mps = [-1, -1, 0]
spread_deg = [5, 3]
radius_m = 0.3
timed = true
[reach_set]
method = "flying"
[rating]
unknown = 0.5
""",
)
CAMPAIGNS = (
    """[campaign]
name = "small"
planners = ["clearway", "straight"]
seeds = 1
[[family]]
family = "forest"
""",
)


def _campaigns(folder: Path) -> list[bytes]:
    shipped = (REPOSITORY / "src/clearway/studies/campaigns").glob("*.toml")
    return [path.read_bytes() for path in sorted(shipped)]


def _model(folder: Path) -> list[bytes]:
    return [(REPOSITORY / "src/clearway/studies/encounter_model/made-up.txt").read_bytes()]


SQUARE = [[[6.95, 50.94], [6.951, 50.94], [6.951, 50.941], [6.95, 50.941], [6.95, 50.94]]]
GEOJSON = {
    "type": "FeatureCollection",
    "features": [
        {"type": "Feature", "properties": {"height": 30, "name": "block"},
         "geometry": {"type": "Polygon", "coordinates": SQUARE}},
        {"type": "Feature", "properties": {"height": 120},
         "geometry": {"type": "Point", "coordinates": [6.953, 50.942]}},
        {"type": "Feature", "properties": {"height": 20},
         "geometry": {"type": "LineString", "coordinates": [[6.95, 50.94], [6.96, 50.945]]}},
    ],
}  # fmt: skip
CITY = {
    "type": "CityJSON", "version": "1.1",
    "transform": {"scale": [0.001, 0.001, 0.001], "translate": [84000.0, 447000.0, 0.0]},
    "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415"},
    "CityObjects": {"house": {"type": "Building", "geometry": [
        {"type": "MultiSurface", "lod": "1.2", "boundaries": [[[0, 1, 2, 3]], [[4, 5, 6, 7]]]}]}},
    "vertices": [[0, 0, 0], [9000, 0, 0], [9000, 9000, 0], [0, 9000, 0],
                 [0, 0, 8000], [9000, 0, 8000], [9000, 9000, 8000], [0, 9000, 8000]],
}  # fmt: skip
OBSTACLES = (
    "name,latitude,longitude,height_m,elevation_m\nmast,50.94,6.95,120,50\ncrane,50.945,6.96,60,\n"
)
PLAN = {
    "fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
    "geoFence": {"circles": [{"circle": {"center": [47.39, 8.54], "radius": 90}, "inclusion": True,
                              "version": 1}],
                 "polygons": [{"polygon": [[47.39, 8.54], [47.391, 8.54], [47.391, 8.541]],
                               "inclusion": False, "version": 1}], "version": 2},
    "mission": {"cruiseSpeed": 15, "hoverSpeed": 5, "firmwareType": 12, "vehicleType": 2,
                "plannedHomePosition": [47.3977, 8.5456, 488], "version": 2,
                "items": [{"type": "SimpleItem", "command": 22, "frame": 3, "autoContinue": True,
                           "doJumpId": 1, "params": [0, 0, 0, None, 47.3977, 8.5456, 20]},
                          {"type": "SimpleItem", "command": 16, "frame": 3, "autoContinue": True,
                           "doJumpId": 2, "params": [0, 0, 0, None, 47.3978, 8.5457, 20]}]},
    "rallyPoints": {"points": [], "version": 2},
}  # fmt: skip
WAYPOINTS = (
    "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5456\t488\t1\n"
    "1\t0\t3\t22\t0\t0\t0\t0\t47.3977\t8.5456\t20\t1\n"
    "2\t0\t3\t16\t0\t0\t0\t0\t47.3978\t8.5457\t20\t1\n"
)
HEX = (
    "timestamp,frame\n1.0,8D40621D58C382D690C8AC2863A7\n2.0,8D40621D58C386435CC412692AD6\n"
    "3.0,8D485020994409940838175B284F\n"
)
AVR = "@0000000000018D40621D58C382D690C8AC2863A7;\n@000000B71B018D40621D58C386435CC412692AD6;\n"
SBS = "".join(
    f"MSG,3,1,1,40621D,1,2025/06/01,12:00:0{n}.000,2025/06/01,12:00:0{n}.000,,3000,,,50.94{n},"
    "6.95,,,0,0,0,0\n"
    for n in range(8)
)
AIRCRAFT = {
    "now": 1748779200.0, "messages": 5,
    "aircraft": [{"hex": "40621d", "flight": "ABC123  ", "alt_baro": 3000, "alt_geom": 3100,
                  "gs": 120, "track": 90, "baro_rate": 64, "lat": 50.94, "lon": 6.95, "seen_pos": 1,
                  "seen": 0.5, "type": "adsb_icao"},
                 {"hex": "40621e", "alt_baro": "ground", "lat": 50.941, "lon": 6.951, "seen": 0}],
}  # fmt: skip
TRACE = {
    "icao": "40621d", "r": "G-ABCD", "timestamp": 1748779200.0,
    "trace": [[float(n), 50.94 + n / 1e3, 6.95, 3000 + n, 120.0, 90.0, 0, 64,
               {"flight": "ABC123", "alt_geom": 3100}, "adsb_icao", 3100, 64, 120, 0]
              for n in range(5)],
}  # fmt: skip
STATES = {
    "time": 1748779200,
    "states": [["40621d", "ABC123  ", "UK", 1748779199, 1748779199, 6.95 + n / 1e3, 50.94, 900.0,
                False, 60.0, 90.0, 0.3, None, 930.0, "1000", False, 0] for n in range(3)],
}  # fmt: skip
TRAJECTORIES = [
    {"timestamp": 1748779200000 + 1000 * n, "icao24": icao, "callsign": "ABC", "altitude": 3000,
     "latitude": 50.94 + n / 1e3, "longitude": 6.95, "groundspeed": 120, "track": 0,
     "vertical_rate": 0}
    for icao in ("40621d", "40621e") for n in range(4)
]  # fmt: skip
STATES_CSV = "time,icao24,lat,lon,velocity,heading,vertrate,callsign,onground,baroaltitude\n" + (
    "1748779200,40621d,50.94,6.95,60,90,0,ABC,False,900\n"
    "1748779201,40621d,50.941,6.95,60,90,0,ABC,False,900\n"
)
DAA = (
    "NAME lat lon alt vx vy vz time\nunitless [deg] [deg] [ft] [knot] [knot] [fpm] [s]\n"
    "Ownship 50.94 6.95 3000 100 0 0 0\nIntruder 50.95 6.95 3000 -100 0 0 0\n"
    "Ownship 50.94 6.951 3000 100 0 0 1\nIntruder 50.95 6.949 3000 -100 0 0 1\n"
)
SCN = (
    "00:00:00.00>CRE KL001 B744 50.94 6.95 90 FL100 250\n00:00:00.00>CRE KL002 A320 50.95 6.96 270 "
    "3000 200\n00:00:01.00>HDG KL001 100\n"
)
POSE_TEXTS = (
    "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n",
    "0.0 0 0 0 0 0 0 1\n0.1 1 0 0 0 0 0 1\n",
    "time,x,y,z,roll,pitch,yaw\n0,0,0,0,0,0,0\n0.1,1,0,0,0,1,2\n",
    "timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []\n0,1,2,3,1,0,0,0\n",
)


def _beast(folder: Path) -> list[bytes]:
    frames = [bytes.fromhex(line.split(",")[1]) for line in HEX.splitlines()[1:]]
    made = b""
    for number, frame in enumerate(frames, start=1):
        body = (12_000_000 * number).to_bytes(6, "big") + b"\x80" + frame
        made += b"\x1a3" + body.replace(b"\x1a", b"\x1a\x1a")
    return [made]


def _gzip(folder: Path) -> list[bytes]:
    return [gzip.compress(json.dumps(TRACE).encode()), gzip.compress(SBS.encode())]


def _ulog(folder: Path) -> list[bytes]:
    return real("logs/*.ulg", most=160_000)


def _ouster(folder: Path) -> list[bytes]:
    return real("lidar/ouster/OS-0*.pcap", most=200_000)


def _ouster_json(folder: Path) -> list[bytes]:
    return real("lidar/ouster/OS-0*.json", most=10**6)


FORMATS: dict[str, Format] = {
    "pcd": Format(".pcd", SCAN, _pcd),
    "ply": Format(".ply", SCAN, _ply),
    "las": Format(".las", SCAN, _las(".las")),
    "laz": Format(".laz", SCAN, _las(".laz"), apart=True),
    "point-table": Format(".csv", SCAN, _table),
    "npy": Format(".npy", SCAN, _npy),
    "kitti": Format(".bin", SCAN, _bin),
    "bag": Format(".bag", SCAN, _robot("bag1")),
    "db3": Format(".db3", SCAN, _robot("bag2_bare")),
    "mcap": Format(".mcap", SCAN, _both(_robot("mcap2"), _robot("mcap1"), _robot("mcap2_plain"))),
    "pcap": Format(".pcap", SCAN, _ouster, _metadata, apart=True),
    "pcap-json": Format(".json", (*SCAN[:2], "{stem}.pcap", *SCAN[3:]), _ouster_json, _packets,
                        apart=True),
    "poses": Format(".txt", POSES, _text(*POSE_TEXTS), _scan_beside),
    "poses-ulog": Format(".ulg", POSES, _ulog, _scan_beside, apart=True),
    "scene": Format(".toml", SCENE, _text(*SCENES)),
    "mission": Format(".toml", FLY, _text(*MISSIONS)),
    "plan": Format(".plan", FLY, _with_real(_json(PLAN), "maps/missions/*.plan")),
    "waypoints": Format(".waypoints", FLY,
                        _with_real(_text(WAYPOINTS), "maps/missions/*.waypoints")),
    "campaign": Format(".toml", ("campaign", "{}", "--out", "out"), _campaigns),
    "encounter-model": Format(".txt", ("risk", "{}", "--count", "2", "--workers", "1"), _model),
    "replay": Format(".mcap", REPLAY, _run),
    "obstacle-table": Format(".csv", MAP,
                             _with_real(_text(OBSTACLES), "maps/obstacles/*.csv")),
    "faa": Format(".dat", MAP, lambda folder: real("maps/obstacles/*.dat")),
    "geojson": Format(".geojson", MAP, _json(GEOJSON)),
    "cityjson": Format(".json", MAP, _json(CITY)),
    "geozones": Format(".json", MAP, lambda folder: real("maps/geozones/*.json", most=10**6)),
    "terrain": Format(".tif", MAP, _tif),
    "mode-s-hex": Format(".csv", TRAFFIC, _with_real(_text(HEX), "adsb/*.csv")),
    "avr": Format(".txt", TRAFFIC, _text(AVR)),
    "beast": Format(".bin", TRAFFIC, _with_real(_beast, "adsb/*.bin")),
    "sbs": Format(".txt", TRAFFIC, _text(SBS)),
    "aircraft-json": Format(".json", TRAFFIC,
                            _with_real(_json(AIRCRAFT), "adsb/*.jsonl")),
    "trace": Format(".json", TRAFFIC, _json(TRACE)),
    "states": Format(".json", TRAFFIC, _json(STATES)),
    "trajectories": Format(".json", TRAFFIC, _json(TRAJECTORIES)),
    "states-csv": Format(".csv", TRAFFIC, _text(STATES_CSV)),
    "daa": Format(".daa", TRAFFIC, _with_real(_text(DAA), "daa/daidalus/Scenarios/*.daa")),
    "bluesky": Format(".scn", TRAFFIC, _with_real(_text(SCN), "daa/bluesky/*.scn")),
    "traffic-gzip": Format(".gz", TRAFFIC, _gzip),
    "traffic-ulog": Format(".ulg", TRAFFIC, _ulog, apart=True),
}  # fmt: skip
