"""Files of 10 MB that ask for much, by the format of the fuzzer that reads them."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import NamedTuple

from tools.fuzz.heavy_content import (
    CITY,
    HEAD_OF_MAP,
    POINT,
    SIZE,
    avr_lines,
    beast_frames,
    deep,
    filled,
    gzip_members,
    gzipped,
    las_zeros,
    laz_of,
    mcap_of,
    npy_of,
    pcd_bytes,
    pcd_fields,
    pcd_packed,
    pcd_text,
    ply_bytes,
    ply_text,
    repeated,
    run_page,
    tif_of,
)
from tools.fuzz.heavy_packed import (
    KML,
    OSM,
    corners_many,
    houses_many,
    laughs,
    pbf_blocks,
    sample_many,
    zipped,
    zipped_many,
    zstd_frames,
)

TIME = '"now":1748779200,"hex":"40621d","lat":50.9,"lon":6.9'
MISSION = '[mission]\nname = "x"\nwaypoints_m = '


class Heavy(NamedTuple):
    """A file: of which format of the fuzzer, and what it holds."""

    format: str
    make: Callable[[], bytes]


HEAVY: dict[str, Heavy] = {
    "geojson-empty-objects": Heavy("geojson", filled(HEAD_OF_MAP, "{}", "]}")),
    "geojson-short": Heavy(
        "geojson", lambda: (HEAD_OF_MAP + ",".join(["1"] * 200_000) + "]}").encode()
    ),
    "geojson-numbers": Heavy("geojson", filled(HEAD_OF_MAP, "1", "]}")),
    "geojson-points": Heavy("geojson", filled(HEAD_OF_MAP, POINT, "]}")),
    "geojson-ring": Heavy(
        "geojson",
        filled(
            HEAD_OF_MAP + '{"type":"Feature","properties":{"height":1},"geometry":'
            '{"type":"Polygon","coordinates":[[', "[1,2]", "]]}}]}",
        ),
    ),
    "geojson-rings": Heavy(
        "geojson",
        filled(
            HEAD_OF_MAP + '{"type":"Feature","properties":{"height":1},"geometry":'
            '{"type":"MultiPolygon","coordinates":[', "[[[1,2],[1,3],[2,3]]]", "]}}]}",
        ),
    ),
    "geojson-geometries": Heavy(
        "geojson",
        filled(
            HEAD_OF_MAP + '{"type":"Feature","properties":{"height":1},"geometry":'
            '{"type":"GeometryCollection","geometries":[', '{"type":""}', "]}}]}",
        ),
    ),
    "geojson-deep": Heavy("geojson", deep("[")),
    "geojson-empty-lists": Heavy("geojson", filled('{"x":[', "[]", "]}")),
    "city-vertices": Heavy(
        "cityjson", filled(CITY + '"CityObjects":{},"vertices":[', "[0,0,0]", "]}")
    ),
    "city-no-vertices": Heavy(
        "cityjson", filled(CITY + '"CityObjects":{},"vertices":[', "0", "]}")
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
        filled(
            CITY + '"vertices":[[0,0,0],[9,0,0],[9,9,9]],"CityObjects":{"a":{"type":"Building",'
            '"geometry":[{"type":"MultiSurface","lod":1,"boundaries":[', "[[0,1,2]]", "]}]}}}",
        ),
    ),
    "zones-empty": Heavy(
        "geozones", filled('{"title":"x","UASZoneList":[', "{}", "]}")
    ),
    "zones-318": Heavy(
        "geozones",
        filled('{"type":"FeatureCollection","title":"x","features":[',
                '{"type":"Feature","properties":{"identifier":"a"},"geometry":null}', "]}"),
    ),
    "plan-items": Heavy(
        "plan",
        filled('{"fileType":"Plan","mission":{"plannedHomePosition":[0,0,0],"items":[',
                "{}", "]}}"),
    ),
    "plan-rally": Heavy(
        "plan",
        filled('{"fileType":"Plan","mission":{"plannedHomePosition":[0,0,0],"items":[]},'
                '"rallyPoints":{"points":[', "1", "]}}"),
    ),
    "waypoints": Heavy(
        "waypoints",
        repeated("QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 4 1\n", "1 0 3 16 0 0 0 0 47 8 20 1\n"),
    ),
    "obstacles": Heavy(
        "obstacle-table", repeated("latitude,longitude,height_m\n", "50.9,6.9,9\n")
    ),
    "obstacles-bad": Heavy("obstacle-table", repeated("latitude,longitude,height_m\n", ",,\n")),
    "obstacles-wide": Heavy("obstacle-table", lambda: b"latitude,longitude,height_m" + b"," * SIZE),
    "terrain-bytes": Heavy("terrain", tif_of("uint8", 4_400)),
    "terrain-doubles": Heavy("terrain", tif_of("float64", 4_400)),
    "pcd-packed": Heavy("pcd", pcd_packed),
    "pcd-bytes": Heavy("pcd", pcd_bytes),
    "pcd-text": Heavy("pcd", pcd_text),
    "pcd-fields": Heavy("pcd", pcd_fields),
    "ply-text": Heavy("ply", ply_text),
    "ply-bytes": Heavy("ply", ply_bytes),
    "npy-bytes": Heavy(
        "npy", lambda: npy_of(f"({(SIZE - 128) // 3}, 3)", "|i1", bytes((SIZE - 128) // 3 * 3))
    ),
    "npy-promised": Heavy("npy", lambda: npy_of("(400000000, 3)", "<f8", bytes(SIZE - 128))),
    "npy-no-bytes": Heavy("npy", lambda: npy_of("(1000000000, 3)", "|V0", b"")),
    "npy-no-records": Heavy(
        "npy",
        lambda: npy_of(
            "(1000000000,)",
            "X", b"",
        ).replace(b"'X'", b"[('x','V0'),('y','V0'),('z','V0')]"),
    ),
    "kitti": Heavy("kitti", lambda: bytes(SIZE)),
    "table": Heavy("point-table", repeated("", "1,2,3\n")),
    "table-blank": Heavy("point-table", repeated("1,2,3\n", "\n")),
    "table-bad": Heavy("point-table", repeated("", "a\n")),
    "table-wide": Heavy("point-table", repeated("", "1,")),
    "table-returns": Heavy("point-table", repeated("1 2 3\n", "\x0b")),
    "las": Heavy("las", las_zeros),
    "laz": Heavy("laz", laz_of(30_000_000)),
    "mcap-zstd": Heavy("mcap", mcap_of("ZSTD", 20, 100_000_000)),
    "mcap-lz4": Heavy("mcap", mcap_of("LZ4", 20, 100_000_000)),
    "mcap-many": Heavy("mcap", mcap_of("ZSTD", 200_000, 1)),
    "replay-zstd": Heavy("replay", run_page),
    "replay-many": Heavy("replay", mcap_of("ZSTD", 200_000, 1)),
    "poses": Heavy("poses", repeated("", "1 0 0 0 0 1 0 0 0 0 1 0\n")),
    "poses-blank": Heavy("poses", repeated("1 0 0 0 0 1 0 0 0 0 1 0\n", "\n")),
    "poses-bad": Heavy("poses", repeated("", "a\n")),
    "scene-empty-tables": Heavy("scene", repeated("", "[[obstacle]]\n")),
    "scene-lists": Heavy("scene", filled("a = [", "[]", "]\n")),
    "scene-numbers": Heavy("scene", filled("a = [", "1e99", "]\n")),
    "scene-keys": Heavy(
        "scene", lambda: "".join(f"a{n}=1\n" for n in range(SIZE // 11)).encode()
    ),
    "mission-waypoints": Heavy("mission", filled(MISSION + "[", "[1,2,3]", "]\n")),
    "mission-bad-waypoints": Heavy("mission", filled(MISSION + "[", "1", "]\n")),
    "mission-obstacles": Heavy("mission", repeated(MISSION + "[[1,2,3]]\n", "[[obstacle]]\n")),
    "campaign-families": Heavy("campaign", repeated('name = "x"\n', "[[family]]\n")),
    "campaign-planners": Heavy("campaign", filled('name="x"\nplanners=[', '""', "]\n")),
    "model-lines": Heavy("encounter-model", repeated("# labels_initial\n", "1 ")),
    "model-label": Heavy("encounter-model", repeated("# labels_initial\n", '"a", ')),
    "avr": Heavy("avr", avr_lines),
    "beast": Heavy("beast", beast_frames),
    "sbs": Heavy(
        "sbs",
        repeated("", "MSG,3,1,1,40621D,1,2025/06/01,12:00:00.000,,,,3000,,,50.9,6.95,,,0,0,0,0\n"),
    ),
    "sbs-nothing": Heavy("sbs", repeated("", "MSG,3,\n")),
    "aircraft": Heavy("aircraft-json", filled('{"now":1748779200,"aircraft":[', "{}", "]}")),
    "aircraft-lines": Heavy("aircraft-json", repeated("", "{" + TIME + "}\n")),
    "aircraft-empty-lines": Heavy("aircraft-json", repeated("{" + TIME + "}\n", "{}\n")),
    "aircraft-names": Heavy(
        "aircraft-json",
        lambda: "".join(
            f'{{"now":{n},"hex":"{n % 2**24:06x}","lat":50.9,"lon":6.9}}\n'
            for n in range(SIZE // 55)
        ).encode(),
    ),
    "trace": Heavy("trace", filled('{"icao":"40621d","timestamp":1,"trace":[', "[]", "]}")),
    "trace-rows": Heavy(
        "trace",
        filled('{"icao":"40621d","timestamp":1,"trace":[', "[1,50,6,3000]", "]}"),
    ),
    "states": Heavy("states", filled('{"time":1,"states":[', "[]", "]}")),
    "trajectories": Heavy("trajectories", filled("[", "{}", "]")),
    "trajectories-empty": Heavy(
        "trajectories",
        filled("[" + json.dumps({"timestamp": 1, "icao24": "40621d", "latitude": 1.0,
                                  "longitude": 1.0}) + ",", "{}", "]"),
    ),
    "states-csv": Heavy(
        "states-csv",
        repeated("time,icao24,lat,lon,velocity,heading,vertrate,callsign,onground,baroaltitude\n",
               ",,,,,,,,,\n"),
    ),
    "hex": Heavy("mode-s-hex", repeated("timestamp,frame\n", "1.0,8D40621D58C382D690C8AC2863A7\n")),
    "hex-bad": Heavy("mode-s-hex", repeated("timestamp,frame\n", ",\n")),
    "daa": Heavy(
        "daa",
        repeated("NAME lat lon alt vx vy vz time\nunitless [deg] [deg] [ft] [knot] [knot] [fpm] [s]"
               "\n", "A 50.9 6.9 3000 9 0 0 0\n"),
    ),
    "daa-distinct": Heavy(
        "daa",
        lambda: (
            "NAME lat lon alt vx vy vz time\nunitless [deg] [deg] [ft] [knot] [knot] [fpm] [s]\n"
            + "".join(f"A{n % 1000} 50.9 6.9 3000 9 0 0 {n // 1000}\n" for n in range(SIZE // 34))
        ).encode(),
    ),
    "bluesky": Heavy("bluesky", repeated("", "00:00:00.00>CRE A B744 50 6 90 FL100 250\n")),
    "bluesky-names": Heavy(
        "bluesky",
        lambda: "".join(
            f"00:00:00.00>CRE A{n} B744 50 6 90 FL100 250\n" for n in range(SIZE // 48)
        ).encode(),
    ),
    "gzip-zeros": Heavy("traffic-gzip", gzipped(lambda: bytes(10**6), 3000)),
    "gzip-members": Heavy("traffic-gzip", gzip_members),
    "gzip-lines": Heavy("traffic-gzip", gzipped(repeated("", "{" + TIME + "}\n"), 3)),
    "gzip-json": Heavy(
        "traffic-gzip", gzipped(filled('{"now":1748779200,"aircraft":[', "{}", "]}"), 1)
    ),
    "kml-corners": Heavy(
        "kml",
        filled(f"{KML}<LineString><coordinates>", "6.9,50.9,9", "</coordinates></LineString>"
               "</Placemark></Document></kml>", " "),
    ),
    "kml-places": Heavy(
        "kml", filled(KML, "</Placemark><Placemark>", "</Placemark></Document></kml>", "")
    ),
    "kml-laughs": Heavy("kml", laughs),
    "kmz-blanks": Heavy("kmz", zipped("doc.kml", KML.encode())),
    "kmz-template": Heavy("kmz", zipped("wpmz/waylines.wpml", KML.encode())),
    "kmz-many": Heavy("kmz", zipped_many),
    "db3-zstd": Heavy("db3-zstd", zstd_frames),
    "gpkg": Heavy("gpkg", houses_many),
    "shp": Heavy("shp", corners_many),
    "osm-nodes": Heavy(
        "osm", filled(OSM, '<node id="1" version="1" lat="50.9" lon="6.9"/>', "</osm>", "")
    ),
    "osm-masts": Heavy(
        "osm",
        filled(OSM, '<node id="1" version="1" lat="50.9" lon="6.9"><tag k="man_made" v="mast"/>'
               '<tag k="height" v="9"/></node>', "</osm>", ""),
    ),
    "osm-way": Heavy(
        "osm",
        filled(f'{OSM}<node id="1" version="1" lat="50.9" lon="6.9"/><way id="2" version="1">',
               '<nd ref="1"/>', '<tag k="building" v="yes"/><tag k="height" v="9"/></way></osm>',
               ""),
    ),
    "osm-pbf": Heavy("osm-pbf", pbf_blocks),
    "gdl90": Heavy("gdl90", sample_many("tablet.gdl90")),
    "ogn": Heavy("ogn", sample_many("gliders.txt")),
    "tlog": Heavy("tlog", sample_many("flight.tlog")),
    "dataflash": Heavy("dataflash", sample_many("copter.bin")),
}  # fmt: skip
