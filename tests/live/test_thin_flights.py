"""Wires, poles and nets among which beams just fine enough lead, in rain too; at length nightly."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.base.errors import FlightRefusedError
from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from thin_flights import fine_lidar, thin_flight, thin_flight_in
from thin_worlds import FAMILIES, THINNEST_M

SEEDS = range(60)


@pytest.mark.parametrize(("family", "rain"), [("wires", 0.0), ("poles", 1e-3)])
def test_thin_things_are_kept_clear_of(family: str, rain: float) -> None:
    flight = thin_flight(family, 1, rain)
    assert flight.kept, flight
    assert flight.reached, "nothing stops it for ever"


@pytest.mark.nightly
def test_the_first_certain_way_out_keeps_the_whole_margin() -> None:
    """Before a full round was seen, the only one to be had led by a pole within 0.5 m."""
    flight = thin_flight("poles", 3)
    assert flight.kept, flight
    assert flight.reached


@pytest.mark.nightly
@pytest.mark.parametrize("family", FAMILIES)
def test_families_of_thin_things(family: str) -> None:
    flights = [thin_flight(family, seed) for seed in SEEDS]
    assert all(flight.kept for flight in flights), flights
    assert sum(flight.reached for flight in flights) >= 50


@pytest.mark.nightly
@pytest.mark.parametrize(("family", "rain"), [("poles", 1e-4), ("poles", 1e-3), ("wires", 1e-4)])
def test_rain_stops_no_flight_for_ever(family: str, rain: float) -> None:
    """Up to 140 false returns a sweep, and a margin kept all the same."""
    flights = [thin_flight(family, seed, rain) for seed in range(20)]
    assert all(flight.kept for flight in flights), flights
    assert all(flight.reached for flight in flights), flights


@pytest.mark.nightly
def test_wires_of_a_mission(data_dir: Path) -> None:
    path = data_dir.parent / "missions" / "C-wires-across-3-10mm-18.toml"
    if not path.is_file():
        pytest.skip("needs data: no mission of thin wires")
    file = read_mission(str(path))
    declared = file.with_values("safety", smallest_object_m=THINNEST_M["wires"])
    with pytest.raises(FlightRefusedError, match="mm apart"):
        prepare(declared).refuse_impossible()
    setup = prepare(file)
    flight = thin_flight_in(
        setup.world, setup.mission, fine_lidar("wires"), THINNEST_M["wires"], 18
    )
    assert flight.kept, flight
    assert flight.reached
