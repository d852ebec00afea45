"""Traffic recordings from files: one value for all formats; the content tells which it is."""

from __future__ import annotations

import zlib
from dataclasses import replace
from pathlib import Path

from clearway.base.errors import InputError, naming
from clearway.io.foreign_errors import damage_told
from clearway.io.what_file import what_content
from clearway.traffic.recorded.report import TrafficRecording

GZIP = b"\x1f\x8b"
FIRST_PIECE = 256
LARGEST_PIECE = 1 << 20
"""Bytes of a gzip member that are unpacked at once: a file may be of many, of 20 bytes each."""
MOST_BYTES = 40_000_000
MOST_RATIO = 4
"""Unpacked, of a small file and for each byte of a larger one: reading takes twenty times as much
memory, and a small file may unpack to more than there is."""


def read_traffic(path: str | Path) -> TrafficRecording:
    """Read a recording of any known format, gzip or not, whatever its suffix.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    TrafficRecording
        Its reports, and what was left out.

    Raises
    ------
    InputError
        When the file is absent, empty, truncated, of no known format, or has nothing in it that
        can be understood.
    MissingExtraError
        When Mode S is to be decoded without [adsb], or a ULog read without [ulog].

    Examples
    --------
    >>> from pathlib import Path
    >>> import clearway as cw
    >>> row = '{"now": 10, "hex": "4b1801", "lat": 46.05, "lon": 14.5, "alt_baro": 3000}\\n'
    >>> _ = Path("one.jsonl").write_text(row)
    >>> cw.read_traffic("one.jsonl").reports[0].address
    '4b1801'
    """
    from clearway.io.traffic.traffic_formats import TRAFFIC_FORMATS

    path = Path(path)
    with naming(path, "read"):
        content = path.read_bytes()
    if not content:
        raise InputError(str(path), "the file is empty (0 bytes)")
    packed_cut = ""
    if content.startswith(GZIP):
        content, packed_cut = _unpack(str(path), content)
    reader = next((form.read for form in TRAFFIC_FORMATS if form.recognises(content)), None)
    if reader is None and packed_cut:
        raise InputError(str(path), f"truncated: {packed_cut}")
    if reader is None:
        raise InputError(
            str(path),
            f"no known traffic recording: it begins with {content[:24]!r}{what_content(content)}; "
            "valid: " + "; ".join(form.name for form in TRAFFIC_FORMATS),
        )
    with damage_told(path, "recording of traffic"):
        recording = reader(str(path), content)
        if packed_cut:
            note = f"truncated: {packed_cut}; all before that was read"
            recording = replace(recording, notes=(note, *recording.notes))
    if not (recording.reports or recording.of_use or recording.heard):
        reasons = ", ".join(f"{count} {reason}" for reason, count in recording.left_out.items())
        raise InputError(
            str(path),
            [f"no usable message in it (left out: {reasons or 'none'})", *recording.notes],
        )
    return recording


def _unpack(source: str, content: bytes) -> tuple[bytes, str]:
    """What gzip has packed, all members of it, and where it is cut off, in words, if it is."""
    parts: list[bytes] = []
    most, total, at = max(MOST_BYTES, MOST_RATIO * len(content)), 0, 0
    while at < len(content):
        unpacker, piece = zlib.decompressobj(wbits=31), FIRST_PIECE
        while at < len(content) and not unpacker.eof:
            try:
                part = unpacker.decompress(content[at : at + piece], most - total)
            except zlib.error as cause:
                raise InputError(source, f"damaged gzip file: {cause}") from cause
            parts.append(part)
            total += len(part)
            if total >= most:
                raise InputError(
                    source,
                    f"unpacks to {most:,} bytes or more; valid: the file unpacked (gunzip), which "
                    "may be of any size, or a shorter time cut out of it",
                )
            at = min(at + piece, len(content)) - len(unpacker.unused_data)
            piece = min(2 * piece, LARGEST_PIECE)
        if not unpacker.eof:
            cut = f"the gzip data end in the middle, after {total} bytes unpacked"
            if not total:
                raise InputError(source, f"truncated: {cut}")
            return b"".join(parts), cut
    unpacked = b"".join(parts)
    if not unpacked:
        raise InputError(source, "the file is empty (0 bytes, unpacked)")
    return unpacked, ""
