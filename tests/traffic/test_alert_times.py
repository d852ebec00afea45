"""Alerts come when an exact computation says, whatever reports lack; the rest is named.

The reference knows nothing of the code: it takes positions to metres by pymap3d, flies both
straight on in small steps, and asks the definitions of the volumes at each.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pymap3d
import pytest

from clearway.base.frames import geodetic_from_enu
from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS, NAUTICAL_MILE_M
from clearway.io.traffic.traffic import read_traffic
from clearway.missions.alert_history import AlertHistory, alert_history, judge_recording
from clearway.traffic.recorded import TrafficRecording, TrafficReport, collect_aircraft
from clearway.traffic.volumes import VOLUME_SETS, AlertLevel
from clearway.vehicle.performance import PERFORMANCES
from in_process import clearway as run_here

WING = PERFORMANCES["wing"]
WITHIN_S = {"corrective": 55.0, "warning": 25.0}
SHAPES = {"f3442": (2000.0 * FOOT_M, 250.0 * FOOT_M, 0.0),
          "do-365": (0.66 * NAUTICAL_MILE_M, 450.0 * FOOT_M, 35.0)}  # fmt: skip
"""Radius, half height, modified tau of what must stay apart."""
STEPS_S = np.arange(0.0, 55.05, 0.1)


def exact_entry_s(apart: np.ndarray, change: np.ndarray, shape: tuple[float, ...]) -> float:
    """When two that fly straight on first share the volume, by its definition; inf for never."""
    radius, half_height, tau_s = shape
    there = apart + STEPS_S[:, None] * change
    level2 = (there[:, :2] ** 2).sum(axis=1)
    closing = there[:, :2] @ change[:2]
    speed2 = float(change[:2] @ change[:2])
    inside = level2 <= radius**2
    if tau_s and speed2:
        miss2 = level2 - closing**2 / speed2
        with np.errstate(divide="ignore", invalid="ignore"):
            tau = (radius**2 - level2) / closing
        inside |= (closing < 0.0) & (miss2 <= radius**2) & (tau <= tau_s)
    inside &= np.abs(there[:, 2]) <= half_height
    return float(STEPS_S[inside][0]) if inside.any() else math.inf


def positions(rows: Sequence[tuple[float, float, float]], at_s: np.ndarray) -> np.ndarray:
    """[n, 3] points on the ellipsoid, straight between rows of time, latitude, longitude."""
    time_s, latitude, longitude = np.array(rows).T
    points = np.stack(pymap3d.geodetic2ecef(latitude, longitude, 0.0 * latitude), axis=-1)
    return np.stack([np.interp(at_s, time_s, points[:, axis]) for axis in range(3)], axis=-1)


def expected(
    own: Sequence[tuple[float, float, float]],
    other: Sequence[tuple[float, float, float]],
    height: Callable[[float], tuple[float, float]],
    volumes: str,
) -> dict[str, float]:
    """First second of each level: own and other rows, height and climb of one above the other."""
    found: dict[str, float] = {}
    looks: dict[str, int] = {}
    for second in np.arange(math.ceil(own[0][0]), own[-1][0]):
        here, there = (
            positions(own, second + np.array([0.0, 1.0])),
            positions(other, second + np.array([0.0, 1.0])),
        )
        latitude, longitude, _ = pymap3d.ecef2geodetic(*here[0])
        enu = np.stack(
            pymap3d.ecef2enuv(*(there - here).T, float(latitude), float(longitude)), axis=-1
        )
        up, climb = height(float(second))
        apart = np.array([*enu[0, :2], up])
        change = np.array([*(enu[1, :2] - enu[0, :2]), climb])
        entry_s = exact_entry_s(apart, change, SHAPES[volumes])
        for level, within_s in WITHIN_S.items():
            looks[level] = looks.get(level, 0) + (entry_s <= within_s)
            if looks[level] >= VOLUME_SETS[volumes].needed:
                found.setdefault(level, float(second))
    return found


def first_times(history: AlertHistory) -> dict[str, float]:
    """First second at which a level, or a worse one, is given."""
    found: dict[str, float] = {}
    for second in history.seconds:
        for name in WITHIN_S:
            if second.alerts.level >= AlertLevel[name.upper()]:
                found.setdefault(name, second.time_s)
    return found


def agree(found: dict[str, float], wanted: dict[str, float]) -> None:
    assert found.keys() == wanted.keys()
    for level, time_s in wanted.items():
        assert found[level] == pytest.approx(time_s, abs=2.0), level


def level_with_it(_: float) -> tuple[float, float]:
    return 0.0, 0.0


def sinking(second: float) -> tuple[float, float]:
    """1500 ft above until 100 s, then 1500 ft a minute down."""
    rate = 1500.0 * FOOT_PER_MINUTE_MPS if second >= 100.0 else 0.0
    return 1500.0 * FOOT_M - rate * (second - 100.0), -rate


@pytest.mark.parametrize("volumes", SHAPES)
@pytest.mark.parametrize(
    ("name", "own", "height"),
    [
        ("h0.jsonl", "3c0001", level_with_it),
        ("novel.jsonl", "3c0001", level_with_it),
        ("noalt.jsonl", "3c0001", level_with_it),
        ("mixed.jsonl", "3c0001", level_with_it),
        ("pole.jsonl", "a00001", level_with_it),
        ("climb.daa", "Own", sinking),
    ],
)
def test_files_that_hid_an_aircraft_alert_in_time(
    data_dir: Path, name: str, own: str, height: Any, volumes: str
) -> None:
    path = data_dir.parent / "bad_input" / f"alerts-{name}"
    if not path.is_file():
        pytest.skip(f"needs data: {path.name}")
    recording = read_traffic(path)
    rows: dict[str, list[tuple[float, float, float]]] = {}
    for one in recording.reports:
        rows.setdefault(one.address, []).append((one.time_s, one.latitude_deg, one.longitude_deg))
    (other,) = (address for address in rows if address != own)
    done = run_here("alerts", path, "--own", own, "--volumes", volumes, "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["not_judged"] == []
    history = judge_recording(recording, own, VOLUME_SETS[volumes], WING)
    agree(first_times(history), expected(rows[own], rows[other], height, volumes))
    assert told == json.loads(json.dumps(told | history.as_dict()))


ORIGINS = [(46.0, 14.0), (-33.0, 179.99), (89.97, 30.0), (-90.0, 0.0), (0.0, 0.0)]
START_M = np.array([9000.0, 60.0, 0.0])
"""Of the other aircraft from the own one, which flies east at 50 m/s; it comes at 60 m/s."""
OWN_MPS, OTHER_MPS = np.array([50.0, 0.0, 0.0]), np.array([-60.0, 0.0, 0.0])
MET = {"corrective": 21.3, "warning": 51.3}
"""606.7 m are met 76.3 s from the start: (9000 - 606.7) / 110."""


def flown(
    address: str,
    origin: tuple[float, float],
    start_m: np.ndarray,
    velocity_mps: np.ndarray,
    times_s: Sequence[float],
    **changes: Any,
) -> list[TrafficReport]:
    """Reports of straight flight in the tangent plane of an origin, at 900 m."""
    reports = []
    for time_s in times_s:
        east, north, up = start_m + time_s * velocity_mps
        latitude, longitude, _ = geodetic_from_enu([east, north, 0.0], (*origin, 0.0))
        axes = np.stack(pymap3d.enu2uvw(*np.eye(3), *origin), axis=-1)
        there = np.stack(pymap3d.uvw2enu(*(velocity_mps @ axes), float(latitude), float(longitude)))
        reports.append(
            TrafficReport(
                float(time_s),
                address,
                float(latitude),
                float(longitude),
                900.0 + up,
                "barometric",
                None,
                float(np.hypot(*there[:2])),
                float(np.arctan2(there[0], there[1])),
                float(velocity_mps[2]),
                source="adsb",
            )._replace(**changes)
        )
    return reports


def told(*reports: list[TrafficReport], own: str = "aaaaaa") -> AlertHistory:
    rows = sorted((one for group in reports for one in group), key=lambda one: one.time_s)
    recording = TrafficRecording("made", "made", "relative", len(rows), tuple(rows))
    return alert_history(collect_aircraft(recording), own, VOLUME_SETS["f3442"], WING)


ZERO: dict[str, Any] = {"ground_speed_mps": 0.0}
LESS: dict[str, dict[str, Any]] = {
    "nothing": {},
    "no speed": {"ground_speed_mps": None},
    "no track": {"track_rad": None},
    "no speed and track": {"ground_speed_mps": None, "track_rad": None},
    "speed 0 though it flies": ZERO,
    "speed 0 and no track": ZERO | {"track_rad": None},
    "speed in wrong units": {"ground_speed_mps": 60.0 / 3.6},
    "track turned round": {"track_rad": 1.0},
    "no height": {"altitude_m": None, "altitude_kind": None},
    "geometric height": {"altitude_kind": "geometric", "geometric_altitude_m": 1300.0},
    "no climb": {"vertical_rate_mps": None},
    "on the ground, it says": {"altitude_m": None, "altitude_kind": "ground"},
    "nothing but its place": {
        "ground_speed_mps": None, "track_rad": None, "altitude_m": None, "altitude_kind": None,
        "vertical_rate_mps": None,
    },
    "a radar's track": {"source": "tisb", "address": "~2b0001"},
    "FLARM, anonymous": {"source": "flarm", "address": "~2b0001"},
}  # fmt: skip


@pytest.mark.parametrize("who", ["other", "own"])
@pytest.mark.parametrize("less", LESS)
def test_an_aircraft_that_reports_less_alerts_as_soon(less: str, who: str) -> None:
    """Head on; what is left out of the reports of one of both changes no time."""
    changes = LESS[less]
    own = flown("aaaaaa", ORIGINS[0], np.zeros(3), OWN_MPS, range(0, 140, 3))
    other = flown("bbbbbb", ORIGINS[0], START_M, OTHER_MPS, range(1, 140, 4))
    if who == "other":
        other = [one._replace(**changes) for one in other]
    else:
        own = [one._replace(**changes) for one in own]
    history = told(own, other, own=own[0].address)
    agree(first_times(history), MET)
    assert history.not_judged == ()


@pytest.mark.parametrize("origin", ORIGINS)
def test_alerts_come_in_time_anywhere_on_earth(origin: tuple[float, float]) -> None:
    for turn in (0.0, 1.0, 2.5):
        rotated = np.array(
            [
                [math.cos(turn), -math.sin(turn), 0.0],
                [math.sin(turn), math.cos(turn), 0.0],
                [0, 0, 1.0],
            ]
        )
        middle = rotated @ np.array([50.0 * 82.0, 0.0, 0.0])
        own = flown("aaaaaa", origin, -middle, rotated @ OWN_MPS, range(0, 140, 3))
        other = flown("bbbbbb", origin, rotated @ START_M - middle, rotated @ OTHER_MPS, range(140))
        silent = [one._replace(ground_speed_mps=None) for one in other]
        agree(first_times(told(own, other)), MET)
        agree(first_times(told(own, silent)), MET)


@pytest.mark.parametrize(
    "times", [range(0, 140, 20), [*range(45), *range(62, 140)], range(0, 30, 2)]
)
def test_silences_of_half_a_minute_hide_nobody(times: Sequence[int]) -> None:
    own = flown("aaaaaa", ORIGINS[0], np.zeros(3), OWN_MPS, range(140))
    other = flown("bbbbbb", ORIGINS[0], START_M, OTHER_MPS, times)
    agree(first_times(told(own, other)), MET)
    agree(first_times(told(other, own)), MET)


@pytest.mark.parametrize("every_s", [1, 10, 25])
def test_an_address_that_changes_hides_nobody(every_s: int) -> None:
    own = flown("aaaaaa", ORIGINS[0], np.zeros(3), OWN_MPS, range(140))
    other = flown("bbbbbb", ORIGINS[0], START_M, OTHER_MPS, range(140))
    other = [one._replace(address=f"~{int(one.time_s) // every_s:06x}") for one in other]
    agree(first_times(told(own, other)), MET)


def reasons(history: AlertHistory) -> dict[str, str]:
    return {one.address: one.reason for one in history.not_judged}


def seen_from_afar(times: Sequence[float], **changes: Any) -> AlertHistory:
    """What a flight is told of one that would meet it after 102 s."""
    own = flown("aaaaaa", ORIGINS[0], np.zeros(3), OWN_MPS, range(140))
    start_m = START_M + np.array([2200.0, 0.0, 0.0])
    return told(own, flown("bbbbbb", ORIGINS[0], start_m, OTHER_MPS, times, **changes))


def test_who_falls_silent_before_an_alert_is_due_is_named_with_its_seconds() -> None:
    history = seen_from_afar([0.0])
    assert not history.changes()
    (missed,) = history.not_judged
    assert "no report" in missed.reason
    # From when an alert would be due until straight flight has led out of the wider volume again.
    assert missed.seconds == pytest.approx(2.0 * 914.4 / 110.0 + 55.0, abs=2.0)


def test_one_place_without_a_velocity_cannot_be_judged() -> None:
    history = seen_from_afar([40.0], ground_speed_mps=None)
    assert not history.changes()
    assert "no speed" in reasons(history)["bbbbbb"]


def test_what_taxies_below_is_named_and_what_stands_far_away_is_not() -> None:
    slow = np.array([-5.0, 0.0, 0.0])
    own = flown("aaaaaa", ORIGINS[0], np.zeros(3), OWN_MPS, range(140))
    grounded: dict[str, Any] = {"altitude_m": None, "altitude_kind": "ground"}
    below = flown("bbbbbb", ORIGINS[0], np.array([3000.0, 0.0, 0.0]), slow, range(140), **grounded)
    far = flown("cccccc", ORIGINS[0], np.array([0.0, 2e4, 0.0]), slow, range(140), **grounded)
    history = told(own, below, far)
    assert not history.changes()
    assert list(reasons(history)) == ["bbbbbb"]
    assert "ground" in reasons(history)["bbbbbb"]
    assert history.judged == ("bbbbbb", "cccccc"), "it is judged while it is far away"


def test_a_gap_of_the_own_aircraft_is_told_of_those_that_may_have_come_near() -> None:
    own = flown("aaaaaa", ORIGINS[0], np.zeros(3), OWN_MPS, [*range(5), *range(100, 140)])
    other = flown("bbbbbb", ORIGINS[0], START_M, OTHER_MPS, range(140))
    away = flown("cccccc", ORIGINS[0], -5.0 * START_M, OTHER_MPS, range(140))
    history = told(own, other, away)
    assert "own aircraft" in reasons(history)["bbbbbb"]
    assert list(reasons(history)) == ["bbbbbb"]


def test_a_radar_s_double_of_the_own_aircraft_is_no_intruder_and_named() -> None:
    own = flown("aaaaaa", ORIGINS[0], np.zeros(3), OWN_MPS, range(60))
    late = flown("~2b0001", ORIGINS[0], np.array([-200.0, 0.0, 0.0]), OWN_MPS, range(60))
    history = told(own, [one._replace(source="tisb") for one in late])
    assert not history.changes()
    assert "radar" in reasons(history)["~2b0001"]


def test_heights_of_two_kinds_alert_where_they_may_be_the_same_and_only_there() -> None:
    own = flown("aaaaaa", ORIGINS[0], np.zeros(3), OWN_MPS, range(140))
    for height_m, alerts in ((1500.0, True), (4000.0, False)):
        other = flown(
            "bbbbbb", ORIGINS[0], START_M, OTHER_MPS, range(140),
            altitude_m=height_m, altitude_kind="geometric", geometric_altitude_m=height_m,
        )  # fmt: skip
        history = told(own, other)
        assert bool(history.changes()) == alerts
        assert any("barometric" in note for note in history.notes)


def test_climbs_as_reported_count_and_what_heights_belie_does_not() -> None:
    """300 m above and sinking at 5 m/s from 40 s on, which meets 76 m of height 45 s later."""
    own = flown("aaaaaa", ORIGINS[0], np.zeros(3), np.zeros(3), range(140), ground_speed_mps=0.0)
    rows = flown("bbbbbb", ORIGINS[0], np.array([300.0, 0.0, 0.0]), np.zeros(3), range(140))
    for stated, first_s in ((-5.0, 40.0), (None, 40.0), (0.0, 40.0), (5.0, 40.0)):
        other = []
        for one in rows:
            sinks = one.time_s >= 40.0
            height_m = 1200.0 - (5.0 * (one.time_s - 40.0) if sinks else 0.0)
            rate = stated if sinks and stated is not None else 0.0 if stated is not None else None
            other.append(one._replace(altitude_m=height_m, vertical_rate_mps=rate))
        assert first_times(told(own, other))["corrective"] == pytest.approx(first_s, abs=5.5)


def written(folder: Path, *rows: dict[str, Any]) -> Path:
    """Rows of readsb for 100 s: an own aircraft 4b0001 that flies east, and others."""
    path = folder / "day.jsonl"
    with path.open("w") as file:
        for t in range(0, 101, 2):
            own = {"now": t, "hex": "4b0001", "lat": 46.0, "lon": 14.0 + 1e-3 * t, "alt_baro": 3000}
            for row in ({"gs": 150.0, "track": 90.0} | own, *rows):
                file.write(json.dumps({"now": t} | row) + "\n")
    return path


def test_no_alert_is_said_only_where_all_are_judged(tmp_path: Path) -> None:
    far = {"hex": "4b0002", "lat": 46.9, "lon": 14.0, "alt_baro": 3000, "gs": 90, "track": 0}
    nowhere = {"hex": "4b0003", "alt_baro": 3000}
    nameless = {"lat": 46.0, "lon": 14.05, "alt_baro": 3000}
    done = run_here("alerts", written(tmp_path, far), "--own", "4B0001")
    assert "no alert in 101 s" in done.stdout
    for row, address in ((nowhere, "4b0003"), (nameless, "(no address)")):
        done = run_here("alerts", written(tmp_path, far, row), "--own", "4b0001")
        assert done.returncode == 0
        assert "no alert" not in done.stdout
        assert address in done.stdout
        done = run_here("alerts", written(tmp_path, far, row), "--own", "4b0001", "--json")
        (missed,) = json.loads(done.stdout)["not_judged"]
        assert missed["address"] in (address, "")
        assert missed["seconds"] == 101
        assert missed["reason"]


def test_the_own_address_is_the_recording_s_or_asked_for(tmp_path: Path) -> None:
    other = {"hex": "4b0002", "lat": 46.0, "lon": 14.05, "alt_baro": 3000, "flight": "DEMO1"}
    path = written(tmp_path, other, other | {"hex": "4b0003", "lat": 47.0})
    for own, words in (
        ([], ("names no own aircraft", "--own", "4b0001")),
        (["--own", "4b001"], ("4b0001", "--own")),
        (["--own", "demo1"], ("2 aircraft", "4b0002 (DEMO1)", "4b0003 (DEMO1)")),
        (["--own", ""], ("--own", "4b0001")),
    ):
        done = run_here("alerts", path, *own)
        assert done.returncode == 2
        for word in words:
            assert word in done.stderr
    rows = ["NAME lat lon alt trk gs vs time"]
    rows += [f"{name} 46.0 {14.0 + 1e-4 * t} 3000 90 20 0 {t}" for t in range(9) for name in "AB"]
    (tmp_path / "two.daa").write_text("\n".join(rows) + "\n")
    done = run_here("alerts", tmp_path / "two.daa", "--json")
    assert json.loads(done.stdout)["own"] == "A"


def test_a_value_that_cannot_be_true_hides_no_aircraft(tmp_path: Path) -> None:
    for wrong in ({"alt_baro": 1e6}, {"alt_baro": math.nan}, {"gs": -1}, {"track": math.nan}):
        ahead = {"hex": "4b0002", "lat": 46.0, "lon": 14.05, "alt_baro": 3000, "gs": 0} | wrong
        done = run_here("alerts", written(tmp_path, ahead), "--own", "4b0001", "--json")
        told = json.loads(done.stdout)
        assert told["changes"]
        assert any("impossible" in note for note in told["notes"])


def test_a_radar_s_track_that_is_seen_only_as_it_passes_is_no_double() -> None:
    """Ten seconds of a head-on pass, all of them within a kilometre."""
    own = flown("aaaaaa", ORIGINS[0], np.zeros(3), OWN_MPS, range(140))
    other = flown("~2b0001", ORIGINS[0], START_M, OTHER_MPS, range(78, 88), source="tisb")
    history = told(own, other)
    assert first_times(history)["warning"] == 78.0
    assert history.not_judged == ()


@pytest.mark.parametrize("seed", range(8))
def test_reports_that_lack_this_and_that_at_random_alert_in_time(seed: int) -> None:
    """Every other report lacks something else, says it wrongly, or is lost, of both aircraft."""
    rng = np.random.default_rng(seed)
    wrong = [
        *({name: None} for name in ("ground_speed_mps", "track_rad", "vertical_rate_mps")),
        {"altitude_m": None, "altitude_kind": None},
        {"altitude_m": None, "altitude_kind": "ground"},
        {"ground_speed_mps": 0.0},
        {"track_rad": 0.3},
    ]
    groups = []
    for address, start, velocity in (
        ("aaaaaa", np.zeros(3), OWN_MPS),
        ("bbbbbb", START_M, OTHER_MPS),
    ):
        rows = flown(address, ORIGINS[0], start, velocity, range(0, 140, int(rng.integers(1, 4))))
        kept = [rows[0], *(one for one in rows[1:] if rng.random() < 0.7)]
        groups.append(
            [
                one._replace(**wrong[rng.integers(len(wrong))]) if rng.random() < 0.3 else one
                for one in kept
            ]
        )
    agree(first_times(told(*groups)), MET)
