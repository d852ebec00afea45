"""`clearway traffic`: what a recording of traffic holds, who came close; an encounter flown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.base.errors import ClearwayError, InputError, SeveralErrors
from clearway.base.units import FOOT_M
from clearway.base.version import SCHEMA_VERSION
from clearway.cli import picture_options as drawn
from clearway.cli.report import print_json, print_words, say

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.traffic.recorded.picture import AirPicture
    from clearway.view.plot.style import Pictures

OUTPUT = "Output"
FLYING = "Flying an encounter"
UTC_LENGTH = 19
# Of a date and the blank after it.
DATE_LENGTH = len("YYYY-MM-DD ")
SLOW_PAIRS = "closest pairs with an aircraft at 40 kt or less, marked *"


def traffic(
    files: Annotated[
        list[Path],
        typer.Argument(help="Recordings: {traffic}; gzip too."),
    ],
    own: Annotated[
        str | None, typer.Option(help="Own address: list only the pairs of this aircraft.")
    ] = None,
    encounter: Annotated[
        int | None,
        typer.Option(
            "--fly",
            help="Fly the pair with this number (1: the closest) in place of one of the two.",
            rich_help_panel=FLYING,
        ),
    ] = None,
    in_place_of: Annotated[
        str | None,
        typer.Option(
            "--as",
            help="Address or callsign of the aircraft to replace; default: --own, or the first.",
            rich_help_panel=FLYING,
        ),
    ] = None,
    margin_m: Annotated[
        float,
        typer.Option(
            "--margin",
            min=1.0,
            max=1e5,
            help="Distance to keep, in metres.",
            rich_help_panel=FLYING,
        ),
    ] = 304.8,
    bank_deg: Annotated[
        float,
        typer.Option(
            "--bank", min=1.0, max=60.0, help="Bank in turns, degrees.", rich_help_panel=FLYING
        ),
    ] = 25.0,
    most: Annotated[
        int, typer.Option(min=0, help="Aircraft and pairs to list; 0: all.", rich_help_panel=OUTPUT)
    ] = 20,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
    as_json: Annotated[
        bool,
        typer.Option(
            "--json", help="Print one JSON object, with all of them.", rich_help_panel=OUTPUT
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for traffic.json and a picture of each recording, or for the flight "
            "(default for that: clearway-out/<mission>).",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
) -> None:
    """List the aircraft of traffic recordings and their closest pairs, or fly one of the pairs.

    Exit status 1: the encounter was flown, and lost the margin or did not reach its end.
    """
    from clearway.base.provenance import provenance
    from clearway.io.public_data import at_hand
    from clearway.missions.traffic_result import traffic_result

    kept = drawn.pictures_of(form, dpi)
    files = [at_hand(file) for file in files]
    pictures = _pictures(files, own)
    if encounter is not None:
        from clearway.cli.fly_recorded import fly_recorded
        from clearway.missions.encounter_mission import FlownAs

        flown = FlownAs(margin_m=margin_m, bank_deg=bank_deg)
        fly_recorded(_only(pictures), encounter, in_place_of, flown, out, as_json, kept)
        return
    folder = None
    if out is not None:
        from clearway.io.results_folder import ResultsFolder

        folder = ResultsFolder.check(out, "traffic", " ".join(file.name for file in files))
    result: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "recordings": [traffic_result(picture) for picture in pictures],
        "provenance": provenance(files),
    }
    if as_json:
        print_json(result)
    else:
        print_words("\n\n".join(_in_words(one, most) for one in result["recordings"]))
    if folder is not None:
        _write(pictures, result, folder, kept)


def _pictures(files: Sequence[Path], own: str | None) -> list[AirPicture]:
    """Air pictures of all files; raises SeveralErrors, one for each file that is of no use."""
    from clearway.cli.progress import progress_bar
    from clearway.io.public_data import find_public_data
    from clearway.io.traffic.traffic import read_traffic
    from clearway.traffic.recorded.picture import air_picture

    pictures, problems = [], []
    for file in files:
        try:
            recording = read_traffic(find_public_data(file))
            with progress_bar(f"closest pairs of {file.name}", beside=("elapsed",)) as bar:
                pictures.append(air_picture(recording, own, bar.show))
        except ClearwayError as error:
            problems.append(error)
    if problems:
        raise SeveralErrors(problems)
    return pictures


def _only(pictures: Sequence[AirPicture]) -> AirPicture:
    if len(pictures) > 1:
        raise InputError("--fly", f"one recording is needed, got {len(pictures)}")
    return pictures[0]


def _write(
    pictures: Sequence[AirPicture], result: dict[str, Any], folder: ResultsFolder, kept: Pictures
) -> None:
    """The result and one picture a recording; all of it or nothing."""
    import json

    from clearway.view.plot.recording import draw_recording
    from clearway.view.plot.style import house_style

    with folder.write() as scratch:
        (scratch / "traffic.json").write_text(json.dumps(result, allow_nan=False) + "\n")
        names: set[str] = set()
        for picture in pictures:
            name = Path(picture.recording.source).name.split(".")[0] or "traffic"
            name = next(n for n in _number_name(name) if n not in names)
            names.add(name)
            with house_style():
                kept.save(draw_recording(picture), scratch, name)
        written = sorted(path.name for path in scratch.iterdir())
    say(f"wrote {', '.join(written)} to {folder.path}")


def _number_name(name: str) -> Any:
    """The name, then name-2, name-3 ..."""
    yield name
    number = 2
    while True:
        yield f"{name}-{number}"
        number += 1


def _in_words(recording: Mapping[str, Any], most: int) -> str:
    """A page of text of one recording."""
    lines = [
        ("recording", f"{recording['file']}: {recording['format']}"),
        ("time", _span(recording)),
        (
            "messages",
            f"{recording['messages']}: {recording['reports']} positions of "
            f"{len(recording['aircraft'])} aircraft"
            + "".join(f", {count} {kind}" for kind, count in recording["of_use"].items()),
        ),
        ("left out", _counts(recording["left_out"])),
        *(("note", note) for note in recording["notes"]),
        *_radar_lines(recording),
    ]
    if recording["heard_without_position"]:
        heard = recording["heard_without_position"].items()
        told = ", ".join(f"{address} ({count})" for address, count in heard)
        lines.append(("no place", f"messages of aircraft that never say where they are: {told}"))
    if recording["own_address"]:
        lines.append(("own", recording["own_address"]))
    parts = ["\n".join(f"{name:<12}{text}" for name, text in lines)]
    aircraft = sorted(recording["aircraft"], key=lambda one: -one["reports"])
    parts.append(_table("aircraft", _aircraft_rows(aircraft, most), len(aircraft), most))
    fast = [pair for pair in recording["pairs"] if not pair["slow"]]
    slow = [pair for pair in recording["pairs"] if pair["slow"]]
    for title, pairs in (("closest pairs", fast), (SLOW_PAIRS, slow)):
        if pairs:
            parts.append(_table(title, _pair_rows(pairs, most), len(pairs), most))
    if not fast:
        parts.insert(2, "closest pairs: none within 10 km in flight above 40 kt")
    unknown = recording["pairs_without_height"]
    if unknown:
        some = ", ".join(" x ".join(names) for names in unknown[: most or None])
        more = " ..." if most and len(unknown) > most else ""
        parts.append(
            f"not listed: {len(unknown)} pairs within 10 km whose heights are unknown, or "
            f"barometric against geometric: {some}{more}"
        )
    return "\n\n".join(parts)


def _span(recording: Mapping[str, Any]) -> str:
    if recording["from_s"] is None:
        return "no position"
    length = recording["to_s"] - recording["from_s"]
    hours, rest = divmod(round(length), 3600)
    told = f"{hours} h {rest // 60} min" if hours else f"{rest // 60} min {rest % 60} s"
    return f"{_moment(recording, 'from')} to {_moment(recording, 'to')} ({told})"


def _moment(record: Mapping[str, Any], key: str) -> str:
    """A time of day with its date, or seconds where the clock is a stopwatch."""
    utc = record[key]
    if utc is None:
        return f"{record[f'{key}_s']:.1f} s"
    return f"{utc[:UTC_LENGTH].replace('T', ' ')}Z"


def _until(record: Mapping[str, Any]) -> str:
    """The end of a span, without its date where that is the date of the beginning."""
    begins, ends = _moment(record, "from"), _moment(record, "to")
    of_one_day = record["from"] is not None and ends[:DATE_LENGTH] == begins[:DATE_LENGTH]
    return ends[DATE_LENGTH:] if of_one_day else ends


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {reason}" for reason, count in counts.items()) or "nothing"


def _radar_lines(recording: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What only a radar has seen."""
    if not recording["radar_only"]:
        return []
    ghosts = ", ".join(f"{ghost} is {of}" for ghost, of in recording["ghosts"].items())
    return [
        (
            "TIS-B",
            f"{recording['radar_only']} tracks of a radar alone, in no pair; "
            f"doubles of an aircraft: {ghosts or 'none'}",
        )
    ]


