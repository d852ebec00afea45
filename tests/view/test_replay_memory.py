"""Recordings are read message by message, and shown a few decisions at a time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("foxglove")

from clearway.base.packed import PackedArrays, PackedVoxels, one_a_voxel, voxel_centers
from clearway.view.film import scenes
from clearway.view.film.scenes import Scenes
from clearway.view.replay import packing
from clearway.view.replay.in_memory import recording_of
from clearway.view.replay.packing import pack
from clearway.view.replay.reading import Recording, read_run
from flown_missions import flown, written_run


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return read_run(Path(written_run(tmp_path_factory.mktemp("run"))))


def test_a_page_is_the_same_however_few_decisions_are_looked_at_together(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, film = pack(recording), Scenes.of(recording)
    monkeypatch.setattr(packing, "TOGETHER", 3)
    monkeypatch.setattr(scenes, "TOGETHER", 3)
    assert pack(recording) == whole
    few = Scenes.of(recording)
    np.testing.assert_array_equal(few.seen_m, film.seen_m)
    np.testing.assert_array_equal(few.seen_s, film.seen_s)


def test_messages_are_made_when_asked_for_and_equal_each_time(recording: Recording) -> None:
    run = flown()
    for told in (recording, recording_of(run.run, run.setup)):
        assert told.decisions[0] is not told.decisions[0]
        assert told.decisions == list(told.decisions)
        assert told.decisions[1:3] == list(told.decisions)[1:3]
        assert told.decisions != list(told.decisions)[1:]
        assert len(told.states) == len(run.run.time_s)


@pytest.mark.parametrize("count", [0, 1, 500])
@pytest.mark.parametrize("from_m", [0.0, -3e5])
def test_packed_voxels_are_those_that_hold_points(count: int, from_m: float) -> None:
    points = np.random.default_rng(count).uniform(from_m, from_m + 9.0, (count, 3))
    packed, first = PackedVoxels.of(points, 0.7), one_a_voxel(points, 0.7)
    expected = (np.floor(points[first] / 0.7) + 0.5) * 0.7
    np.testing.assert_array_equal(packed.centers_m(), expected)
    np.testing.assert_array_equal(voxel_centers(packed.centers_m(), 0.7), expected)


def test_packed_arrays_come_back_to_the_bit() -> None:
    rng = np.random.default_rng(1)
    arrays = (rng.normal(size=(7, 3)), rng.uniform(size=5) < 0.5, np.zeros((0, 3)), np.arange(4))
    arrays[0][0] = np.nan, np.inf, -0.0
    for before, after in zip(arrays, PackedArrays.of(*arrays).unpack(), strict=True):
        assert before.tobytes() == after.tobytes()
        assert (before.dtype, before.shape) == (after.dtype, after.shape)
