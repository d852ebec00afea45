"""The tracker: accuracy, identity, life of tracks, and what is left out and counted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.traffic import Ownship, Report, Tracks, track_reports

POSITION_STD_M, VELOCITY_STD_MPS = 0.3, 0.1


def noisy(
    rng: np.random.Generator, time_s: float, start: np.ndarray, velocity: np.ndarray, name: str = ""
) -> Report:
    """A report at 1 Hz quality of an intruder in straight flight."""
    return Report(
        time_s,
        start + velocity * time_s + rng.normal(0.0, POSITION_STD_M, 3),
        velocity + rng.normal(0.0, VELOCITY_STD_MPS, 3),
        address=name,
    )


def exact(time_s: float, position: list[float], velocity: list[float], name: str = "") -> Report:
    return Report(time_s, np.array(position), np.array(velocity), address=name)


def test_tracks_know_more_than_their_reports_and_how_much() -> None:
    rng = np.random.default_rng(1)
    errors, surprises = [], []
    for run in range(60):
        start, velocity = rng.normal(size=3) * 50, rng.normal(size=3) * 3
        tracks = Tracks()
        for second in range(20):
            report = noisy(rng, float(second), start, velocity, f"run{run}")
            tracks = track_reports(tracks, [report], float(second))
        (track,) = tracks.tracks
        error = track.mean - np.concatenate([start + 19.0 * velocity, velocity])
        errors.append(error)
        surprises.append(error @ np.linalg.solve(track.covariance, error))
    squares = np.mean(np.square(errors), axis=0)
    assert np.sqrt(squares[:3].mean()) < 0.8 * POSITION_STD_M
    assert np.sqrt(squares[3:].mean()) < VELOCITY_STD_MPS
    # Straight flight is surer than the filter, which allows for manoeuvres, takes it to be.
    assert 2.0 < np.mean(surprises) < 6.6


def test_identities_hold_through_a_crossing_without_addresses() -> None:
    rng = np.random.default_rng(2)
    flights = [
        (np.array([-20.0, 0.0, 0.0]), np.array([2.0, 0.0, 0.0])),
        (np.array([0.0, -20.0, 1.0]), np.array([0.0, 2.0, 0.0])),
        (np.array([20.0, 20.0, -1.0]), np.array([-2.0, -2.0, 0.1])),
    ]
    tracks = Tracks()
    for second in range(21):
        reports = [noisy(rng, float(second), *flight) for flight in flights]
        order = rng.permutation(3)
        tracks = track_reports(tracks, [reports[n] for n in order], float(second))
        if second == 1:
            identity = {
                n: min(tracks.tracks, key=lambda t: float(np.linalg.norm(t.mean[3:] - v))).identity
                for n, (_, v) in enumerate(flights)
            }
    assert tracks.born == 3
    for n, (start, velocity) in enumerate(flights):
        track = next(t for t in tracks.tracks if t.identity == identity[n])
        np.testing.assert_allclose(track.mean[:3], start + 20.0 * velocity, atol=1.0)
        np.testing.assert_allclose(track.mean[3:], velocity, atol=0.4)


def test_an_intruder_is_the_prediction_to_the_time_of_the_call() -> None:
    tracks = track_reports(Tracks(), [exact(1.0, [10, 0, 0], [2, 0, 0], "ab12cd")], 1.5)
    (intruder,) = tracks.intruders()
    np.testing.assert_allclose(intruder.position_m, [11.0, 0.0, 0.0])
    assert intruder.time_s == 1.5
    assert intruder.address == intruder.name == "ab12cd"
    assert intruder.position_std_m > 0.3


def test_a_turn_is_followed() -> None:
    rng = np.random.default_rng(5)
    tracks = Tracks()
    for second in range(30):
        turn = 0.1 * second
        position = 30.0 * np.array([np.sin(turn), 1.0 - np.cos(turn), 0.0])
        velocity = 3.0 * np.array([np.cos(turn), np.sin(turn), 0.0])
        report = noisy(rng, 0.0, position, velocity)
        timed = Report(float(second), report.position_m, report.velocity_mps)
        tracks = track_reports(tracks, [timed], float(second))
        if second > 1:
            assert np.linalg.norm(tracks.intruders()[0].position_m - position) < 1.5
    assert tracks.born == 1


def test_lost_tracks_coast_grow_and_end() -> None:
    tracks = track_reports(Tracks(), [exact(0.0, [0, 0, 0], [1, 0, 0], "a")], 0.0)
    stds = []
    for second in range(1, 11):
        tracks = track_reports(tracks, [], float(second))
        (intruder,) = tracks.intruders()
        np.testing.assert_allclose(intruder.position_m, [second, 0, 0])
        stds.append(intruder.position_std_m)
    assert np.all(np.diff(stds) > 0)
    assert stds[-1] > 10.0
    tracks = track_reports(tracks, [], 10.5)
    assert (tracks.tracks, tracks.ended) == ((), 1)


def test_clutter_without_address_is_not_believed() -> None:
    tracks = track_reports(Tracks(), [exact(0.0, [5, 5, 5], [1, 0, 0])], 0.0)
    assert tracks.intruders() == []
    assert track_reports(tracks, [], 3.0).tracks == ()
    believed = track_reports(tracks, [exact(1.0, [6, 5, 5], [1, 0, 0])], 1.0)
    assert len(believed.intruders()) == 1


def test_a_late_report_is_used_at_its_own_time() -> None:
    tracks = track_reports(Tracks(), [exact(0.0, [0, 0, 0], [10, 0, 0], "a")], 1.0)
    tracks = track_reports(tracks, [exact(0.5, [5, 0, 0], [10, 0, 0], "a")], 2.0)
    np.testing.assert_allclose(tracks.intruders()[0].position_m, [20, 0, 0], atol=1e-6)


def test_positions_alone_give_velocity() -> None:
    tracks = Tracks()
    for second in range(8):
        report = Report(float(second), np.array([3.0 * second, 0.0, 0.0]))
        tracks = track_reports(tracks, [report], float(second))
    (intruder,) = tracks.intruders()
    np.testing.assert_allclose(intruder.velocity_mps, [3.0, 0.0, 0.0], atol=0.3)


def left_out(tracks: Tracks) -> dict[str, int]:
    return {reason: count for reason, count in tracks.left_out.items() if count}


def test_ownship_is_known_by_address_and_by_place() -> None:
    me = Ownship(np.array([100.0, 0, 50]), np.array([5.0, 0, 0]), address="ABCDEF")
    reports = [
        exact(2.0, [500, 0, 50], [5, 0, 0], "abcdef"),
        exact(1.0, [95.5, 0.4, 50], [5, 0, 0]),
    ]
    tracks = track_reports(Tracks(), reports, 2.0, me)
    assert left_out(tracks) == {"ownship": 2}
    assert tracks.tracks == ()
    # In our place, but on its way through it.
    hit = track_reports(Tracks(), [exact(2.0, [100, 0, 50], [-5, 0, 0])], 2.0, me)
    assert left_out(hit) == {}
    assert len(hit.tracks) == 1


def test_duplicates_are_left_out() -> None:
    report = exact(1.0, [10, 0, 0], [1, 0, 0], "a1")
    tracks = track_reports(Tracks(), [report, report], 1.0)
    assert left_out(tracks) == {"duplicate": 1}
    tracks = track_reports(tracks, [report], 1.2)
    assert left_out(tracks) == {"duplicate": 2}
    # A ghost of the same aircraft under another address, and one without any.
    ghosts = [exact(2.0, [11.1, 0, 0], [1, 0, 0], "~2b"), exact(2.0, [10.9, 0, 0], [1, 0, 0])]
    tracks = track_reports(tracks, [exact(2.0, [11, 0, 0], [1, 0, 0], "a1"), *ghosts], 2.0)
    assert left_out(tracks) == {"duplicate": 4}
    assert len(tracks.tracks) == 1


def test_stale_reports_are_left_out() -> None:
    tracks = track_reports(Tracks(), [exact(1.0, [10, 0, 0], [1, 0, 0], "a")], 20.0)
    assert left_out(tracks) == {"stale": 1}
    tracks = track_reports(tracks, [exact(19.0, [10, 0, 0], [1, 0, 0], "a")], 20.0)
    tracks = track_reports(tracks, [exact(18.0, [9, 0, 0], [1, 0, 0], "a")], 20.0)
    assert left_out(tracks) == {"stale": 2}


@pytest.mark.parametrize(
    "bad",
    [
        exact(1.0, [np.nan, 0, 0], [1, 0, 0], "a"),
        exact(1.0, [10, 0, 0], [np.inf, 0, 0], "a"),
        exact(np.nan, [10, 0, 0], [1, 0, 0], "a"),
        exact(3.0, [10, 0, 0], [1, 0, 0], "a"),
        exact(1.0, [10, 0, 0], [1000, 0, 0], "a"),
        exact(1.0, [1e12, 0, 0], [1, 0, 0], "a"),
        Report(1.0, np.zeros(3), np.zeros(3), "a", position_std_m=0.0),
        Report(1.0, np.zeros(3), np.zeros(3), "a", radius_m=-1.0),
        Report(1.0, np.zeros(3), np.zeros(3), "a", spread_rad=np.array([2.0, 0.0])),
    ],
)
def test_impossible_reports_are_left_out(bad: Report) -> None:
    tracks = track_reports(Tracks(), [bad], 2.0)
    assert left_out(tracks) == {"impossible": 1}
    assert tracks.tracks == ()


def test_an_impossible_jump_does_not_move_the_track() -> None:
    tracks = track_reports(Tracks(), [exact(0.0, [0, 0, 0], [1, 0, 0], "a")], 0.0)
    tracks = track_reports(tracks, [exact(1.0, [400, 0, 0], [1, 0, 0], "a")], 1.0)
    assert left_out(tracks) == {"impossible": 1}
    np.testing.assert_allclose(tracks.intruders()[0].position_m, [1, 0, 0])
    # Hard, but possible: taken at its word.
    tracks = track_reports(tracks, [exact(2.0, [2, 20, 0], [1, 20, 0], "a")], 2.0)
    np.testing.assert_allclose(tracks.intruders()[0].position_m, [2, 20, 0])
    assert tracks.born == 1


def test_time_running_backwards_is_an_error() -> None:
    tracks = track_reports(Tracks(), [], 5.0)
    with pytest.raises(ClearwayError, match="backwards"):
        track_reports(tracks, [], 4.0)


numbers = st.one_of(st.floats(), st.floats(-100, 100))


@given(
    st.lists(
        st.builds(
            lambda t, x, v, name: Report(t, np.array(x), np.array(v), name),
            st.sampled_from([0.0, 0.5, 1.0, 2.0, np.nan]),
            st.lists(numbers, min_size=3, max_size=3),
            st.lists(numbers, min_size=3, max_size=3),
            st.sampled_from(["", "a", "b"]),
        ),
        max_size=8,
    )
)
@settings(max_examples=60, deadline=None)
def test_every_report_is_used_or_counted_and_no_track_is_nonsense(reports: list[Report]) -> None:
    tracks = track_reports(Tracks(), reports, 2.0)
    used = sum(track.reports for track in tracks.tracks)
    assert used + sum(tracks.left_out.values()) == len(reports)
    for track in tracks.tracks:
        assert np.all(np.isfinite(track.mean))
        assert np.all(np.linalg.eigvalsh(track.covariance) > 0.0)
