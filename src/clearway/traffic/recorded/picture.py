"""The air picture of one recording: its aircraft, which are doubles, and who met whom."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from clearway.base.brief import brief
from clearway.base.checks import kind_of
from clearway.base.errors import InputError
from clearway.traffic.recorded.aircraft import Aircraft, collect_aircraft
from clearway.traffic.recorded.closest import ClosestPair, search_pairs
from clearway.traffic.recorded.ghosts import ghosts_of, without_ghosts
from clearway.traffic.recorded.report import TrafficRecording


@dataclass(frozen=True, slots=True, eq=False)
class AirPicture:
    """What one recording shows."""

    recording: TrafficRecording
    aircraft: tuple[Aircraft, ...]
    """All that report positions, by address."""
    unplaced: Mapping[str, int]
    """Messages by address, of aircraft that are heard but never placed."""
    ghosts: Mapping[str, str]
    """Address of the aircraft that it doubles, by address of the ghost."""
    radar_only: int
    """Tracks that only a radar has seen, ghosts included; they are in no pair."""
    pairs: tuple[ClosestPair, ...]
    """Nearest first, those with a slow aircraft last; only those of the own one where known."""
    own_address: str | None
    without_height: tuple[tuple[str, str], ...] = ()
    """Addresses of pairs that come within 10 km at heights that are unknown or of two kinds."""

    __repr__ = brief

    @property
    def span_s(self) -> tuple[float, float] | None:
        """Times of the first and the last position."""
        reports = self.recording.reports
        return (reports[0].time_s, reports[-1].time_s) if reports else None


def air_picture(
    recording: TrafficRecording,
    own_address: str | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> AirPicture:
    """Find the tracks and the closest pairs of a recording.

    Parameters
    ----------
    recording
        What `read_traffic` gave.
    own_address
        Transponder address of the own aircraft; by default the file's.
    progress
        Called with what is done and what there is to do.

    Returns
    -------
    AirPicture
        Aircraft and pairs.

    Raises
    ------
    InputError
        If the own address is given, but nowhere in the recording.

    Examples
    --------
    >>> import json
    >>> from pathlib import Path
    >>> import clearway as cw
    >>> rows = [
    ...     {"now": t, "hex": h, "lat": 46.05, "lon": 14.5 + 7e-4 * w * (t - 60), "alt_baro": 3000}
    ...     for t in range(0, 121, 4)
    ...     for h, w in (("4b1801", 1), ("4b1802", -1))
    ... ]
    >>> _ = Path("day.jsonl").write_text("".join(json.dumps(row) + "\\n" for row in rows))
    >>> picture = cw.air_picture(cw.read_traffic("day.jsonl"))
    >>> [one.address for one in picture.aircraft], len(picture.pairs)
    (['4b1801', '4b1802'], 1)
    """
    kind_of("air_picture: recording", recording, TrafficRecording)
    if own_address is not None:
        kind_of("air_picture: own_address", own_address, str)
    aircraft = collect_aircraft(recording)
    placed = {one.address for one in aircraft}
    own = recording.own_address if own_address is None else own_address.strip()
    if own is not None:
        own = next((one for one in placed if one.lower() == own.lower()), own)
    if own_address is not None and own not in placed:
        raise InputError(recording.source, _unknown(own_address, placed, recording))
    reporting = without_ghosts(aircraft)
    found = search_pairs(reporting, own, progress=progress)
    return AirPicture(
        recording=recording,
        aircraft=tuple(aircraft),
        unplaced={a: n for a, n in sorted(recording.heard.items()) if a not in placed},
        ghosts=ghosts_of(aircraft),
        radar_only=len(aircraft) - len(reporting),
        pairs=found.pairs,
        without_height=found.without_height,
        own_address=own,
    )


def _unknown(own: str, placed: set[str], recording: TrafficRecording) -> str:
    if own.lower() in recording.heard:
        return f"own address {own!r} is heard, but reports no position"
    close = difflib.get_close_matches(own.lower(), sorted(placed), n=3)
    some = close or sorted(placed)[:5]
    return f"own address {own!r} is not in it; valid: {', '.join(some) or 'none'}" + (
        " ..." if len(placed) > len(some) else ""
    )
