"""How well what is claimed of straying aircraft covers what they do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.io.traffic.traffic import read_traffic
from clearway.studies.encounter_model import read_encounter_model
from clearway.traffic.growth import HORIZONS_S, LIGHT_AIRCRAFT, Growth, TwoKinds
from clearway.traffic.recorded import collect_aircraft
from straying import Strays, covered, strays_of_model, strays_of_recording

AHEAD = (10, 20, 30, 60)
MODEL = "uncor_1200only_fwse_v1p2.txt"


def test_normal_errors_are_covered_as_claimed() -> None:
    """Of errors drawn from the very mixture that is claimed."""
    ones = np.ones(len(HORIZONS_S))
    kinds = TwoKinds(0.3 * ones, 10.0 * ones, 100.0 * ones)
    growth = Growth(kinds, kinds, kinds, kinds)
    rng = np.random.default_rng(4)
    n = 20_000
    std = np.where(rng.random(n) < 0.3, 100.0, 10.0)
    level = std * np.hypot(*rng.normal(size=(2, n)))
    none = np.zeros(n, dtype=np.bool_)
    height = std * np.abs(rng.normal(size=n))
    strays = Strays((10,), np.ones(n), none, none, level[:, None], height[:, None])
    for claim in (0.5, 0.8, 0.95):
        ((place, up, count),) = covered(strays, growth, claim)
        assert count == n
        assert place == pytest.approx(claim, abs=0.01)
        assert up == pytest.approx(claim, abs=0.01)
    strays = replace(strays, level_m=np.full((n, 1), np.nan))
    assert covered(strays, growth)[0][2] == 0


def test_held_out_tracks_of_the_model_are_covered(data_dir) -> None:  # type: ignore[no-untyped-def]
    path = data_dir / "daa" / "em-models" / MODEL
    if not path.is_file():
        pytest.skip(f"needs data: {MODEL}")
    strays = strays_of_model(read_encounter_model(path), 2500, AHEAD, seed=21)
    for place, height, count in covered(strays, LIGHT_AIRCRAFT):
        assert count == 2500
        assert 0.93 <= place <= 0.97
        assert 0.93 <= height <= 0.97


@pytest.mark.nightly
def test_recorded_light_aircraft_are_covered_about_as_well(data_dir) -> None:  # type: ignore[no-untyped-def]
    path = data_dir / "adsb" / "tracks_monterey_20250601.jsonl.gz"
    if not path.is_file():
        pytest.skip(f"needs data: {path.name}")
    strays = strays_of_recording(collect_aircraft(read_traffic(path)), AHEAD)
    for place, _, count in covered(strays, LIGHT_AIRCRAFT, position_m=15.0, velocity_mps=1.5):
        assert count > 500
        assert place > 0.85
