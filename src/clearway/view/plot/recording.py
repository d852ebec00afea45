"""Picture of recorded traffic: tracks on a map, altitudes over time, closest pairs marked."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

import matplotlib.dates
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearway.base.frames import FloatArray, enu_from_geodetic
from clearway.traffic.recorded.aircraft import Aircraft
from clearway.traffic.recorded.closest import ClosestPair
from clearway.traffic.recorded.picture import AirPicture
from clearway.view.plot.style import SERIES

OTHERS = "#9aa5b1"
RADAR = "#d9cfc0"
PAIR = "#111111"
CLOSE_UP_S = 120.0
MOST_PAIRS = 3
"""Pairs that are marked."""


def draw_recording(picture: AirPicture) -> Figure:
    """Map in kilometres east and north of the middle, and altitude over time beside it.

    The aircraft of the closest pairs have colours; all have where they are few.
    """
    rows = 2 if picture.pairs else 1
    figure = Figure(figsize=(15.0, 6.5 * rows), layout="constrained")
    figure.suptitle(
        f"{picture.recording.source.rsplit('/', 1)[-1]}: {len(picture.aircraft)} aircraft, "
        f"{len(picture.recording.reports)} positions"
    )
    (ground, profile), *close_up = figure.subplots(rows, 2, squeeze=False)
    pairs = picture.pairs[:MOST_PAIRS]
    origin = _origin(picture)
    colours = _colours(picture, pairs)
    for one in picture.aircraft:
        _draw_track(ground, profile, one, origin, colours.get(one.address), picture)
    for number, pair in enumerate(pairs, start=1):
        _mark(ground, profile, number, pair, origin, picture)
    ground.set_aspect("equal", adjustable="datalim")
    ground.set_xlabel(f"east (km) of {origin[1]:.3f} deg")
    ground.set_ylabel(f"north (km) of {origin[0]:.3f} deg")
    profile.set_xlabel("time (UTC)" if picture.recording.clock == "utc" else "time (s)")
    profile.set_ylabel("altitude (m), barometric where known")
    for axes in (ground, profile):
        axes.grid(alpha=0.25)
    if picture.recording.clock == "utc":
        _tell_utc(profile)
    for near, heights in close_up:
        _draw_close_up(near, heights, picture, colours)
    handles, labels = ground.get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return figure


def _tell_utc(axes: Axes) -> None:
    dates: Any = matplotlib.dates
    locator = dates.AutoDateLocator(maxticks=8)
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(dates.ConciseDateFormatter(locator))


def _draw_close_up(
    near: Axes, heights: Axes, picture: AirPicture, colours: Mapping[str, str]
) -> None:
    """The closest pair in the minutes around its closest approach, in metres."""
    pair = picture.pairs[0]
    origin = (pair.latitude_deg, pair.longitude_deg, 0.0)
    for one in (pair.first, pair.second):
        elapsed = one.time_s - pair.time_s
        inside = np.flatnonzero(np.abs(elapsed) <= CLOSE_UP_S)
        after = np.flatnonzero(~one.heard_of[inside[:-1]]) + 1
        places = np.column_stack([one.latitude_deg, one.longitude_deg, 0.0 * one.time_s])[inside]
        east, north, _ = np.insert(enu_from_geodetic(places, origin), after, np.nan, axis=0).T
        colour = colours[one.address]
        near.plot(east, north, marker=".", color=colour)
        near.plot(east[:1], north[:1], marker="s", color=colour)
        altitude = np.insert(one.altitude_m[inside], after, np.nan)
        heights.plot(np.insert(elapsed[inside], after, np.nan), altitude, marker=".", color=colour)
    near.plot(0.0, 0.0, "o", color=PAIR, markersize=11, fillstyle="none")
    heights.axvline(0.0, color=PAIR, linewidth=0.8)
    near.set_title(f"closest pair, {CLOSE_UP_S:.0f} s before (from the square) and after")
    near.set_aspect("equal", adjustable="datalim")
    near.set_xlabel("east (m)")
    near.set_ylabel("north (m)")
    heights.set_title(_spoken(1, pair, picture))
    heights.set_xlabel("time since closest (s)")
    heights.set_ylabel("altitude (m)")
    for axes in (near, heights):
        axes.grid(alpha=0.25)


def _origin(picture: AirPicture) -> tuple[float, float, float]:
    """Middle of all positions, on the ellipsoid."""
    if not picture.aircraft:
        return 0.0, 0.0, 0.0
    latitude = np.concatenate([one.latitude_deg for one in picture.aircraft])
    longitude = np.concatenate([one.longitude_deg for one in picture.aircraft])
    return float(np.median(latitude)), float(np.median(longitude)), 0.0


def _colours(picture: AirPicture, pairs: tuple[ClosestPair, ...]) -> dict[str, str]:
    """By address: the own aircraft first, then those of the closest pairs, then all if few."""
    wanted = [picture.own_address] if picture.own_address else []
    wanted += [one.address for pair in pairs for one in (pair.first, pair.second)]
    if len(picture.aircraft) <= len(SERIES):
        wanted += [one.address for one in picture.aircraft]
    return dict(zip(dict.fromkeys(wanted), SERIES, strict=False))


def _draw_track(
    ground: Axes,
    profile: Axes,
    one: Aircraft,
    origin: tuple[float, float, float],
    colour: str | None,
    picture: AirPicture,
) -> None:
    """One aircraft; its line is broken where it is not reported."""
    after = np.flatnonzero(~one.heard_of) + 1
    places = np.column_stack([one.latitude_deg, one.longitude_deg, np.zeros(len(one.time_s))])
    east, north, _ = np.insert(enu_from_geodetic(places, origin), after, np.nan, axis=0).T / 1000.0
    altitude = np.insert(one.altitude_m, after, np.nan)
    when = _axis_time(np.insert(one.time_s, after, np.nan), picture)
    line, order, label = OTHERS if one.is_icao else RADAR, 1, None
    wide, dot = 0.6, 0.6
    if colour is not None:
        line, order, wide, dot = colour, 3, 1.5, 1.5
        label = " ".join(dict.fromkeys(filter(None, (one.address, one.callsign))))
        label += " (own)" if one.address == picture.own_address else ""
    for axes, x, y in ((ground, east, north), (profile, when, altitude)):
        # Dots show single reports, which make no line.
        axes.plot(x, y, ".-", color=line, markersize=dot, linewidth=wide, zorder=order)
    if label:
        ground.plot([], [], color=line, label=label)


def _axis_time(time_s: FloatArray, picture: AirPicture) -> FloatArray:
    """Days since 1970 for a clock, seconds for a stopwatch."""
    return time_s / 86_400.0 if picture.recording.clock == "utc" else time_s


def _mark(
    ground: Axes,
    profile: Axes,
    number: int,
    pair: ClosestPair,
    origin: tuple[float, float, float],
    picture: AirPicture,
) -> None:
    """A numbered ring where a pair was closest."""
    east, north, _ = (
        enu_from_geodetic([pair.latitude_deg, pair.longitude_deg, 0.0], origin) / 1000.0
    )
    when = float(_axis_time(np.array(pair.time_s), picture))
    for axes, x, y in ((ground, east, north), (profile, when, pair.altitude_m)):
        label = _spoken(number, pair, picture) if axes is ground else None
        axes.plot(x, y, "o", color=PAIR, markersize=11, fillstyle="none", zorder=4, label=label)
        axes.annotate(str(number), (x, y), xytext=(7, 7), textcoords="offset points", zorder=5)


def _spoken(number: int, pair: ClosestPair, picture: AirPicture) -> str:
    when = f"{pair.time_s:.0f} s"
    if picture.recording.clock == "utc":
        when = f"{datetime.fromtimestamp(pair.time_s, UTC):%H:%M:%S}Z"
    return f"{number}: {pair.distance_m:.0f} m apart, {abs(pair.height_m):.0f} m in height, {when}"
