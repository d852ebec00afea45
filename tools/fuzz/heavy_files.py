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
}  # fmt: skip
