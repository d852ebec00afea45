"""Heavy files of formats that are packed, or that a library writes: archives, databases, logs."""

from __future__ import annotations

import io
import sqlite3
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from contextlib import closing
from importlib import import_module
from pathlib import Path
from typing import Any

from tools.fuzz.heavy_content import SIZE
from tools.fuzz.made import sample_files

KML = '<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark>'
OSM = '<?xml version="1.0"?><osm version="0.6">'
UNPACKED = 1_500_000_000
"""Bytes that archives promise."""
BLOB_BYTES = 32_000_000
"""The most that a block of OpenStreetMap's PBF may unpack to."""


def sample_many(name: str) -> Callable[[], bytes]:
    """What `clearway sample` writes, one copy after the other."""

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as scratch:
            (content,) = sample_files(name)(Path(scratch))
        return content * (SIZE // len(content))

    return make


def zipped(name: str, head: bytes) -> Callable[[], bytes]:
    """An archive with one file that begins so, and goes on with blanks."""

    def make() -> bytes:
        file, blanks = io.BytesIO(), b" " * 10_000_000
        with (
            zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive,
            archive.open(name, "w", force_zip64=True) as inside,
        ):
            inside.write(head)
            for _ in range(UNPACKED // len(blanks)):
                inside.write(blanks)
        return file.getvalue()

    return make


def zipped_many() -> bytes:
    """An archive of as many empty files as fit."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for n in range(SIZE // 130):
            archive.writestr(f"wpmz/{n}.kml", b"")
    return file.getvalue()


def zstd_frames() -> bytes:
    """Frames of 100 MB of zeros each, one after the other."""
    zstandard: Any = import_module("zstandard")
    frame: bytes = zstandard.compress(bytes(100_000_000))
    return frame * (SIZE // len(frame))


def houses_many() -> bytes:
    """A GeoPackage with the same houses again and again."""
    with tempfile.TemporaryDirectory() as scratch:
        sample_files("houses.gpkg")(Path(scratch))
        path = Path(scratch) / "houses.gpkg"
        with closing(sqlite3.connect(path)) as base:
            (table,) = base.execute("SELECT table_name FROM gpkg_contents").fetchone()
            rows = base.execute(f'SELECT * FROM "{table}"').fetchall()
            marks = ",".join("?" * len(rows[0]))
            number = 10**6
            while path.stat().st_size < SIZE - 500_000:
                more = [(number + n, *rows[n % len(rows)][1:]) for n in range(5000)]
                base.executemany(f'INSERT INTO "{table}" VALUES ({marks})', more)
                base.commit()
                number += len(more)
        return path.read_bytes()


def corners_many() -> bytes:
    """As many polygons as the sample's table has rows, of very many corners each."""
    shapefile: Any = import_module("shapefile")
    with tempfile.TemporaryDirectory() as scratch:
        sample_files("houses.shp")(Path(scratch))
        with shapefile.Reader(str(Path(scratch) / "houses.shp")) as reader:
            rings = [shape.points for shape in reader.shapes()]
    each = SIZE // (16 * len(rings)) - 10
    files = {name: io.BytesIO() for name in ("shp", "shx", "dbf")}
    writer = shapefile.Writer(**files, shapeType=shapefile.POLYGON)
    writer.field("height", "N")
    for ring in rings:
        writer.poly([[*(ring[:-1] * (each // len(ring[:-1]))), ring[0]]])
        writer.record(9)
    writer.close()
    return files["shp"].getvalue()


def pbf_blocks() -> bytes:
    """Blocks of PBF that unpack to zeros."""
    packed = zlib.compress(bytes(BLOB_BYTES), 9)
    blob = _field(2, _varint(BLOB_BYTES), wire=0) + _field(3, packed)
    head = _field(1, b"OSMData") + _field(3, _varint(len(blob)), wire=0)
    block = struct.pack(">I", len(head)) + head + blob
    return block * (SIZE // len(block))


def _field(number: int, content: bytes, wire: int = 2) -> bytes:
    length = _varint(len(content)) if wire == 2 else b""
    return bytes([number << 3 | wire]) + length + content


def _varint(value: int) -> bytes:
    found = bytearray()
    while value > 0x7F:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*found, value])


def laughs() -> bytes:
    """Entities of entities, ten deep: a hundred million words of a few hundred bytes."""
    entities = "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10 if n else "lol"}">' for n in range(10))
    return f'<?xml version="1.0"?><!DOCTYPE kml [{entities}]><kml>&a9;</kml>'.encode()
