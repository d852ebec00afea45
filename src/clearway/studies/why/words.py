"""A log's answer in plain words, and as one JSON object."""

from __future__ import annotations

from typing import Any

from clearway.io.json_values import round_number
from clearway.studies.why.causes import Answer, CrashCause
from clearway.studies.why.decisions import FlownDecision
from clearway.studies.why.ending import Event
from clearway.studies.why.explain import Explained

TO_DO = {
    CrashCause.NOT_RECORDED: "record clouds, obstacle_distance or PRX; a run: clearway fly --scans",
    CrashCause.WRONG_MAP: "check origin and frame of the map, or fly by the sensors",
    CrashCause.SENSOR_DEAD: "land, or hold, where a sensor falls silent",
    CrashCause.UNSEEN: "add a sensor that looks there, or fly so that one does",
    CrashCause.SEEN_LATE: "fly slower, or take a sensor that sees farther",
    CrashCause.UNDECLARED_WIND: "declare the wind (safety.wind_mps), or fly with a larger margin",
    CrashCause.LATE_DECISION: "act at the first sight",
    CrashCause.NO_ESCAPE: "fly slower, or enter only where an escape is seen",
}


def explain_in_words(explained: Explained) -> str:
    """Five to eight lines by the flight's clock."""
    answer = explained.answer
    lines = [f"cause      {answer.cause}", f"end        {_end(explained)}"]
    if answer.cause is not CrashCause.NONE:
        lines += [f"visible    {_visible(explained)}", f"because    {explain_because(explained)}"]
    if answer.cause not in (CrashCause.NONE, CrashCause.NOT_RECORDED):
        lines.append(f"clearway   {_counterfactual(explained)}")
    if answer.cause in TO_DO:
        lines.append(f"to do      {TO_DO[answer.cause]}")
    lines.append(f"clock      {_clock(explained)}")
    return "\n".join(lines)


def _clock(explained: Explained) -> str:
    flight = explained.flight
    return (
        f"seconds since the first pose of the log ({explained.start_s:.1f} s in it), {flight.kind}"
    )


def _at(explained: Explained, time_s: float) -> str:
    return f"{time_s - explained.start_s:.1f} s"


def _end(explained: Explained) -> str:
    ending = explained.answer.ending
    at, by = _at(explained, ending.time_s), ending.told_by
    if ending.event is Event.CONTACT:
        return f"contact at {at}, known by {by}"
    nearest = f"{ending.nearest_m:.2f} m" if ending.nearest_m < float("inf") else "unknown"
    if ending.event is Event.NEAR:
        margin = explained.judge.margin_m
        return f"near miss at {at}: {nearest} away, margin {margin:g} m, known by {by}"
    if ending.nearest_m == float("inf"):
        return f"no crash found: {by}"
    return f"no contact, margin kept: the least distance is {nearest}, known by {by}"


def _visible(explained: Explained) -> str:
    answer = explained.answer
    if answer.cause is CrashCause.NOT_RECORDED:
        return "the log has no returns of any sensor in the last 30 s"
    sights = answer.evidence.sights
    if not sights:
        return "no sensor ever showed it"
    first, end_s = sights[0], answer.ending.time_s
    others = ", ".join(f"{one.sensor} at {_at(explained, one.time_s)}" for one in sights[1:])
    what = "showed something before it" if first.hidden else "first showed it"
    ahead = f"{first.sensor} {what} at {_at(explained, first.time_s)}"
    away = f"{first.away_m:.1f} m away, {end_s - first.time_s:.1f} s before"
    return f"{ahead}, {away}{f'; {others}' if others else ''}"


