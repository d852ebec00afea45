"""What fills heavy files: little said very often, and nothing packed a thousandfold."""

from __future__ import annotations

import gzip
import io
import struct
from collections.abc import Callable

SIZE = 10_000_000


def filled(head: str, item: str, tail: str, between: str = ",") -> Callable[[], bytes]:
    """One document of as many items as fit."""

    def make() -> bytes:
        count = (SIZE - len(head) - len(tail)) // (len(item) + len(between))
        return (head + between.join([item] * count) + tail).encode()

    return make


def repeated(head: str, line: str) -> Callable[[], bytes]:
    return lambda: (head + line * ((SIZE - len(head)) // len(line))).encode()


def lzf_zeros(count: int) -> bytes:
    """What LZF makes of so many zeros: 264 of them for every three bytes."""
    return b"\x00\x00" + (b"\xe0\xff\x00") * ((count - 1) // 264)


def pcd_packed() -> bytes:
    packed = lzf_zeros(800_000_000)[: SIZE - 500]
    unpacked = 1 + 264 * ((len(packed) - 2) // 3)
    points = unpacked // 12
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {points}\nHEIGHT 1\nPOINTS {points}\nDATA binary_compressed\n"
    )
    return head.encode() + struct.pack("<II", len(packed), unpacked) + packed


def pcd_bytes() -> bytes:
    """Points of three bytes, which take 24 as numbers."""
    points = (SIZE - 300) // 3
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 1 1 1\nTYPE I I I\nCOUNT 1 1 1\n"
        f"WIDTH {points}\nHEIGHT 1\nPOINTS {points}\nDATA binary\n"
    )
    return head.encode() + bytes(3 * points)


def pcd_text() -> bytes:
    points = (SIZE - 300) // 6
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {points}\nHEIGHT 1\nPOINTS {points}\nDATA ascii\n"
    )
    return head.encode() + b"1 2 3\n" * points


def pcd_fields() -> bytes:
    """A header of millions of fields."""
    names = "a " * ((SIZE - 200) // 8)
    ones = "1 " * ((SIZE - 200) // 8)
    kinds = "I " * ((SIZE - 200) // 8)
    head = f"VERSION 0.7\nFIELDS x y z {names}\nSIZE 4 4 4 {ones}\nTYPE F F F {kinds}\n"
    return (head + f"COUNT 1 1 1 {ones}\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n").encode()


def ply_text() -> bytes:
    points = (SIZE - 300) // 6
    head = f"ply\nformat ascii 1.0\nelement vertex {points}\nproperty float x\nproperty float y\n"
    return (head + "property float z\nend_header\n").encode() + b"1 2 3\n" * points


def ply_bytes() -> bytes:
    points = (SIZE - 300) // 3
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {points}\n"
    head += "property char x\nproperty char y\nproperty char z\nend_header\n"
    return head.encode() + bytes(3 * points)


def npy_of(shape: str, kind: str, data: bytes) -> bytes:
    head = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}"
    head = head.ljust(118 - 1) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + data


def tif_of(kind: str, side: int) -> Callable[[], bytes]:
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


def laz_of(count: int) -> Callable[[], bytes]:
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


def las_zeros() -> bytes:
    import laspy
    import numpy as np

    las = laspy.LasData(laspy.LasHeader(point_format=0, version="1.2"))
    las.x = las.y = las.z = np.zeros((SIZE - 1000) // 20)
    file = io.BytesIO()
    las.write(file)
    return file.getvalue()


def mcap_of(packed: str, messages: int, each: int) -> Callable[[], bytes]:
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


def gzipped(content: Callable[[], bytes], times: int = 1) -> Callable[[], bytes]:
    return lambda: gzip.compress(content() * times, 6)[:SIZE]


def gzip_members() -> bytes:
    one = gzip.compress(b"", 9)
    return one * (SIZE // len(one))


def deep(opening: str) -> Callable[[], bytes]:
    return lambda: (opening * (SIZE // len(opening))).encode()


def avr_lines() -> bytes:
    return b"*8D40621D58C382D690C8AC2863A7;\n" * (SIZE // 31)


def beast_frames() -> bytes:
    frame = b"\x1a3" + bytes(7) + bytes.fromhex("8D40621D58C382D690C8AC2863A7")
    return frame * (SIZE // len(frame))


def run_page() -> bytes:
    """A recording of a flight with a chunk that unpacks to much."""
    return mcap_of("ZSTD", 40, 100_000_000)()


HEAD_OF_MAP = '{"type":"FeatureCollection","features":['
POINT = '{"type":"Feature","properties":{"height":1},"geometry":{"type":"Point","coordinates":'
POINT += "[6.9,50.9]}}"
CITY = '{"type":"CityJSON","version":"1.1","metadata":{"referenceSystem":"EPSG:7415"},'