def _aircraft_rows(aircraft: Sequence[Mapping[str, Any]], most: int) -> list[list[str]]:
    rows = [["address", "callsign", "source", "reports", "from", "to", "altitude", "step", "gaps"]]
    for one in aircraft[: most or None]:
        gaps = str(one["gaps"])
        if one["gaps"]:
            gaps += f", longest {one['longest_gap_s']:.0f} s"
        if one["visits"] > 1:
            gaps += f"; {one['visits']} visits"
        if one["jumps"]:
            gaps += f"; {one['jumps']} jumps"
        rows.append(
            [
                one["address"],
                one["callsign"],
                one["source"],
                str(one["reports"]),
                _moment(one, "from"),
                _until(one),
                _altitudes(one),
                f"{one['altitude_step_m'] / FOOT_M:.0f} ft" if one["altitude_step_m"] else "",
                gaps,
            ]
        )
    return rows


def _altitudes(one: Mapping[str, Any]) -> str:
    if one["altitude_m"] is None:
        return "ground" if one["on_ground"] else "unknown"
    low, high = one["altitude_m"]
    told = f"{low:.0f} m" if low == high else f"{low:.0f} to {high:.0f} m"
    return f"{told}, ground" if one["on_ground"] else told


def _pair_rows(pairs: Sequence[Mapping[str, Any]], most: int) -> list[list[str]]:
    rows = [["distance", "height", "(ft)", "altitude", "time", "speed", "together", "pair"]]
    for pair in pairs[: most or None]:
        step = f" +-{pair['height_step_m']:.0f}" if pair["height_step_m"] else ""
        speed = pair["relative_mps"]
        names = [
            " ".join(dict.fromkeys(filter(None, both))) + "*" * (both[0] in pair["slow"])
            for both in zip(pair["addresses"], pair["callsigns"], strict=True)
        ]
        rows.append(
            [
                f"{pair['distance_m']:.0f} m",
                f"{abs(pair['height_m']):.0f}{step} m",
                f"{abs(pair['height_m']) / FOOT_M:.0f}",
                f"{pair['altitude_m']:.0f} m",
                _moment(pair, "time"),
                "" if speed is None else f"{speed:.0f} m/s",
                f"{pair['together_s']} s" if pair["together_s"] else "",
                " x ".join(names),
            ]
        )
    return rows


def _table(title: str, rows: Sequence[Sequence[str]], total: int, most: int) -> str:
    """Columns as wide as their widest entry, under a title; says how many rows are not shown."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(word.ljust(width) for word, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    shown = len(rows) - 1
    more = f" ({shown} of {total}; --most 0 lists all)" if most and shown < total else ""
    return "\n".join([f"{title}{more}", *lines])
