"""Recorded traffic: tracks, gaps, ghosts, closest pairs against brute force and known flights."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import InputError
from clearway.base.frames import enu_from_geodetic, geodetic_from_enu
from clearway.base.units import FOOT_M
from clearway.io.traffic.traffic import read_traffic
from clearway.traffic import Tracks, track_reports
from clearway.traffic.recorded import (
    ClosestPair,
    TrafficRecording,
    TrafficReport,
    closest_pairs,
    collect_aircraft,
    local_reports,
    proximity,
    take_part,
)
from clearway.traffic.recorded.geodesy import planar_offset_m
from clearway.traffic.recorded.ghosts import ghosts_of, without_ghosts
from clearway.traffic.recorded.picture import air_picture
from clearway.traffic.recorded.proximity import proximity_pairs
from clearway.traffic.recorded.samples import sample_aircraft

ORIGIN = (46.0, 14.0, 0.0)
Flight = Callable[[float], Sequence[float]]


def recording(*reports: TrafficReport) -> TrafficRecording:
    ordered = tuple(sorted(reports, key=lambda report: report.time_s))
    return TrafficRecording("made", "made", "relative", len(reports), ordered)


def flown(
    address: str, place_m: Flight, times_s: Sequence[float], **changes: object
) -> list[TrafficReport]:
    """Reports of a flight given as east, north, up in metres of the time; 60 m/s eastwards."""
    reports = []
    for time_s in times_s:
        east, north, up = place_m(time_s)
        latitude, longitude, _ = geodetic_from_enu([east, north, 0.0], ORIGIN)
        report = TrafficReport(
            float(time_s), address, float(latitude), float(longitude), float(up), "barometric",
            None, 60.0, math.pi / 2, 0.0,
        )  # fmt: skip
        reports.append(report._replace(**changes))
    return reports


def eastward(time_s: float) -> Sequence[float]:
    return (60.0 * time_s, 0.0, 500.0)


def crossing(time_s: float) -> Sequence[float]:
    """Northwards through (3000, 120), where the eastward one passes at 50 s, at 52 s."""
    return (3000.0, 120.0 + 60.0 * (time_s - 52.0), 560.0)


def test_a_crossing_is_found_where_it_is() -> None:
    """They are nearest where the relative motion is abeam, whatever the times of their reports."""
    times = np.arange(0.3, 100.0, 3.7)
    found = recording(
        *flown("aaaaaa", eastward, times), *flown("bbbbbb", crossing, times[::2], track_rad=0.0)
    )
    (pair,) = closest_pairs(collect_aircraft(found))
    # The second from the first: (3000 - 60 t, 60 t - 3000 + c, 60) with c = 0 at 50 s.
    apart = np.subtract(crossing(0.0), eastward(0.0))
    moves = np.array([-60.0, 60.0, 0.0])
    closest_s = float(-(apart @ moves) / (moves @ moves))
    assert pair.time_s == pytest.approx(closest_s, abs=0.01)
    assert pair.slant_m == pytest.approx(np.linalg.norm(apart + closest_s * moves), abs=0.05)
    assert pair.height_m == pytest.approx(60.0)
    assert pair.altitude_m == pytest.approx(530.0)
    assert pair.relative_mps == pytest.approx(60.0 * math.sqrt(2.0))
    assert (pair.first.address, pair.second.address) == ("aaaaaa", "bbbbbb")
    near = [
        math.dist(crossing(second)[:2], eastward(second)[:2]) <= 926.0 for second in range(1, 99)
    ]
    assert pair.together_s == sum(near)


@pytest.mark.parametrize("late_s", [0.0, 0.25, 0.5, 0.9])
def test_fast_head_on_passes_are_found_between_whole_seconds(late_s: float) -> None:
    """250 m/s each, 100 m abeam at a time that no clock tells: up to 250 m too far by seconds."""
    times = np.arange(0.0, 30.0)
    ahead = flown("aaaaaa", lambda t: (250.0 * t, 0.0, 500.0), times, ground_speed_mps=250.0)
    meets = flown(
        "bbbbbb",
        lambda t: (250.0 * (2.0 * (15.0 + late_s) - t), 100.0, 500.0),
        times,
        ground_speed_mps=250.0,
    )
    (pair,) = closest_pairs(collect_aircraft(recording(*ahead, *meets)))
    assert pair.time_s == pytest.approx(15.0 + late_s, abs=0.002)
    assert pair.slant_m == pytest.approx(100.0, abs=0.2)


@pytest.mark.parametrize(("gap_s", "seconds"), [(12.0, 33), (12.5, 21)])
def test_positions_are_interpolated_over_12_s_and_no_more(gap_s: float, seconds: int) -> None:
    times = [0.0, 10.0, 10.0 + gap_s, 20.0 + gap_s]
    (one,) = collect_aircraft(recording(*flown("aaaaaa", eastward, times)))
    samples = sample_aircraft([one])
    assert len(samples) == seconds
    east = enu_from_geodetic(
        np.column_stack([samples.latitude_deg, samples.longitude_deg, 0.0 * samples.second]), ORIGIN
    )[:, 0]
    np.testing.assert_allclose(east, 60.0 * samples.second, atol=0.05)
    assert len(one.gaps_s) == (gap_s > 12.0)


def test_what_is_not_in_flight_is_left_out() -> None:
    times = range(20)
    slow = flown("aaaaaa", eastward, times, ground_speed_mps=20.0)
    grounded = flown("bbbbbb", eastward, times, altitude_kind="ground", altitude_m=None)
    silent = flown("cccccc", eastward, times, ground_speed_mps=None, track_rad=None)
    standing = flown("dddddd", lambda _: (0.0, 0.0, 1.0), times, ground_speed_mps=None)
    aircraft = collect_aircraft(recording(*slow, *grounded, *silent, *standing))
    samples = sample_aircraft(aircraft)
    assert set(samples.aircraft) == {2}
    assert np.isnan(samples.east_mps).all()
    assert len(sample_aircraft(aircraft, slowest_mps=0.0)) == 40


@pytest.mark.parametrize("stands", [{"ground_speed_mps": 0.0}, {"ground_speed_mps": None}])
def test_who_hovers_or_drifts_is_in_pairs_and_marked(stands: dict[str, float | None]) -> None:
    """A helicopter that stands in the air below a flight, and a balloon that drifts at 5 m/s."""
    times = np.arange(0.0, 60.0, 3.0)
    flies = flown("aaaaaa", eastward, times)
    stays = flown("bbbbbb", lambda _: (1500.0, 90.0, 480.0), times, **stands)
    drifts = flown("cccccc", lambda t: (1500.0, -5.0 * t, 700.0), times, ground_speed_mps=5.0)
    also = flown("dddddd", lambda t: (60.0 * t, 4000.0, 500.0), times)
    parked = flown(
        "eeeeee", lambda _: (1500.0, 0.0, 0.0), times, altitude_m=None, altitude_kind="ground"
    )
    pairs = closest_pairs(collect_aircraft(recording(*flies, *stays, *drifts, *also, *parked)))
    slow = {(one.first.address, one.second.address): one.slow for one in pairs}
    assert slow == {
        ("aaaaaa", "dddddd"): (),
        ("aaaaaa", "bbbbbb"): ("bbbbbb",),
        ("aaaaaa", "cccccc"): ("cccccc",),
        ("bbbbbb", "cccccc"): ("bbbbbb", "cccccc"),
        ("bbbbbb", "dddddd"): ("bbbbbb",),
        ("cccccc", "dddddd"): ("cccccc",),
    }
    assert pairs[0].slow == (), "what both fly fast comes first, however far apart"
    hovering = next(one for one in pairs if one.slow == ("bbbbbb",))
    with pytest.raises(InputError, match="--as aaaaaa"):
        take_part(hovering, "bbbbbb")
    assert (hovering.time_s, hovering.distance_m) == pytest.approx((25.0, 90.0), abs=0.05)


def test_pairs_are_the_same_alone_and_among_others() -> None:
    """Closest points of all pairs are worked out together; each is what it is by itself."""
    rng = np.random.default_rng(3)
    flights = []
    for number in range(9):
        start, velocity = rng.uniform(-4000, 4000, 3), rng.uniform(-80, 80, 3)
        times = np.sort(rng.uniform(0.0, 60.0, 14))
        flights.append(flown(f"{number:06x}", lambda t, s=start, v=velocity: s + v * t, times))
    told: list[tuple[float, float]] = []
    together = closest_pairs(
        collect_aircraft(recording(*(one for each in flights for one in each))),
        progress=lambda done, total: told.append((done, total)),
    )
    assert told[-1] == (len(together), len(together)), "a bar ends where all is done"
    assert len(together) > 20
    for pair in together:
        one, two = (flights[int(side.address, 16)] for side in (pair.first, pair.second))
        (alone,) = closest_pairs(collect_aircraft(recording(*one, *two)))
        assert (alone.time_s, alone.distance_m, alone.height_m, alone.together_s, alone.slow) == (
            pair.time_s, pair.distance_m, pair.height_m, pair.together_s, pair.slow,
        )  # fmt: skip
    own = closest_pairs(
        collect_aircraft(recording(*(one for each in flights for one in each))), "000003"
    )
    assert [one.time_s for one in own] == [
        one.time_s for one in together if "000003" in (one.first.address, one.second.address)
    ]


def test_unknown_heights_make_no_pair_and_geometric_ones_do() -> None:
    times = range(20)
    low = flown("aaaaaa", eastward, times)
    unknown = flown("bbbbbb", eastward, times, altitude_m=None, altitude_kind=None)
    geometric = flown(
        "cccccc", eastward, times, altitude_kind="geometric", geometric_altitude_m=800.0
    )
    also = flown("dddddd", eastward, times, geometric_altitude_m=900.0)
    made = recording(*low, *unknown, *geometric, *also)
    pairs = closest_pairs(collect_aircraft(made))
    assert set(air_picture(made).without_height) == {
        ("aaaaaa", "bbbbbb"), ("aaaaaa", "cccccc"), ("bbbbbb", "cccccc"), ("bbbbbb", "dddddd"),
    }  # fmt: skip
    heights = {(p.first.address, p.second.address): p.height_m for p in pairs}
    assert heights == {
        ("aaaaaa", "dddddd"): 0.0,
        ("cccccc", "dddddd"): pytest.approx(100.0),
    }


def test_a_jump_is_not_flown() -> None:
    reports = flown("aaaaaa", eastward, range(20))
    reports[10] = reports[10]._replace(latitude_deg=reports[10].latitude_deg + 0.1)
    (one,) = collect_aircraft(recording(*reports))
    assert one.jumps == 2
    assert set(sample_aircraft([one]).second) == set(range(20)) - {10}


def test_tracks_across_the_date_line() -> None:
    reports = [
        TrafficReport(float(t), "aaaaaa", 0.0, (179.995 + 0.001 * t + 180.0) % 360.0 - 180.0,
                      100.0, "barometric")
        for t in range(11)
    ]  # fmt: skip
    (one,) = collect_aircraft(recording(*reports))
    np.testing.assert_allclose(one.segment_mps, 111.32, rtol=1e-3)
    assert len(sample_aircraft([one])) == 11


@pytest.mark.parametrize(
    ("feet", "step"),
    [
        ([1000, 1100, 1400], 100),
        ([1025, 1100, 1400], 25),
        ([1010, 1100], 0),
        ([0.5, 1], 0),
        ([], 0),
    ],
)
def test_steps_of_altitude(feet: list[float], step: float) -> None:
    reports = [
        TrafficReport(float(n), "aaaaaa", 0.0, 0.0, height * FOOT_M, "barometric")
        for n, height in enumerate(feet)
    ] or [TrafficReport(0.0, "aaaaaa", 0.0, 0.0)]
    (one,) = collect_aircraft(recording(*reports))
    assert one.altitude_step_m == pytest.approx(step * FOOT_M)


def test_a_radar_s_track_beside_an_aircraft_is_its_ghost() -> None:
    times = range(60)
    real = flown("aaaaaa", eastward, times, source="adsb")
    behind = flown("~2b0001", lambda t: (60.0 * t - 400.0, 50.0, 450.0), times, source="tisb")
    other = flown("~2b0002", lambda t: (60.0 * t, 3000.0, 450.0), times, source="tisb")
    above = flown("~2b0003", lambda t: (60.0 * t, 0.0, 900.0), times, source="tisb")
    itself = flown("~2b0004", lambda t: (60.0 * t, 5000.0, 450.0), times, source="adsb")
    brief = flown("~2b0005", eastward, range(3), source="tisb")
    aircraft = collect_aircraft(recording(*real, *behind, *other, *above, *itself, *brief))
    assert ghosts_of(aircraft) == {"~2b0001": "aaaaaa"}
    assert [one.address for one in without_ghosts(aircraft)] == ["aaaaaa", "~2b0004"]


@pytest.mark.parametrize("source", ["flarm", "remote id"])
def test_who_reports_itself_under_no_address_of_a_state_is_no_radar_s_track(source: str) -> None:
    one = flown("aaaaaa", eastward, range(20))
    other = flown("~2b0001", eastward, range(20), source=source)
    aircraft = collect_aircraft(recording(*one, *other))
    assert len(without_ghosts(aircraft)) == 2
    assert len(closest_pairs(without_ghosts(aircraft))) == 1


coordinate = st.floats(-0.1, 0.1)


@given(
    latitude=st.floats(-70.0, 70.0),
    longitude=st.floats(-180.0, 180.0),
    north_deg=coordinate,
    east_deg=coordinate,
)
def test_offsets_are_those_of_the_geodesic(
    latitude: float, longitude: float, north_deg: float, east_deg: float
) -> None:
    pyproj = pytest.importorskip("pyproj")
    azimuth, _, distance = pyproj.Geod(ellps="WGS84").inv(
        longitude, latitude, longitude + east_deg, latitude + north_deg
    )
    east, north = planar_offset_m(
        np.array([latitude]), np.array([longitude]),
        np.array([latitude + north_deg]), np.array([longitude + east_deg - 360.0]),
    )  # fmt: skip
    assert math.hypot(east[0], north[0]) == pytest.approx(distance, rel=1e-4, abs=1e-3)
    if distance > 1000.0:
        turned = math.degrees(math.atan2(east[0], north[0])) - azimuth
        assert abs((turned + 180.0) % 360.0 - 180.0) < 0.2  # meridians converge


@given(
    seed=st.integers(0, 10_000),
    flights=st.integers(2, 6),
    within_m=st.sampled_from([500.0, 3000.0, 1e6]),
)
def test_meetings_are_those_of_brute_force(seed: int, flights: int, within_m: float) -> None:
    """Whether all pairs of a second are looked at, or a tree is asked for those that are near."""
    rng = np.random.default_rng(seed)
    reports: list[TrafficReport] = []
    for number in range(flights):
        start, velocity = rng.uniform(-2000, 2000, 3), rng.uniform(-80, 80, 3)
        times = np.sort(rng.uniform(0.0, 60.0, 8))
        reports += flown(
            f"{number:06x}",
            lambda t, s=start, v=velocity: s + v * t,
            times,  # type: ignore[misc]
        )
    samples = sample_aircraft(collect_aircraft(recording(*reports)), slowest_mps=0.0)
    met = proximity_pairs(samples, within_m)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(proximity, "FEW", 1)
        by_tree = proximity_pairs(samples, within_m)
    for name in ("first", "second", "horizontal_m", "height_m"):
        np.testing.assert_array_equal(getattr(by_tree, name), getattr(met, name))
    found = set(zip(met.first.tolist(), met.second.tolist(), strict=True))
    wanted = set()
    for a in range(len(samples)):
        for b in range(a + 1, len(samples)):
            if samples.second[a] == samples.second[b]:
                east, north = planar_offset_m(
                    samples.latitude_deg[[a]], samples.longitude_deg[[a]],
                    samples.latitude_deg[[b]], samples.longitude_deg[[b]],
                )  # fmt: skip
                if math.hypot(east[0], north[0]) <= within_m:
                    wanted.add((a, b))
    assert found == wanted


def test_reports_in_the_local_frame_make_the_tracks_that_were_flown() -> None:
    times = np.arange(0.0, 20.0)
    origin = (*ORIGIN[:2], 500.0)
    mine = flown("cccccc", eastward, times)
    unplaced = flown("dddddd", eastward, times, altitude_m=None, altitude_kind=None)
    other = flown("bbbbbb", crossing, times, track_rad=0.0)
    reports = local_reports([*mine, *unplaced, *other], origin, own_address="CCCCCC")
    assert {report.address for report in reports} == {"bbbbbb"}
    tracks = track_reports(Tracks(), reports[:1], 0.0)
    for report in reports[1:]:
        tracks = track_reports(tracks, [report], report.time_s)
    (intruder,) = tracks.intruders()
    # The Earth falls away below the tangent frame: 1 m in 3.6 km, and more 500 m up.
    np.testing.assert_allclose(
        intruder.position_m, np.subtract(crossing(19.0), (0.0, 0.0, 500.0)), atol=1.5
    )
    np.testing.assert_allclose(intruder.velocity_mps, [0.0, 60.0, 0.0], atol=0.5)
    (still,) = local_reports([other[0]._replace(track_rad=None)], origin)
    assert still.velocity_mps is None


def test_an_unknown_own_address_names_near_ones() -> None:
    found = recording(*flown("a23e55", eastward, range(5)), *flown("a27d3c", crossing, range(5)))
    with pytest.raises(InputError, match=r"own address 'a23e56' is not in it; valid: a23e55"):
        air_picture(found, "a23e56")
    assert air_picture(found, "A23E55").own_address == "a23e55"


def pair_of(pairs: Sequence[ClosestPair], *callsigns: str) -> ClosestPair:
    (found,) = (p for p in pairs if {p.first.callsign, p.second.callsign} == set(callsigns))
    return found


def test_the_real_encounter_over_the_desert(data_dir: Path) -> None:
    """N2436G x N26GB, 2023-08-30 08:16:23Z: 240 m, 0 ft, 5200 ft; nearest of all."""
    picture = air_picture(read_traffic(data_dir / "adsb/tracks_brc_20min_20230830.jsonl"))
    pair = picture.pairs[0]
    assert pair is pair_of(picture.pairs, "N2436G", "N26GB")
    assert pair.time_s == 1693383383.0
    assert pair.distance_m == pytest.approx(240.0, abs=1.0)
    assert pair.height_m == 0.0
    assert pair.altitude_m == pytest.approx(5200 * FOOT_M)
    own = air_picture(picture.recording, "a27d3c")
    assert own.pairs[0].time_s == pair.time_s
    assert all("a27d3c" in (p.first.address, p.second.address) for p in own.pairs)
    assert 0 < len(own.pairs) < len(picture.pairs)


def test_the_real_encounters_over_monterey(data_dir: Path) -> None:
    """N7442S x N810HP (together, 77 m at 22:46:34Z) and N421CV x N605WM (279 m, 350 ft)."""
    picture = air_picture(read_traffic(data_dir / "adsb/tracks_monterey_20250601.jsonl.gz"))
    together, crossed = picture.pairs[:2]
    assert {together.first.callsign, together.second.callsign} == {"N7442S", "N810HP"}
    # 24 s after the named moment two reports of the same second are nearer still.
    assert together.distance_m <= 77.0
    assert abs(together.time_s - 1748817994.0) <= 60.0
    assert together.together_s > 60
    both = [together.first, together.second]
    samples = sample_aircraft(both)
    met = proximity_pairs(samples, 1000.0)
    (at,) = np.flatnonzero(samples.second[met.first] == 1748817994)
    assert met.horizontal_m[at] == pytest.approx(77.0, abs=1.0)
    assert met.height_m[at] / FOOT_M == pytest.approx(46.0, abs=0.5)
    assert {crossed.first.callsign, crossed.second.callsign} == {"N421CV", "N605WM"}
    assert crossed.time_s == pytest.approx(1748812402.0, abs=0.5)
    assert crossed.distance_m == pytest.approx(279.0, abs=2.0)
    assert abs(crossed.height_m) == pytest.approx(350 * FOOT_M, abs=0.5)
    assert crossed.height_step_m == pytest.approx(62.5 * FOOT_M)
    assert picture.radar_only == 37
    assert picture.ghosts["~2b0d0d"] == "ab1b2d"


@pytest.mark.parametrize(
    ("name", "time_s", "distance_m"),
    [("C0_0_120", 120.0, 0.0), ("C1_0_120", 105.0, 0.417 * 1852), ("H0_0_120", 100.0, 0.5 * 1852),
     ("H1", 200.0, 0.145 * 1852)],
)  # fmt: skip
def test_scripted_encounters(data_dir: Path, name: str, time_s: float, distance_m: float) -> None:
    picture = air_picture(read_traffic(data_dir / f"daa/daidalus/Scenarios/{name}.daa"))
    (pair,) = picture.pairs
    assert picture.own_address == "Ownship"
    # The scenarios are told at whole seconds; between them two that fly fast are nearer still.
    assert pair.time_s == pytest.approx(time_s, abs=0.5)
    assert 0.9 * distance_m - 5.0 <= pair.distance_m <= distance_m + 5.0
    assert pair.height_m == 0.0
