"""Aircraft that report by one address: distinguished, for none may hide behind another."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from clearway.traffic.recorded.aircraft import AWAY_S, FASTEST_RECORDED_MPS, Aircraft
from clearway.traffic.recorded.geodesy import surface_points

LEAST_REPORTS = 3
"""Fewer that lie apart are wrong positions, as receivers decode now and then."""
MOST_TRACKS = 256
"""Of one address; what jumps to more places is noise, and stays with the longest track."""


def split_address(one: Aircraft) -> list[Aircraft]:
    """Return the aircraft that report by one address, the one with most reports first.

    A report belongs to the track that it is nearest to by speed, of those from which anything could
    have flown there. Only reports that jump tell aircraft apart.
    """
    if not one.jumps:
        return [one]
    surface = surface_points(one.latitude_deg, one.longitude_deg)
    tracks: list[list[int]] = []
    strays: list[int] = []
    for at, place in enumerate(surface):
        last = np.array([track[-1] for track in tracks], dtype=np.int64)
        elapsed = one.time_s[at] - one.time_s[last]
        way = np.linalg.norm(place - surface[last], axis=1)
        could = (way <= FASTEST_RECORDED_MPS * elapsed) & (elapsed <= AWAY_S)
        if could.any():
            tracks[int(np.argmin(np.where(could, way / np.maximum(elapsed, 1e-9), np.inf)))].append(
                at
            )
        elif len(tracks) < MOST_TRACKS:
            tracks.append([at])
        else:
            strays.append(at)
    tracks.sort(key=len, reverse=True)
    strays += [at for track in tracks[1:] if len(track) < LEAST_REPORTS for at in track]
    kept = [track for track in tracks[1:] if len(track) >= LEAST_REPORTS]
    parts = [_part(one, sorted(tracks[0] + strays)), *(_part(one, track) for track in kept)]
    numbered = [replace(part, address=f"{one.address} ({n})") for n, part in enumerate(parts, 1)]
    return [parts[0], *numbered[1:]]


def _part(one: Aircraft, rows: list[int]) -> Aircraft:
    """Some reports of an aircraft."""
    arrays = {
        each.name: getattr(one, each.name)[rows]
        for each in fields(one)
        if isinstance(getattr(one, each.name), np.ndarray) and each.name != "segment_mps"
    }
    surface = surface_points(arrays["latitude_deg"], arrays["longitude_deg"])
    way = np.linalg.norm(np.diff(surface, axis=0), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return replace(one, **arrays, segment_mps=way / np.diff(arrays["time_s"]))
