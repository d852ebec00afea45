"""Chunk tables of LAZ files, looked at before lazrs reads them.

It allocates what they promise, and where that is more than memory holds the process ends without
an exception.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

from clearway.base.errors import InputError

AT_THE_END = -1
"""Instead of the table's place, by writers that could not go back: its place ends the file."""


def check_chunks(path: Path, header: Any) -> None:
    """Refuse a table that promises more than the file holds; header: laspy's of a LAZ file."""
    import lazrs

    size, start = path.stat().st_size, int(header.offset_to_point_data)
    with path.open("rb") as file:
        place = _number(file, start)
        if place == AT_THE_END:
            place = _number(file, size - 8)
        if place is None or not start < place <= size - 8:
            raise InputError(
                str(path), f"truncated or damaged LAZ: no chunk table at byte {place} of {size}"
            )
        file.seek(place)
        _, chunks = struct.unpack("<II", file.read(8))
        if chunks > size:
            raise InputError(
                str(path), f"damaged LAZ: its table has {chunks} chunks, the file {size} bytes"
            )
        file.seek(start)
        record = header.vlrs[header.vlrs.index("LasZipVlr")].record_data
        table = lazrs.read_chunk_table(file, lazrs.LazVlr(record))
    promised = sum(length for _, length in table)
    if promised > size - start:
        raise InputError(
            str(path),
            f"damaged or truncated LAZ: its chunks have {promised} bytes, the file {size - start} "
            "for them",
        )


def _number(file: Any, place: int) -> int | None:
    """The number of eight bytes at a place; None where the file has none there."""
    file.seek(max(place, 0))
    data = file.read(8)
    return None if len(data) < 8 else int(struct.unpack("<q", data)[0])
