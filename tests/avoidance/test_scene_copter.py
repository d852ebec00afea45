"""A moment of a copter with inertia: its reach set begins at the speed that it has."""

from __future__ import annotations

import numpy as np
import pytest

import clearway as cw
from clearway.base.errors import ClearwayError, InputError
from clearway.missions.scene_reading import read_scene
from in_process import clearway

COPTER = """
[grid]
range_m = 20

[vehicle]
kind = "multirotor"

[reach_set]
speed_mps = 10
acceleration_mps2 = 5
"""


def rated(tmp_path, keys=""):
    path = tmp_path / "scene.toml"
    path.write_text(COPTER + keys)
    return cw.assess(path)


@pytest.mark.parametrize(
    ("keys", "now_mps"), [("now_mps = 6", 6.0), ("", 10.0), ("now_mps = 0", 0)]
)
def test_trajectories_begin_at_the_own_speed(tmp_path, keys, now_mps):
    reach_set = rated(tmp_path, keys).reach_set
    roots = reach_set.parent < 0
    lasts_s, most = 0.4, 5.0
    first = np.linalg.norm(reach_set.samples_m[roots, -1, :2], axis=1) / lasts_s
    assert first.max() == pytest.approx(min(now_mps + 0.5 * most * lasts_s, 10.0), abs=0.02)
    assert first.min() == pytest.approx(max(now_mps - 0.5 * most * lasts_s, 0.0), abs=0.3)


def test_its_cells_are_rated_as_those_of_others(tmp_path):
    ball = '\n[[obstacle]]\nshape = "ball"\nposition_m = [6, 0, 0]\nradius_m = 2\n[scan.simulate]\n'
    free, blocked = rated(tmp_path, "now_mps = 6"), rated(tmp_path, "now_mps = 6" + ball)
    assert (free.reach.node_rating == 1.0).all()
    assert blocked.reach.node_rating.min() < 0.3
    straight = int(np.argmax(blocked.reach_set.samples_m[:, -1, 0]))
    assert blocked.reach.node_rating[straight] < free.reach.node_rating[straight]


def test_the_effective_scene_rates_the_same(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(COPTER + "now_mps = 6")
    done = clearway("assess", path, "--no-plots", "--out", tmp_path / "out")
    assert "multirotor, 10 m/s, flown at 6 m/s" in done.stdout
    assert read_scene(tmp_path / "out" / "scene.toml").scene.reach == read_scene(path).scene.reach


def test_what_does_not_suit_the_kind_is_refused(tmp_path):
    with pytest.raises(InputError, match='a multirotor has "flying" alone'):
        rated(tmp_path, 'method = "harmonic"')
    path = tmp_path / "plane.toml"
    path.write_text("[reach_set]\nnow_mps = 6")
    with pytest.raises(InputError, match=r"reach_set\.now_mps: only of"):
        cw.assess(path)


def test_a_recording_is_not_played_with_it(samples):
    scans = samples / "velodyne"
    done = clearway("assess", "--scan", scans, "--all", "--vehicle", "multirotor", "--no-plots")
    assert done.exit_code == 2
    assert "a recording does not tell how fast a multirotor was" in " ".join(done.stderr.split())


def test_other_methods_are_refused_from_python(tmp_path):
    scene = read_scene(_written(tmp_path)).scene
    with pytest.raises(ClearwayError, match="vehicles without inertia"):
        _rate_by(scene, "harmonic")


def _written(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(COPTER)
    return path


def _rate_by(scene, method):
    from dataclasses import replace

    from clearway.avoidance.scene import assess_scene

    return assess_scene(replace(scene, reach=replace(scene.reach, method=method)))
