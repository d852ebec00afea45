"""`clearway traffic FILE --fly N`: a recorded encounter, flown in place of one of its aircraft."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M
from clearway.cli.record import record_run
from clearway.cli.report import NOT_REACHED, add_sources, leave, print_json, print_words, say

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.missions.encounter_mission import FlownAs
    from clearway.missions.in_place import InPlaceFlight
    from clearway.traffic.recorded.picture import AirPicture
    from clearway.view.plot.style import Pictures

WELL_CLEAR_BALL_M = math.ceil(math.hypot(2000.0, 250.0) * FOOT_M)
"""About the cylinder of 2,000 ft and 250 ft."""
WAYS = (
    ("as recorded", "recorded"),
    ("without avoidance", "without_avoidance"),
    ("with avoidance", "with_avoidance"),
)


def fly_recorded(
    picture: AirPicture,
    number: int,
    own: str | None,
    flown: FlownAs,
    out: Path | None,
    as_json: bool,
    pictures: Pictures,
) -> None:
    """Fly the encounter with a number (1: the closest pair); exit status 1 if the margin was lost.

    Raises InputError for a number, or an aircraft, that is not there.
    """
    from clearway.io.results_folder import ResultsFolder
    from clearway.io.staging import name_results_folder
    from clearway.missions.encounter_mission import mission_name
    from clearway.missions.in_place import fly_in_place
    from clearway.missions.in_place_result import in_place_result
    from clearway.traffic.recorded.own_part import take_part

    recording = picture.recording
    if not 1 <= number <= len(picture.pairs):
        raise InputError(
            recording.source,
            f"--fly: there is no pair {number}; valid: 1 to {len(picture.pairs)}"
            if picture.pairs
            else "--fly: no two aircraft in it come within 10 km of each other in flight",
        )
    own = own or picture.own_address
    part = take_part(picture.pairs[number - 1], own, leg_s=flown.look_ahead_s)
    name = mission_name(part)
    folder = ResultsFolder.check(out or name_results_folder(name), "traffic --fly", name)
    say("preparing reach sets")
    found = fly_in_place(part, recording.source, flown, say)
    for note in found.setup.notes:
        say(note)
    say(str(found.setup.escape))
    result = in_place_result(found, recording.clock)
    if as_json:
        print_json(result)
    else:
        print_words(_in_words(result))
    _write(found, result, folder)
    _draw(found, folder, pictures)
    if not found.run.safe:
        leave(NOT_REACHED)


def _write(found: InPlaceFlight, result: dict[str, Any], folder: ResultsFolder) -> None:
    """Everything that the flights leave but the picture; all of it or nothing."""
    from clearway.io.toml_writing import write_toml
    from clearway.missions.run_files import write_decisions, write_intruders, write_track

    with folder.write() as scratch:
        write_toml(found.file.effective(), scratch / "mission.toml")
        write_track(found.run, scratch / "track.csv")
        write_track(found.run_without, scratch / "track-without.csv")
        if found.run.intruder_tracks:
            write_intruders(found.run, scratch / "intruders.csv")
        write_decisions(found.run, scratch / "decisions.jsonl")
        record_run(found.run, found.setup, found.file, scratch)
        (scratch / "encounter.json").write_text(json.dumps(add_sources(result), indent=2) + "\n")
        written = sorted(path.name for path in scratch.iterdir())
    say(f"wrote {', '.join(written)} to {folder.path}")


def _draw(found: InPlaceFlight, folder: ResultsFolder, pictures: Pictures) -> None:
    """The picture, once the results are there."""
    from clearway.studies.figures.in_place import draw_in_place
    from clearway.view.plot.style import house_style

    with folder.taking_more().write() as scratch, house_style():
        drawn = pictures.save(draw_in_place(found), scratch, "encounter")
    say(f"wrote {drawn} to {folder.path}")


def _in_words(result: Mapping[str, Any]) -> str:
    own, other = (
        " ".join(dict.fromkeys(filter(None, (one["address"], one["callsign"]))))
        for one in (result["own"], result["other"])
    )
    when = result["closest"]
    moment = f"{result['closest_s']:.0f} s" if when is None else f"{when[:19].replace('T', ' ')}Z"
    off = result["keep_m"] - result["margin_m"]
    avoiding = result["with_avoidance"]
    lines = [
        f"encounter          {own} with {other}, closest {moment}",
        f"ownship            in place of {own} at {result['speed_mps']:.0f} m/s, turning radius "
        f"{result['turning_radius_m']:.0f} m",
        f"to keep            {result['keep_m']:.0f} m: margin {result['margin_m']:.0f} m, and "
        f"{off:.0f} m that the height may be off",
        _state_judgement(result["margin_m"]),
        "",
        _row(("", "horizontal", "vertical", "(ft)", "time", "well clear", "near mid-air", "path")),
        *(_way_in_words(label, result[key]) for label, key in WAYS),
        "",
        f"avoidance added    {result['path_added_m']:.0f} m of way, "
        f"{avoiding['time_s'] - result['without_avoidance']['time_s']:.1f} s",
        f"with avoidance     {'reached' if avoiding['reached'] else 'NOT REACHED'}, "
        f"violations {avoiding['margin_violations']}, emergencies {avoiding['emergencies']}, "
        f"decisions {avoiding['decisions']}, p50 {avoiding['decision_ms']['p50']:.2f} ms",
        *_nearest_in_words(avoiding, result["other"]["address"]),
    ]
    if result["recorded"]["unheard_s"]:
        lines.append(
            f"silence            {other} is not received for "
            f"{result['recorded']['unheard_s']:.0f} s, which count in no distance"
        )
    return "\n".join(lines)


def _state_judgement(margin_m: float) -> str:
    """What the exit status is about, and what it is not."""
    if margin_m >= WELL_CLEAR_BALL_M:
        return "judged by          that distance, which covers well clear"
    return (
        f"judged by          that distance; well clear, shown beside it, is wider: ask for it with "
        f"--margin {WELL_CLEAR_BALL_M:.0f}"
    )


def _way_in_words(label: str, way: Mapping[str, Any]) -> str:
    closest, path = way["closest"], f"{way['path_length_m']:.0f} m"
    if closest is None:
        return _row((label, "never received at once", "", "", "", "", "", path))
    return _row(
        (
            label,
            f"{closest['horizontal_m']:.0f} m",
            f"{round(closest['vertical_m']):+d} m",
            f"{round(closest['vertical_m'] / FOOT_M):+d}",
            f"{closest['time_s']:.0f} s",
            "yes" if closest["well_clear"] else "LOST",
            "YES" if closest["near_mid_air"] else "no",
            path,
        )
    )


def _row(words: tuple[str, ...]) -> str:
    widths = (19, 12, 10, 7, 7, 12, 14, 8)
    return "".join(word.ljust(width) for word, width in zip(words, widths, strict=True)).rstrip()


def _nearest_in_words(way: Mapping[str, Any], other: str) -> list[str]:
    """Somebody else who came nearer, if there is one."""
    nearest = way["nearest_of_all"]
    if nearest is None or nearest["address"] == other:
        return []
    return [f"nearest of all     {nearest['address']}, {nearest['slant_m']:.0f} m away"]
