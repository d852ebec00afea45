"""The recorded traffic of a mission: what plays around the flight, and what is left out of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.errors import InputError
from clearway.io.moments import parse_moment
from clearway.io.traffic.traffic import read_traffic
from clearway.missions.mission_file import MissionFile
from clearway.traffic.recorded import Aircraft, TrafficRecording, collect_aircraft, without_ghosts
from clearway.traffic.recorded.playing import PlayedTrack, RecordedTraffic, play_track


@dataclass(frozen=True, eq=False)
class RecordedAir:
    """Tracks of a recording at the times and in the frame of a mission."""

    tracks: tuple[PlayedTrack, ...]
    heard_within_m: float
    notes: tuple[str, ...]
    begins_s: float | None = None
    """UTC at which the flight begins, seconds since 1970; None where its clock is a stopwatch."""

    def play(self, *, deaf: bool = False) -> RecordedTraffic:
        """The traffic of one flight; deaf: nothing of it is reported to the ownship."""
        return RecordedTraffic(self.tracks, self.heard_within_m, deaf)


def mission_traffic(file: MissionFile) -> RecordedAir | None:
    """What `[traffic] recording` of a mission holds near it; None without that key.

    Raises InputError for a recording that cannot be read, an address that is not in it, or a moment
    that is none.
    """
    section = file.traffic
    if section.recording is None:
        return None
    recording = read_traffic(section.recording)
    if not recording.reports:
        raise InputError(section.recording, "no aircraft in it says where it is")
    aircraft = collect_aircraft(recording)
    own = _own(aircraft, section.own_address, section.recording)
    reporting = [one for one in without_ghosts(aircraft) if one is not own]
    geometric = section.heights == "geometric"
    step_m = 0.0 if own is None or geometric else own.altitude_step_m
    from_s = _from_s(file, recording)
    origin = file.mission.origin_geodetic
    assert origin is not None
    tracks, heightless = [], 0
    for one in reporting:
        track = play_track(one, origin, from_s, geometric=geometric, own_step_m=step_m)
        if track is None:
            heightless += 1
        elif _comes_near(track, file):
            tracks.append(track)
    notes = [f"{section.recording}: {len(tracks)} aircraft near the flight"]
    ghosts = len(aircraft) - len(reporting) - (own is not None)
    if ghosts:
        notes.append(f"{section.recording}: {ghosts} tracks of a radar alone (TIS-B) left out")
    if heightless:
        notes.append(
            f"{section.recording}: {heightless} aircraft without a {section.heights} altitude "
            "left out"
        )
    begins_s = from_s if recording.clock == "utc" else None
    return RecordedAir(tuple(tracks), section.heard_within_m, tuple(notes), begins_s)


def _own(aircraft: list[Aircraft], address: str | None, source: str) -> Aircraft | None:
    if address is None:
        return None
    wanted = address.strip().lower()
    for one in aircraft:
        if wanted in (one.address.lower(), one.callsign.lower()):
            return one
    some = ", ".join(one.address for one in aircraft[:5])
    raise InputError(
        source, f"traffic.own_address: {address!r} is not in it; valid: {some}, ... (clearway "
        "traffic lists all)"
    )  # fmt: skip


def _from_s(file: MissionFile, recording: TrafficRecording) -> float:
    """Time of the recording at which the flight begins."""
    given = file.traffic.recording_from
    if given is None:
        return recording.reports[0].time_s
    if isinstance(given, str):
        if recording.clock != "utc":
            raise InputError(
                f"mission {file.mission.name!r}",
                f"traffic.recording_from: {given!r}, but the clock of the recording is a "
                "stopwatch; valid: seconds",
            )
        return parse_moment("traffic.recording_from", given).timestamp()
    return given


def _comes_near(track: PlayedTrack, file: MissionFile) -> bool:
    """Whether it may be heard in the course of the flight."""
    corners = np.array([file.vehicle.position_m, *file.mission.waypoints_m])[:, :2]
    length = float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum())
    lasts_s = file.simulation.time_limit_s or 6.0 * length / file.vehicle.speed_mps + 60.0
    during = (track.time_s >= -60.0) & (track.time_s <= lasts_s + 60.0)
    low, high = corners.min(axis=0), corners.max(axis=0)
    place = track.position_m[during, :2]
    beyond = np.linalg.norm(place - np.clip(place, low, high), axis=1)
    return bool(np.any(beyond <= file.traffic.heard_within_m))
