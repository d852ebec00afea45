"""Surveillance: errors of the size that is stated, loss in bursts, latency with its time, seeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.traffic.surveillance import SURVEILLANCES, Surveillance, Watch
from clearway.traffic.tracking.smooth import CLIMB_MPS2, LEVEL_MPS2, begin_track, follow_report
from clearway.traffic.tracking.tracks import Report, begin_heard_track

HOME = np.zeros(3)


def flying(time_s: float) -> tuple[np.ndarray, np.ndarray]:
    velocity = np.array([-40.0, 10.0, 1.0])
    return np.array([1800.0, -300.0, 100.0]) + time_s * velocity * 0.0, velocity


def listened(kind: Surveillance, seed: int = 0, lasts_s: float = 120.0):  # type: ignore[no-untyped-def]
    watch = Watch(kind, flying, lasts_s, (seed,))
    return [heard for second in range(int(lasts_s)) for heard in watch.until(float(second), HOME)]


@pytest.mark.parametrize("name", [*SURVEILLANCES])
def test_what_is_stated_is_what_errors_are(name: str) -> None:
    kind = replace(SURVEILLANCES[name], lost=0.0, range_m=1e5)
    place, height = [], []
    for seed in range(60):
        for heard in listened(kind, seed, 40.0)[::10]:
            off = heard.position_m - flying(0.0)[0]
            place += list(off[:2] / heard.position_std_m)
            height.append(off[2] / heard.height_std_m)
    if name == "perfect":
        assert np.abs(place).max() < 1e-6
        return
    # What measures angles is exact along its line of sight, and states its worse axis.
    assert np.std(place) == pytest.approx(np.sqrt(0.5) if name == "radar" else 1.0, abs=0.2)
    assert np.std(height) == pytest.approx(1.0, abs=0.3)


def test_nothing_is_heard_from_beyond_the_range_or_before_its_time() -> None:
    kind = replace(SURVEILLANCES["ads-b"], lost=0.0)
    assert listened(replace(kind, range_m=1000.0)) == []
    watch = Watch(kind, flying, 60.0, (1,))
    for second in range(40):
        for heard in watch.until(float(second), HOME):
            assert heard.time_s + kind.latency_s - kind.untold_s <= second + 1e-9


def test_losses_are_as_many_and_as_long_as_said() -> None:
    kind = replace(SURVEILLANCES["ads-b"], lost=0.25, burst_s=4.0, latency_s=0.0, untold_s=0.0)
    heard = [one.time_s for one in listened(kind, 3, 6000.0)]
    assert len(heard) / 6000.0 == pytest.approx(0.75, abs=0.04)
    gaps = np.diff(heard)
    silences = gaps[gaps > 1.5] - 1.0
    assert silences.mean() == pytest.approx(4.0, abs=0.7)


def test_the_same_seed_hears_the_same_and_range_changes_no_error() -> None:
    kind = SURVEILLANCES["ads-b"]
    one, again = listened(kind, 5), listened(kind, 5)
    assert len(one) == len(again) > 50
    assert all(np.array_equal(a.position_m, b.position_m) for a, b in zip(one, again, strict=True))
    wider = {heard.time_s: heard for heard in listened(replace(kind, range_m=1e6), 5)}
    assert all(np.array_equal(wider[a.time_s].position_m, a.position_m) for a in one)
    assert not np.array_equal(listened(kind, 6)[0].position_m, one[0].position_m)


def test_heights_come_in_steps() -> None:
    kind = replace(SURVEILLANCES["ads-b"], lost=0.0)
    heights = np.array([heard.position_m[2] for heard in listened(kind)])
    steps = heights / kind.altitude_step_m
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_smooth_tracks_are_the_tracker_s_where_noise_is_alike() -> None:
    """Against the general filter, axis by axis."""
    kind = Surveillance("even", "", 1e6, noise_m=20.0, velocity_mps=2.0, climb_mps=2.0,
                        altitude_noise_m=20.0)  # fmt: skip
    heard = listened(kind, 2, 30.0)
    mine = begin_track(heard[0])
    for axis, push in ((slice(0, 2), LEVEL_MPS2), (slice(2, 3), CLIMB_MPS2)):
        track = begin_heard_track(1, _report(heard[0]), 1.0)
        mine = begin_track(heard[0])
        for one in heard[1:]:
            track = track.at(one.time_s, push).update(_report(one))
            mine = follow_report(mine, one)
        rates = slice(axis.start + 3, axis.stop + 3)
        np.testing.assert_allclose(mine.mean[axis], track.mean[axis], rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(mine.mean[rates], track.mean[rates], rtol=1e-9, atol=1e-6)
        spread = mine.height if axis.start == 2 else mine.level
        assert spread[0] == pytest.approx(track.covariance[axis.start, axis.start])
        assert spread[2] == pytest.approx(track.covariance[rates.start, rates.start])


def _report(heard) -> Report:  # type: ignore[no-untyped-def]
    return Report(heard.time_s, heard.position_m, heard.velocity_mps, "x",
                  heard.position_std_m, heard.velocity_std_mps)  # fmt: skip


def test_a_long_silence_begins_a_track_anew_and_late_reports_change_nothing() -> None:
    first, *_, last = listened(replace(SURVEILLANCES["ads-b"], lost=0.0), 4, 60.0)
    track = begin_track(first)
    assert follow_report(track, last).reports == 1
    later = follow_report(track, first)
    assert later is track


def test_no_error_leads_beyond_the_radius_of_containment() -> None:
    kind = replace(SURVEILLANCES["ads-b-minimum"], lost=0.0)
    tight = replace(kind, contained_m=40.0)
    for seed in range(8):
        pairs = zip(listened(kind, seed), listened(tight, seed), strict=True)
        for heard, kept in pairs:
            off = heard.position_m[:2] - flying(0.0)[0][:2]
            held = kept.position_m[:2] - flying(0.0)[0][:2]
            assert np.hypot(*held) <= 40.0 + 1e-9
            if np.hypot(*off) <= 40.0:
                assert (held == off).all()
            else:
                assert held / np.hypot(*held) == pytest.approx(off / np.hypot(*off))


def test_impossible_surveillance_is_named() -> None:
    with pytest.raises(InputError, match="lost"):
        Surveillance("x", "", 100.0, lost=1.0)
    with pytest.raises(InputError, match="range_m"):
        Surveillance("x", "", 0.0)
    with pytest.raises(InputError, match="noise_m"):
        Surveillance("x", "", 1.0, noise_m=float("nan"))
