"""`clearway map`: what map files hold, in one local frame, and a picture of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import picture_options as drawn
from clearway.cli.report import print_json, print_words, say

if TYPE_CHECKING:
    from datetime import datetime

    from clearway.io.maps.map_features import Geodetic, Period
    from clearway.io.maps.maps import KeepOut, MapFile
    from clearway.io.results_folder import ResultsFolder
    from clearway.view.plot.style import Pictures


def show_map(
    files: Annotated[
        list[Path],
        typer.Argument(help="{maps}. Heights above ground are above the terrain among them."),
    ],
    origin: Annotated[
        str | None,
        typer.Option(
            help="Latitude,longitude,height of the local frame in degrees and metres; default: "
            "the middle of the first file."
        ),
    ] = None,
    radius: Annotated[
        float,
        typer.Option(
            min=0.1, max=1e5, help="Radius, in metres, of an obstacle given as a point without one."
        ),
    ] = 20.0,
    crs: Annotated[
        str | None,
        typer.Option(
            help="Reference system of a CityJSON model or Shapefile that states none: EPSG:7415."
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            help="Moment such as 2025-06-01T12:00Z: zones not in force then are left out."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the picture; default clearway-out/map.")
    ] = None,
    plots: Annotated[bool, typer.Option("--plots/--no-plots", help="Draw the picture.")] = True,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Summarise and draw map files: obstacles, keep-out zones, and what was left out."""
    from clearway.io.maps.maps import read_maps
    from clearway.io.moments import parse_moment
    from clearway.io.results_folder import ResultsFolder
    from clearway.io.staging import RESULTS

    pictures = drawn.pictures_of(form, dpi)
    folder = ResultsFolder.check(out or RESULTS / "map", "map", "") if plots else None
    when = None if at is None else parse_moment("--at", at)
    maps = read_maps(files, _origin(origin), point_radius_m=radius, crs=crs)
    for one in maps:
        if one.is_empty:
            say(f"{one.source}: {one.notes[-1]}")
    if as_json:
        print_json(_as_json(maps, when))
    else:
        print_words("\n\n".join(_in_words(one, when) for one in maps))
    if folder is not None:
        say(f"wrote {_draw(maps, when, folder, pictures)} to {folder.path}")


def _origin(text: str | None) -> Geodetic | None:
    from clearway.base.checks import geodetic_problem
    from clearway.base.errors import InputError
    from clearway.io.maps.map_features import Geodetic

    if text is None:
        return None
    try:
        latitude, longitude, height = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            "--origin", f"latitude,longitude,height are needed, got {text!r}"
        ) from None
    if problem := geodetic_problem(latitude, longitude, height):
        raise InputError("--origin", problem)
    return Geodetic(latitude, longitude, height)


def _draw(
    maps: tuple[MapFile, ...], when: datetime | None, folder: ResultsFolder, pictures: Pictures
) -> str:
    from clearway.view.plot.map import draw_map
    from clearway.view.plot.style import house_style

    obstacles = [obstacle for one in maps for obstacle in one.obstacles]
    zones = {
        zone.name or zone.identifier: zone.obstacles
        for one in maps
        for zone in one.keep_out
        if zone.in_force(when)
    }
    floor = [block for one in maps for block in one.floor]
    title = ", ".join(Path(one.source).name for one in maps)
    with folder.write() as scratch, house_style():
        return pictures.save(draw_map(obstacles, floor, zones, title), scratch, "map")


def _as_json(maps: tuple[MapFile, ...], when: datetime | None) -> dict[str, Any]:
    return {
        "origin": maps[0].origin._asdict(),
        "obstacles": sum(len(one.obstacles) for one in maps),
        "keep_out": sum(zone.in_force(when) for one in maps for zone in one.keep_out),
        "files": [_file_as_json(one, when) for one in maps],
    }


def _file_as_json(one: MapFile, when: datetime | None) -> dict[str, Any]:
    return {
        "file": one.source,
        "format": one.kind,
        "crs": one.crs,
        "obstacles": len(one.obstacles),
        "floor_blocks": len(one.floor),
        "extent_m": _extent(one),
        "height_m": _heights(one),
        "keep_out": [_zone_as_json(zone, when) for zone in one.keep_out],
        "left_out": dict(one.counts),
        "notes": list(one.notes),
    }


def _zone_as_json(zone: KeepOut, when: datetime | None) -> dict[str, Any]:
    return {
        "identifier": zone.identifier,
        "name": zone.name,
        "restriction": zone.restriction,
        "limits": list(zone.limits),
        "volumes": len(zone.obstacles),
        "always": not zone.periods,
        "in_force": zone.in_force(when),
    }


def _extent(one: MapFile) -> dict[str, list[float]] | None:
    """[low, high] along each axis of the local frame; None without an obstacle."""
    import numpy as np

    from clearway.obstacles.obstacle import shapes_of
    from clearway.obstacles.tree import build_box_tree

    shapes = [*one.solid, *(volume for zone in one.keep_out for volume in zone.obstacles)]
    if not shapes:
        return None
    tree = build_box_tree(shapes_of(shapes))
    spans = (np.round(np.stack([tree.low_m[0], tree.high_m[0]], axis=1), 3) + 0.0).tolist()
    return dict(zip(("x", "y", "z"), spans, strict=True))


def _heights(one: MapFile) -> dict[str, float] | None:
    """From foot to top, smallest and largest among the obstacles."""
    heights = [float(2.0 * (part.half_m[2] + part.radius_m)) for part in one.obstacles]
    if not heights:
        return None
    return {"min": round(min(heights), 3), "max": round(max(heights), 3)}


def _in_words(one: MapFile, when: datetime | None) -> str:
    extent, heights = _extent(one), _heights(one)
    rows = [("file", one.source), ("format", one.kind), ("reference", one.crs)]
    latitude, longitude, height = one.origin
    rows.append(("origin", f"{latitude:.6f}, {longitude:.6f} at {height:.1f} m"))
    rows.append(("obstacles", str(len(one.obstacles))))
    if one.floor:
        rows.append(("floor", f"{len(one.floor)} blocks"))
    if heights is not None:
        rows.append(
            ("heights", f"{heights['min']:z.1f} to {heights['max']:z.1f} m from foot to top")
        )
    if extent is not None:
        spans = (f"{axis} {low:z.1f} to {high:z.1f}" for axis, (low, high) in extent.items())
        rows.append(("extent", ", ".join(spans) + " m"))
    for zone in one.keep_out:
        force = "" if zone.in_force(when) else ", NOT in force then"
        rows.append(
            (
                "keep out",
                f"{zone.name} ({zone.identifier}, {zone.restriction}): "
                f"{'; '.join(zone.limits)}; {_times(zone.periods)}{force}",
            )
        )
    rows += [("left out", f"{count} {reason}") for reason, count in one.counts.items()]
    rows += [("note", note) for note in one.notes]
    return "\n".join(f"{name:<12}{text}" for name, text in rows)


def _times(periods: tuple[Period, ...]) -> str:
    if not periods:
        return "always"
    spans = []
    for period in periods:
        begin = "" if period.start is None else f"from {period.start:%Y-%m-%d %H:%M} "
        end = "" if period.end is None else f"until {period.end:%Y-%m-%d %H:%M} "
        hours = " or ".join(
            f"{'-'.join(daily.days) or 'daily'} {daily.start or 'begin'} to {daily.end or 'end'}"
            for daily in period.hours
        )
        spans.append((begin + end + hours).strip() or "always")
    return ", ".join(spans)
