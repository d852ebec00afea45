"""How whole files of every format are made, and small real ones found where they are at hand."""

from __future__ import annotations

import gzip
import io
import json
import os
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tools.fuzz.texts import HEX, MISSIONS, SBS, TRACE

REPOSITORY = Path(__file__).parents[2]
DATA = Path(os.environ.get("CLEARWAY_DATA", REPOSITORY.parent / "shared" / "data"))
MOST_REAL = 8_000
"""Bytes that are taken of a real file of text."""


def points() -> Any:
    """[n, 3] of a wall and a pole ahead, in the sensor's frame."""
    azimuth, elevation = np.meshgrid(np.linspace(-0.6, 0.6, 25), np.linspace(-0.2, 0.2, 5))
    distance = np.where(np.abs(azimuth) < 0.1, 4.0, 8.0)
    flat = distance * np.cos(elevation)
    return np.stack(
        [flat * np.cos(azimuth), flat * np.sin(azimuth), distance * np.sin(elevation)], axis=-1
    ).reshape(-1, 3)


def text_files(*texts: str) -> Callable[[Path], list[bytes]]:
    return lambda folder: [text.encode() for text in texts]


def sample_files(*names: str) -> Callable[[Path], list[bytes]]:
    """What `clearway sample` writes by these names."""

    def make(folder: Path) -> list[bytes]:
        from clearway.studies.samples import SAMPLES

        found = []
        for one in SAMPLES:
            for name in names:
                beside = one.name[-4:] == ".shp" and one.name[:-4] == name[:-4]
                if one.name == name.partition("/")[0] or beside:
                    one.write(folder / one.name, np.random.default_rng(1))
                    found.append((folder / name).read_bytes())
        return found

    return make


def shapefile_beside(*suffixes: str) -> Callable[[Path], dict[str, bytes]]:
    """Parts of the sample's Shapefile."""
    return lambda folder: {one: sample_files(f"houses{one}")(folder)[0] for one in suffixes}


def json_files(*values: Any) -> Callable[[Path], list[bytes]]:
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


def with_real(make: Callable[[Path], list[bytes]], *names: str, most: int = MOST_REAL) -> Any:
    return lambda folder: [*make(folder), *real(*names, most=most)]


def pcd_files(folder: Path) -> list[bytes]:
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


def ply_files(folder: Path) -> list[bytes]:
    table = points()
    head = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
    head += "property float z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"
    rows = "\n".join(" ".join(f"{value:.3f}" for value in row) for row in table)
    return [
        (head.format("ascii", len(table)) + rows + "\n").encode(),
        head.format("binary_little_endian", len(table)).encode() + table.astype("<f4").tobytes(),
        head.format("binary_big_endian", len(table)).encode() + table.astype(">f4").tobytes(),
    ]


def las_files(suffix: str) -> Callable[[Path], list[bytes]]:
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


def table_files(folder: Path) -> list[bytes]:
    rows = "\n".join(",".join(f"{value:.3f}" for value in row) for row in points())
    return [f"x,y,z\n{rows}\n".encode(), rows.replace(",", " ").encode() + b"\n"]


def npy_files(folder: Path) -> list[bytes]:
    found = []
    records = np.zeros(20, dtype=[("x", "f4"), ("y", "f4"), ("z", "f4"), ("i", "u1")])
    records["x"] = np.arange(20)
    for array in (points(), points().astype("f4"), records):
        file = io.BytesIO()
        np.save(file, array)
        found.append(file.getvalue())
    return found


def bin_files(folder: Path) -> list[bytes]:
    table = np.hstack([points(), np.full((len(points()), 1), 0.5)])
    return [table.astype("<f4").tobytes()]


def robot_files(kind: str) -> Callable[[Path], list[bytes]]:
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


def zstd_files(make: Callable[[Path], list[bytes]]) -> Callable[[Path], list[bytes]]:
    """The same, packed."""

    def packed(folder: Path) -> list[bytes]:
        from zstandard import ZstdCompressor

        return [ZstdCompressor().compress(one) for one in make(folder)]

    return packed


def both(*makers: Callable[[Path], list[bytes]]) -> Callable[[Path], list[bytes]]:
    return lambda folder: [one for maker in makers for one in maker(folder)]


def tif_files(folder: Path) -> list[bytes]:
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


def run_files(folder: Path) -> list[bytes]:
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


def metadata_beside(folder: Path) -> dict[str, bytes]:
    return {".json": real("lidar/ouster/OS-0*.json", most=10**6)[0]}


def packets_beside(folder: Path) -> dict[str, bytes]:
    return {".pcap": real("lidar/ouster/OS-0*.pcap", most=200_000)[0]}


def scan_beside(folder: Path) -> dict[str, bytes]:
    return {"scan.bin": bin_files(folder)[0]}


def campaign_files(folder: Path) -> list[bytes]:
    shipped = (REPOSITORY / "src/clearway/studies/campaigns").glob("*.toml")
    return [path.read_bytes() for path in sorted(shipped)]


def model_files(folder: Path) -> list[bytes]:
    return [(REPOSITORY / "src/clearway/studies/encounter_model/made-up.txt").read_bytes()]


def beast_files(folder: Path) -> list[bytes]:
    frames = [bytes.fromhex(line.split(",")[1]) for line in HEX.splitlines()[1:]]
    made = b""
    for number, frame in enumerate(frames, start=1):
        body = (12_000_000 * number).to_bytes(6, "big") + b"\x80" + frame
        made += b"\x1a3" + body.replace(b"\x1a", b"\x1a\x1a")
    return [made]


def gzip_files(folder: Path) -> list[bytes]:
    return [gzip.compress(json.dumps(TRACE).encode()), gzip.compress(SBS.encode())]


def ulog_files(folder: Path) -> list[bytes]:
    return real("logs/*.ulg", most=160_000)


def ouster_files(folder: Path) -> list[bytes]:
    return real("lidar/ouster/OS-0*.pcap", most=200_000)


def ouster_json_files(folder: Path) -> list[bytes]:
    return real("lidar/ouster/OS-0*.json", most=10**6)
