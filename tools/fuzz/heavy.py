"""Files of 10 MB that ask for much: nothing at all millions of times, or packed a thousandfold.

`python -m tools.fuzz.heavy [--only WORD]` reads each through its command in a process of its own
and prints the most memory that it and its children had together, the time, and what it said.
"""

from __future__ import annotations

import argparse
import gzip
import io
import json
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tools.fuzz.run import placed
from tools.fuzz.seeds import FORMATS

SIZE = 10_000_000
MOST_BYTES, MOST_S = 1_000_000_000, 300.0
"""That a command may take; of processor time."""
POLLED_S = 0.02
LASTS_S = 900.0


def _filled(head: str, item: str, tail: str, between: str = ",") -> Callable[[], bytes]:
    """One document of as many items as fit."""

    def make() -> bytes:
        count = (SIZE - len(head) - len(tail)) // (len(item) + len(between))
        return (head + between.join([item] * count) + tail).encode()

    return make


def _lines(head: str, line: str) -> Callable[[], bytes]:
    return lambda: (head + line * ((SIZE - len(head)) // len(line))).encode()


def _lzf_zeros(count: int) -> bytes:
    """What LZF makes of so many zeros: 264 of them for every three bytes."""
    return b"\x00\x00" + (b"\xe0\xff\x00") * ((count - 1) // 264)


def _pcd_packed() -> bytes:
    packed = _lzf_zeros(800_000_000)[: SIZE - 500]
    unpacked = 1 + 264 * ((len(packed) - 2) // 3)
    points = unpacked // 12
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {points}\nHEIGHT 1\nPOINTS {points}\nDATA binary_compressed\n"
    )
    return head.encode() + struct.pack("<II", len(packed), unpacked) + packed


def _pcd_bytes() -> bytes:
    """Points of three bytes, which take 24 as numbers."""
    points = (SIZE - 300) // 3
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 1 1 1\nTYPE I I I\nCOUNT 1 1 1\n"
        f"WIDTH {points}\nHEIGHT 1\nPOINTS {points}\nDATA binary\n"
    )
    return head.encode() + bytes(3 * points)


def _pcd_text() -> bytes:
    points = (SIZE - 300) // 6
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {points}\nHEIGHT 1\nPOINTS {points}\nDATA ascii\n"
    )
    return head.encode() + b"1 2 3\n" * points


def _pcd_fields() -> bytes:
    """A header of millions of fields."""
    names = "a " * ((SIZE - 200) // 8)
    ones = "1 " * ((SIZE - 200) // 8)
    kinds = "I " * ((SIZE - 200) // 8)
    head = f"VERSION 0.7\nFIELDS x y z {names}\nSIZE 4 4 4 {ones}\nTYPE F F F {kinds}\n"
    return (head + f"COUNT 1 1 1 {ones}\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n").encode()


def _ply_text() -> bytes:
    points = (SIZE - 300) // 6
    head = f"ply\nformat ascii 1.0\nelement vertex {points}\nproperty float x\nproperty float y\n"
    return (head + "property float z\nend_header\n").encode() + b"1 2 3\n" * points


def _ply_bytes() -> bytes:
    points = (SIZE - 300) // 3
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {points}\n"
    head += "property char x\nproperty char y\nproperty char z\nend_header\n"
    return head.encode() + bytes(3 * points)


def _npy(shape: str, kind: str, data: bytes) -> bytes:
    head = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}"
    head = head.ljust(118 - 1) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + data


def _tif(kind: str, side: int) -> Callable[[], bytes]:
    def make() -> bytes:
        import numpy as np
        from rasterio.io import MemoryFile
        from rasterio.transform import from_origin
        from rasterio.windows import Window

        step = 1.0
        with MemoryFile() as memory:
            with memory.open(
                driver="GTiff", width=side, height=side, count=1, dtype=kind, compress="deflate",
                crs="EPSG:25832", transform=from_origin(356_000.0, 5_645_000.0, step, step),
            ) as raster:  # fmt: skip
                block = np.full((100, side), 50, dtype=kind)
                for row in range(0, side, 100):
                    raster.write(block, 1, window=Window(0, row, side, 100))
            return bytes(memory.read())

    return make


def _laz(count: int) -> Callable[[], bytes]:
    def make() -> bytes:
        import laspy
        import numpy as np

        header = laspy.LasHeader(point_format=6, version="1.4")
        las = laspy.LasData(header)
        las.x = las.y = las.z = np.zeros(count)
        file = io.BytesIO()
        las.write(file, do_compress=True)
        return file.getvalue()[:SIZE]

    return make


def _las() -> bytes:
    import laspy
    import numpy as np

    las = laspy.LasData(laspy.LasHeader(point_format=0, version="1.2"))
    las.x = las.y = las.z = np.zeros((SIZE - 1000) // 20)
    file = io.BytesIO()
    las.write(file)
    return file.getvalue()


def _mcap(packed: str, messages: int, each: int) -> Callable[[], bytes]:
    """Messages of zeros in chunks that pack well."""

    def make() -> bytes:
        from mcap.writer import CompressionType, Writer

        file = io.BytesIO()
        writer = Writer(file, chunk_size=each * 2, compression=CompressionType[packed])
        writer.start(profile="ros2")
        schema = writer.register_schema("sensor_msgs/msg/PointCloud2", "ros2msg", b"uint8[] data")
        channel = writer.register_channel("/points", "cdr", schema)
        for n in range(messages):
            writer.add_message(channel, n, bytes(each), n, n)
        writer.finish()
        return file.getvalue()[:SIZE]

    return make


def _gzipped(content: Callable[[], bytes], times: int = 1) -> Callable[[], bytes]:
    return lambda: gzip.compress(content() * times, 6)[:SIZE]


def _gzip_members() -> bytes:
    one = gzip.compress(b"", 9)
    return one * (SIZE // len(one))


def _deep(opening: str) -> Callable[[], bytes]:
    return lambda: (opening * (SIZE // len(opening))).encode()


def _avr() -> bytes:
    return b"*8D40621D58C382D690C8AC2863A7;\n" * (SIZE // 31)


def _beast() -> bytes:
    frame = b"\x1a3" + bytes(7) + bytes.fromhex("8D40621D58C382D690C8AC2863A7")
    return frame * (SIZE // len(frame))


def _run_page() -> bytes:
    """A recording of a flight with a chunk that unpacks to much."""
    return _mcap("ZSTD", 40, 100_000_000)()


HEAD_OF_MAP = '{"type":"FeatureCollection","features":['
POINT = '{"type":"Feature","properties":{"height":1},"geometry":{"type":"Point","coordinates":'
POINT += "[6.9,50.9]}}"
CITY = '{"type":"CityJSON","version":"1.1","metadata":{"referenceSystem":"EPSG:7415"},'
TIME = '"now":1748779200,"hex":"40621d","lat":50.9,"lon":6.9'
MISSION = '[mission]\nname = "x"\nwaypoints_m = '


class Heavy(NamedTuple):
    """A file: of which format of the fuzzer, and what it holds."""

    format: str
    make: Callable[[], bytes]


HEAVY: dict[str, Heavy] = {
    "geojson-empty-objects": Heavy("geojson", _filled(HEAD_OF_MAP, "{}", "]}")),
    "geojson-short": Heavy(
        "geojson", lambda: (HEAD_OF_MAP + ",".join(["1"] * 200_000) + "]}").encode()
    ),
    "geojson-numbers": Heavy("geojson", _filled(HEAD_OF_MAP, "1", "]}")),
    "geojson-points": Heavy("geojson", _filled(HEAD_OF_MAP, POINT, "]}")),
    "geojson-ring": Heavy(
        "geojson",
        _filled(
            HEAD_OF_MAP + '{"type":"Feature","properties":{"height":1},"geometry":'
            '{"type":"Polygon","coordinates":[[', "[1,2]", "]]}}]}",
        ),
    ),
    "geojson-rings": Heavy(
        "geojson",
        _filled(
            HEAD_OF_MAP + '{"type":"Feature","properties":{"height":1},"geometry":'
            '{"type":"MultiPolygon","coordinates":[', "[[[1,2],[1,3],[2,3]]]", "]}}]}",
        ),
    ),
    "geojson-geometries": Heavy(
        "geojson",
        _filled(
            HEAD_OF_MAP + '{"type":"Feature","properties":{"height":1},"geometry":'
            '{"type":"GeometryCollection","geometries":[', '{"type":""}', "]}}]}",
        ),
    ),
    "geojson-deep": Heavy("geojson", _deep("[")),
    "geojson-empty-lists": Heavy("geojson", _filled('{"x":[', "[]", "]}")),
    "city-vertices": Heavy(
        "cityjson", _filled(CITY + '"CityObjects":{},"vertices":[', "[0,0,0]", "]}")
    ),
    "city-no-vertices": Heavy(
        "cityjson", _filled(CITY + '"CityObjects":{},"vertices":[', "0", "]}")
    ),
    "city-objects": Heavy(
        "cityjson",
        lambda: (
            CITY + '"vertices":[],"CityObjects":{'
            + ",".join(f'"{n}":{{"type":""}}' for n in range(SIZE // 22)) + "}}"
        ).encode(),
    ),
    "city-bad-objects": Heavy(
        "cityjson",
        lambda: (
            CITY + '"vertices":[],"CityObjects":{'
            + ",".join(f'"{n}":1' for n in range(SIZE // 11)) + "}}"
        ).encode(),
    ),
    "city-boundaries": Heavy(
        "cityjson",
        _filled(
            CITY + '"vertices":[[0,0,0],[9,0,0],[9,9,9]],"CityObjects":{"a":{"type":"Building",'
            '"geometry":[{"type":"MultiSurface","lod":1,"boundaries":[', "[[0,1,2]]", "]}]}}}",
        ),
    ),
    "zones-empty": Heavy(
        "geozones", _filled('{"title":"x","UASZoneList":[', "{}", "]}")
    ),
    "zones-318": Heavy(
        "geozones",
        _filled('{"type":"FeatureCollection","title":"x","features":[',
                '{"type":"Feature","properties":{"identifier":"a"},"geometry":null}', "]}"),
    ),
    "plan-items": Heavy(
        "plan",
        _filled('{"fileType":"Plan","mission":{"plannedHomePosition":[0,0,0],"items":[',
                "{}", "]}}"),
    ),
    "plan-rally": Heavy(
        "plan",
        _filled('{"fileType":"Plan","mission":{"plannedHomePosition":[0,0,0],"items":[]},'
                '"rallyPoints":{"points":[', "1", "]}}"),
    ),
    "waypoints": Heavy(
        "waypoints",
        _lines("QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 4 1\n", "1 0 3 16 0 0 0 0 47 8 20 1\n"),
    ),
    "obstacles": Heavy(
        "obstacle-table", _lines("latitude,longitude,height_m\n", "50.9,6.9,9\n")
    ),
    "obstacles-bad": Heavy("obstacle-table", _lines("latitude,longitude,height_m\n", ",,\n")),
    "obstacles-wide": Heavy("obstacle-table", lambda: b"latitude,longitude,height_m" + b"," * SIZE),
    "terrain-bytes": Heavy("terrain", _tif("uint8", 7_000)),
    "terrain-doubles": Heavy("terrain", _tif("float64", 7_000)),
    "pcd-packed": Heavy("pcd", _pcd_packed),
    "pcd-bytes": Heavy("pcd", _pcd_bytes),
    "pcd-text": Heavy("pcd", _pcd_text),
    "pcd-fields": Heavy("pcd", _pcd_fields),
    "ply-text": Heavy("ply", _ply_text),
    "ply-bytes": Heavy("ply", _ply_bytes),
    "npy-bytes": Heavy(
        "npy", lambda: _npy(f"({(SIZE - 128) // 3}, 3)", "|i1", bytes((SIZE - 128) // 3 * 3))
    ),
    "npy-promised": Heavy("npy", lambda: _npy("(400000000, 3)", "<f8", bytes(SIZE - 128))),
    "npy-no-bytes": Heavy("npy", lambda: _npy("(1000000000, 3)", "|V0", b"")),
    "npy-no-records": Heavy(
        "npy",
        lambda: _npy(
            "(1000000000,)",
            "X", b"",
        ).replace(b"'X'", b"[('x','V0'),('y','V0'),('z','V0')]"),
    ),
    "kitti": Heavy("kitti", lambda: bytes(SIZE)),
    "table": Heavy("point-table", _lines("", "1,2,3\n")),
    "table-blank": Heavy("point-table", _lines("1,2,3\n", "\n")),
    "table-bad": Heavy("point-table", _lines("", "a\n")),
    "table-wide": Heavy("point-table", _lines("", "1,")),
    "table-returns": Heavy("point-table", _lines("1 2 3\n", "\x0b")),
    "las": Heavy("las", _las),
    "laz": Heavy("laz", _laz(30_000_000)),
    "mcap-zstd": Heavy("mcap", _mcap("ZSTD", 20, 100_000_000)),
    "mcap-lz4": Heavy("mcap", _mcap("LZ4", 20, 100_000_000)),
    "mcap-many": Heavy("mcap", _mcap("ZSTD", 200_000, 1)),
    "replay-zstd": Heavy("replay", _run_page),
    "replay-many": Heavy("replay", _mcap("ZSTD", 200_000, 1)),
    "poses": Heavy("poses", _lines("", "1 0 0 0 0 1 0 0 0 0 1 0\n")),
    "poses-blank": Heavy("poses", _lines("1 0 0 0 0 1 0 0 0 0 1 0\n", "\n")),
    "poses-bad": Heavy("poses", _lines("", "a\n")),
    "scene-empty-tables": Heavy("scene", _lines("", "[[obstacle]]\n")),
    "scene-lists": Heavy("scene", _filled("a = [", "[]", "]\n")),
    "scene-numbers": Heavy("scene", _filled("a = [", "1e99", "]\n")),
    "scene-keys": Heavy(
        "scene", lambda: "".join(f"a{n}=1\n" for n in range(SIZE // 11)).encode()
    ),
    "mission-waypoints": Heavy("mission", _filled(MISSION + "[", "[1,2,3]", "]\n")),
    "mission-bad-waypoints": Heavy("mission", _filled(MISSION + "[", "1", "]\n")),
    "mission-obstacles": Heavy("mission", _lines(MISSION + "[[1,2,3]]\n", "[[obstacle]]\n")),
    "campaign-families": Heavy("campaign", _lines('name = "x"\n', "[[family]]\n")),
    "campaign-planners": Heavy("campaign", _filled('name="x"\nplanners=[', '""', "]\n")),
    "model-lines": Heavy("encounter-model", _lines("# labels_initial\n", "1 ")),
    "model-label": Heavy("encounter-model", _lines("# labels_initial\n", '"a", ')),
    "avr": Heavy("avr", _avr),
    "beast": Heavy("beast", _beast),
    "sbs": Heavy(
        "sbs",
        _lines("", "MSG,3,1,1,40621D,1,2025/06/01,12:00:00.000,,,,3000,,,50.9,6.95,,,0,0,0,0\n"),
    ),
    "sbs-nothing": Heavy("sbs", _lines("", "MSG,3,\n")),
    "aircraft": Heavy("aircraft-json", _filled('{"now":1748779200,"aircraft":[', "{}", "]}")),
    "aircraft-lines": Heavy("aircraft-json", _lines("", "{" + TIME + "}\n")),
    "aircraft-empty-lines": Heavy("aircraft-json", _lines("{" + TIME + "}\n", "{}\n")),
    "aircraft-names": Heavy(
        "aircraft-json",
        lambda: "".join(
            f'{{"now":{n},"hex":"{n % 2**24:06x}","lat":50.9,"lon":6.9}}\n'
            for n in range(SIZE // 55)
        ).encode(),
    ),
    "trace": Heavy("trace", _filled('{"icao":"40621d","timestamp":1,"trace":[', "[]", "]}")),
    "trace-rows": Heavy(
        "trace",
        _filled('{"icao":"40621d","timestamp":1,"trace":[', "[1,50,6,3000]", "]}"),
    ),
    "states": Heavy("states", _filled('{"time":1,"states":[', "[]", "]}")),
    "trajectories": Heavy("trajectories", _filled("[", "{}", "]")),
    "trajectories-empty": Heavy(
        "trajectories",
        _filled("[" + json.dumps({"timestamp": 1, "icao24": "40621d", "latitude": 1.0,
                                  "longitude": 1.0}) + ",", "{}", "]"),
    ),
    "states-csv": Heavy(
        "states-csv",
        _lines("time,icao24,lat,lon,velocity,heading,vertrate,callsign,onground,baroaltitude\n",
               ",,,,,,,,,\n"),
    ),
    "hex": Heavy("mode-s-hex", _lines("timestamp,frame\n", "1.0,8D40621D58C382D690C8AC2863A7\n")),
    "hex-bad": Heavy("mode-s-hex", _lines("timestamp,frame\n", ",\n")),
    "daa": Heavy(
        "daa",
        _lines("NAME lat lon alt vx vy vz time\nunitless [deg] [deg] [ft] [knot] [knot] [fpm] [s]"
               "\n", "A 50.9 6.9 3000 9 0 0 0\n"),
    ),
    "daa-distinct": Heavy(
        "daa",
        lambda: (
            "NAME lat lon alt vx vy vz time\nunitless [deg] [deg] [ft] [knot] [knot] [fpm] [s]\n"
            + "".join(f"A{n % 1000} 50.9 6.9 3000 9 0 0 {n // 1000}\n" for n in range(SIZE // 34))
        ).encode(),
    ),
    "bluesky": Heavy("bluesky", _lines("", "00:00:00.00>CRE A B744 50 6 90 FL100 250\n")),
    "bluesky-names": Heavy(
        "bluesky",
        lambda: "".join(
            f"00:00:00.00>CRE A{n} B744 50 6 90 FL100 250\n" for n in range(SIZE // 48)
        ).encode(),
    ),
    "gzip-zeros": Heavy("traffic-gzip", _gzipped(lambda: bytes(10**6), 3000)),
    "gzip-members": Heavy("traffic-gzip", _gzip_members),
    "gzip-lines": Heavy("traffic-gzip", _gzipped(_lines("", "{" + TIME + "}\n"), 3)),
    "gzip-json": Heavy(
        "traffic-gzip", _gzipped(_filled('{"now":1748779200,"aircraft":[', "{}", "]}"), 1)
    ),
}  # fmt: skip


class Taken(NamedTuple):
    """What reading a file took and said."""

    memory_bytes: int
    """Of the process and its children, at once."""
    cpu_s: float
    status: int
    said: str
    """On standard error."""
    ended: bool = True


def taken(name: str, limit_s: float = LASTS_S) -> Taken:
    """A heavy file through its command, in a process of its own."""
    heavy = HEAVY[name]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        words, _ = placed(FORMATS[heavy.format], heavy.format, heavy.make(), folder)
        with (folder / "said").open("wb") as said:
            process = subprocess.Popen(
                [sys.executable, "-m", "clearway", *words],
                cwd=folder,
                stdout=subprocess.DEVNULL,
                stderr=said,
                start_new_session=True,
            )
            most, cpu, started = 0, 0.0, time.monotonic()
            while process.poll() is None:
                now, used = _of_tree(process.pid)
                most, cpu = max(most, now), max(cpu, used)
                if time.monotonic() - started > limit_s:
                    process.kill()
                    process.wait()
                    return Taken(most, cpu, -1, "", ended=False)
                time.sleep(POLLED_S)
        return Taken(most, cpu, process.returncode, (folder / "said").read_text("utf-8", "replace"))


def _of_tree(pid: int) -> tuple[int, float]:
    """Memory and processor time of a process and its children; the most that each has had."""
    memory, cpu = 0, 0.0
    for one in (pid, *_children(pid)):
        try:
            status = Path(f"/proc/{one}/status").read_text()
            times = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        memory += next(
            (1024 * int(line.split()[1]) for line in status.splitlines() if "VmHWM" in line), 0
        )
        cpu += 0.01 * sum(map(int, times[11:15]))
    return memory, cpu


def _children(pid: int) -> list[int]:
    try:
        words = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return []
    return [int(word) for word in words]


def wrong(one: Taken) -> list[str]:
    """What a command may not do with such a file."""
    found = []
    if not one.ended or one.cpu_s > MOST_S:
        found.append(f"{one.cpu_s:.0f} s of processor time")
    if one.memory_bytes > MOST_BYTES:
        found.append(f"{one.memory_bytes / 1e6:.0f} MB")
    if one.status not in (-1, 0, 1, 2, 3):
        found.append(f"status {one.status}")
    if "takes more memory" in one.said or "Traceback" in one.said:
        found.append(one.said[:300])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="parts of the names of those to try, by commas")
    parser.add_argument("--after", default="", help="those after this one")
    options = parser.parse_args()
    names = list(HEAVY)
    names = names[names.index(options.after) + 1 :] if options.after else names
    for name in names:
        if any(part in name for part in options.only.split(",")):
            one = taken(name)
            said = " | ".join(
                line for line in one.said.splitlines() if not line.startswith("preparing")
            )
            print(
                f"{name:24} {one.memory_bytes / 1e6:6.0f} MB {one.cpu_s:6.1f} s "
                f"status {one.status:3d} {'WRONG ' if wrong(one) else ''}{said[:110]}",
                flush=True,
            )


if __name__ == "__main__":
    main()