def explain_because(explained: Explained) -> str:
    """The evidence that decided."""
    answer, judge = explained.answer, explained.judge
    evidence = answer.evidence
    needed = f"this vehicle needs {judge.needed_m:.1f} m"
    if answer.cause is CrashCause.NOT_RECORDED:
        return "nothing in the log shows what stood there"
    if answer.cause is CrashCause.WRONG_MAP and evidence.map_shift is not None:
        x, y = evidence.map_shift.shift_m.tolist()
        return (
            f"the map shows nothing there, and fits all returns once shifted by "
            f"({x:+.1f}, {y:+.1f}) m: {evidence.map_shift.fit_m:.2f} m off instead of "
            f"{evidence.map_shift.misfit_m:.2f} m"
        )
    if answer.cause is CrashCause.WRONG_MAP:
        away = evidence.map_lacks_m
        near = away is not None and away < float("inf")
        return "the map is declared complete, but it does not have the danger" + (
            f": its nearest shape is {away:.1f} m away" if near else ""
        )
    if answer.cause is CrashCause.SENSOR_DEAD:
        silent = "; ".join(
            f"{one.sensor} fell silent at {_at(explained, one.last_s)}" for one in evidence.silent
        )
        return f"{silent}, before the danger was within its sight"
    if answer.cause is CrashCause.UNSEEN:
        return f"sensors reported ({evidence.readings} readings), but nothing from there"
    if answer.cause is CrashCause.SEEN_LATE:
        return f"the first sight was too near: {needed}"
    if answer.cause is CrashCause.UNDECLARED_WIND and evidence.drift is not None:
        east, north, _ = evidence.drift.wind_mps.tolist()
        return (
            f"a wind of ({east:+.2f}, {north:+.2f}) m/s carried it {evidence.drift.carried_m:.1f} "
            f"m; without that the same steering keeps {evidence.drift.still_air_m:.1f} m"
        )
    if answer.cause is CrashCause.LATE_DECISION and answer.last_clear is not None:
        last = _at(explained, answer.last_clear.time_s)
        return f"it was seen in time ({needed}), and there was a way clear until {last}"
    return f"it was seen in time ({needed}), but nothing that could be flown then kept clear"


def _counterfactual(explained: Explained) -> str:
    answer, body = explained.answer, explained.judge.body_m
    acted = answer.acted
    if not answer.evidence.sights:
        return "would have been shown no more: no sensor saw it"
    if not answer.decisions:
        return "could decide nothing: no reading of a sensor whose beams are known"
    if acted is None:
        return "would have flown on: nothing that it was shown calls for more"
    would = f"would have {acted.manoeuvre} at {_at(explained, acted.time_s)}"
    kept = f"{max(acted.kept_m, 0.0):.1f} m"
    if acted.kept_m > body:
        return f"{would} and kept {kept} (margin {explained.judge.margin_m:g} m)"
    return f"{would}, which had not kept clear either ({kept}, body {body:g} m)"


def explain_as_json(explained: Explained) -> dict[str, Any]:
    """The answer as plain values; times are seconds of flight."""
    answer, start = explained.answer, explained.start_s
    ending, evidence = answer.ending, answer.evidence
    shift, lacks, drift = evidence.map_shift, evidence.map_lacks_m, evidence.drift
    return {
        "log": explained.flight.source,
        "kind": explained.flight.kind,
        "cause": str(answer.cause),
        "event": str(ending.event),
        "known_by": ending.told_by,
        "clock_start_s": round_number(start),
        "time_s": round_number(ending.time_s - start),
        "place_m": ending.place_m.tolist(),
        "danger_m": ending.danger_m.tolist(),
        "nearest_m": round_number(ending.nearest_m),
        "margin_m": explained.judge.margin_m,
        "body_radius_m": explained.judge.body_m,
        "needed_m": round_number(explained.judge.needed_m),
        "readings": evidence.readings,
        "sights": [
            {
                "sensor": one.sensor,
                "time_s": round_number(one.time_s - start),
                "away_m": round_number(one.away_m),
                "hidden": one.hidden,
            }
            for one in evidence.sights
        ],
        "silent": [
            {"sensor": one.sensor, "last_s": round_number(one.last_s - start)}
            for one in evidence.silent
        ],
        "map_shift_m": None if shift is None else shift.shift_m.tolist(),
        "map_lacks_m": None if lacks is None else round_number(lacks),
        "undeclared_wind_mps": None if drift is None else drift.wind_mps.tolist(),
        "clearway": _describe_flown(answer.acted, start),
        "last_clear": _describe_flown(answer.last_clear, start),
        "decisions": len(answer.decisions),
        "notes": [*explained.flight.notes, *explained.judge.notes],
    }


def _describe_flown(one: FlownDecision | None, start: float) -> dict[str, Any] | None:
    if one is None:
        return None
    return {
        "time_s": round_number(one.time_s - start),
        "mode": str(one.mode),
        "manoeuvre": one.manoeuvre,
        "kept_m": round_number(one.kept_m),
        "holds_escape": one.holds_escape,
        "explanation": one.explanation,
    }


def leaves_open(answer: Answer) -> bool:
    """Whether the log does not show why."""
    return answer.cause is CrashCause.NOT_RECORDED
