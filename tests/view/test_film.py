"""Films of flights: through the command line, from runs and their files; and their bounds."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from clearway.io.toml_writing import dump_toml
from clearway.view.film.scenes import Scenes
from clearway.view.film.stage import Stage
from clearway.view.film.writing import FASTEST_FPS, HOLDS_S, KINDS, FilmAsked
from clearway.view.replay.in_memory import recording_of
from clearway.view.replay.reading import read_run
from clearway.view.replay.writing import write_mcap
from flown_missions import SHORT, flown
from in_process import clearway

BRIEF = SHORT + "\n[simulation]\ntime_limit_s = 6\n"
FAKE_FFMPEG = """#!/bin/sh
for last; do :; done
[ "$1" = "-version" ] && exit 0
[ -n "$BROKEN" ] && { echo "Unknown encoder h264" >&2; exit 1; }
wc -c > "$last"
"""


@pytest.fixture
def ffmpeg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A program of that name that counts the bytes of the frames it is given."""
    folder = tmp_path / "programs"
    folder.mkdir()
    program = folder / "ffmpeg"
    program.write_text(FAKE_FFMPEG)
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    return program


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run folder."""
    pytest.importorskip("foxglove")
    folder = tmp_path_factory.mktemp("film") / "run"
    folder.mkdir()
    short = flown()
    write_mcap(short.run, short.setup, dump_toml(short.file.effective()), folder / "run.mcap")
    return folder


@given(
    st.sampled_from(sorted(KINDS)),
    st.floats(0.0, 1e5),
    st.floats(0.05, 1e4),
    st.integers(1, FASTEST_FPS),
    st.one_of(st.none(), st.floats(1e-3, 1e5)),
)
def test_frames_lead_from_begin_to_end_and_are_bounded(
    suffix: str, begins: float, lasts: float, fps: int, speed: float | None
) -> None:
    asked = FilmAsked(Path(f"f{suffix}"), fps, speed)
    times, taken = asked.times_s(begins, begins + lasts)
    assert len(times) <= asked.kind.most
    assert times[0] == begins
    assert times[-1] == begins + lasts
    assert np.all(np.diff(times) >= 0.0)
    assert taken >= (speed or 1.0)
    if speed is None and taken > 1.0 + 1e-9:
        assert len(times) / fps >= min(20.0, (asked.kind.most - 2) / fps) - 1.0 / fps
    moving = times[times < begins + lasts]
    assert np.allclose(np.diff(moving), taken / fps, rtol=1e-6, atol=1e-6)
    assert np.count_nonzero(times == begins + lasts) >= round(HOLDS_S * fps)


def test_a_flight_leaves_a_film_beside_its_results(tmp_path: Path) -> None:
    (tmp_path / "brief.toml").write_text(BRIEF)
    options = ("--no-plots", "--no-mcap", "--out", "out")
    film = ("--video", "out/f.gif", "--fps", 2, "--speed", 4)
    done = clearway("fly", "brief.toml", *options, *film, cwd=tmp_path)
    assert "wrote out/f.gif" in done.stderr, done.stderr
    assert "4 times as fast as flown" in done.stderr
    with Image.open(tmp_path / "out" / "f.gif") as image:
        assert image.n_frames >= 3
        assert image.size == (796, 448)
        first = np.asarray(image.convert("RGB"))
        image.seek(2)
        assert np.any(np.asarray(image.convert("RGB")) != first)
    again = clearway("fly", "brief.toml", *options, cwd=tmp_path)
    assert again.returncode == done.returncode, again.stderr
    assert not (tmp_path / "out" / "f.gif").exists(), "a film of the run before is not kept"


def test_a_recorded_run_gives_the_film_that_its_flight_would(recorded: Path) -> None:
    """Numbers are rounded in the file; what is drawn is the same."""
    short = flown()
    kept, fresh = Scenes.of(read_run(recorded)), Scenes.of(recording_of(short.run, short.setup))
    assert np.array_equal(kept.time_s, fresh.time_s)
    assert np.allclose(kept.place_m, fresh.place_m, atol=1e-4)
    assert np.allclose(kept.seen_m, fresh.seen_m, atol=1e-3)
    assert kept.decisions == fresh.decisions
    assert {name: len(track) for name, track in kept.intruders.items()} == {
        name: len(track) for name, track in fresh.intruders.items()
    }


def test_a_moment_shows_what_was_flown_planned_and_met_until_then(recorded: Path) -> None:
    scenes = Scenes.of(read_run(recorded))
    stage = Stage(scenes)
    middle = float(scenes.time_s[len(scenes.time_s) // 2])
    stage.show(middle)
    x, y = (np.asarray(axis) for axis in stage.flown.get_data())
    assert (x[-1], y[-1]) == pytest.approx(tuple(scenes.place_m[len(scenes.time_s) // 2, :2]))
    decision = scenes.decision_at(middle)
    assert decision is not None
    assert len(stage.plan.get_data()[0]) == len(decision["path_m"])
    assert str(decision["explanation"])[:20] in stage.words.get_text().replace("\n", " ")
    nose = stage.vehicle.get_xy()[0] - stage.vehicle.get_xy()[2]
    yaw = float(np.interp(middle, scenes.time_s, scenes.yaw_rad))
    assert np.arctan2(nose[1], nose[0]) == pytest.approx(np.arctan2(np.sin(yaw), np.cos(yaw)))


@pytest.mark.nightly
@pytest.mark.usefixtures("ffmpeg")
def test_an_mp4_is_written_by_ffmpeg(recorded: Path, tmp_path: Path) -> None:
    options = ("--fps", 1, "--speed", 10, "--json")
    done = clearway("replay", recorded, "--video", "f.mp4", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    frames = len(Scenes.of(read_run(recorded)).time_s[::200]) + 1
    size = int((tmp_path / "f.mp4").read_text())
    assert size % (1276 * 718 * 4) == 0
    assert size // (1276 * 718 * 4) >= frames


@pytest.mark.usefixtures("ffmpeg")
def test_what_ffmpeg_says_is_told_and_nothing_is_left(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BROKEN", "1")
    options = ("--fps", 1, "--speed", 10)
    done = clearway("replay", recorded, "--video", "f.mp4", *options, cwd=tmp_path)
    assert done.returncode == 2
    assert "f.mp4: ffmpeg could not write it: Unknown encoder h264" in done.stderr
    assert not (tmp_path / "f.mp4").exists()


def test_without_ffmpeg_what_to_install_is_said_before_any_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    done = clearway("fly", "static-obstacles", "--video", "f.mp4", cwd=tmp_path)
    assert done.returncode == 2
    assert "f.mp4: a .mp4 film needs ffmpeg (apt install ffmpeg" in " ".join(done.stderr.split())
    assert "or name a .gif file" in " ".join(done.stderr.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--video", "f.avi"), ".mp4, .gif"),
        (("--video", "f"), ".mp4, .gif"),
        (("--video", "f.gif", "--fps", 0), "1 to 60"),
        (("--video", "f.gif", "--speed", "nan"), "is not a number from"),
        (("--video", "f.gif", "--speed", "-1"), "above 0"),
        (("--video", "."), "--video is a folder"),
        (("--fps", 10), "--video"),
    ],
)
def test_a_film_that_cannot_be_is_refused_before_any_work(
    tmp_path: Path, options: tuple[object, ...], said: str
) -> None:
    for command in (("fly", "static-obstacles"), ("replay", "nowhere")):
        done = clearway(*command, *options, cwd=tmp_path)
        assert done.returncode == 2
        assert said in " ".join(done.stderr.split())
        assert not list(tmp_path.iterdir())
