"""Zones of the airspace: outlines, limits, times, and what is wrong with a file."""

import json
from datetime import UTC, datetime

import numpy as np
import pytest

pytest.importorskip("pyproj")
pytest.importorskip("shapely")
pytest.importorskip("rasterio")

from clearway.base.errors import InputError
from clearway.base.frames import enu_from_geodetic
from clearway.io.maps.map_features import Geodetic
from clearway.io.maps.maps import read_map
from clearway.obstacles.obstacle_map import ObstacleMap
from maps_for_tests import COLOGNE, collection, feature, real, saved

NOON = datetime(2025, 6, 2, 12, tzinfo=UTC)  # a Monday


def test_swiss_zones_have_limits_and_hold_their_outlines(data_dir):
    path = real(data_dir, "geozones/cis_source_sample_ed318.json")
    read = read_map(path, Geodetic(46.95, 7.46, 500.0))
    assert [zone.identifier for zone in read.keep_out] == ["LSZB003", "BLns058", "LSTB002"]
    airport = read.keep_out[0]
    assert airport.name == "LSZB Bern-Belp 2"
    assert airport.restriction == "REQ_AUTHORIZATION"
    assert airport.limits == ("60 m above ground to unlimited",)
    assert airport.in_force(NOON)
    assert read.obstacles == ()
    outline = json.loads(path.read_text())["features"][0]["geometry"]["coordinates"][0]
    edge = np.array([[latitude, longitude, 700.0] for longitude, latitude in outline])
    local = enu_from_geodetic(edge, read.origin)
    zone = ObstacleMap(airport.obstacles)
    assert zone.distance_m(local).max() < 0.2
    below = enu_from_geodetic(edge - [0, 0, 160.0], read.origin)
    assert zone.distance_m(below).min() > 10.0


def test_the_old_format_s_zone_is_read_too(data_dir):
    read = read_map(real(data_dir, "geozones/cis_source_sample_ed269.json"))
    (zone,) = read.keep_out
    assert (zone.identifier, zone.restriction) == ("LSXX", "REQ_AUTHORISATION")
    assert zone.limits == ("0 m above ground to unlimited",)
    assert zone.periods == ()
    assert ObstacleMap(zone.obstacles).distance_m([[0.0, 0.0, 30.0]])[0] < 1.0


def zone_file(*, geometry=None, **properties):
    layer = {
        "lower": 100,
        "lowerReference": "AMSL",
        "upper": 1000,
        "upperReference": "AMSL",
        "uom": "ft",
    }
    shape = geometry or {
        "type": "Point",
        "coordinates": [6.9583, 50.9413],
        "extent": {"subType": "Circle", "radius": 300.0},
        "layer": layer,
    }
    return collection(feature(shape, identifier="Z1", type="PROHIBITED", **properties))


def test_a_round_zone_in_feet(tmp_path):
    (zone,) = read_map(saved(tmp_path, "z.json", zone_file()), COLOGNE).keep_out
    volumes = ObstacleMap(zone.obstacles)
    angles = np.linspace(0, 2 * np.pi, 50)
    ring = np.stack([299 * np.cos(angles), 299 * np.sin(angles), 0 * angles], axis=-1)
    assert volumes.distance_m(ring + np.array([0, 0, 30.48 - 50 + 1])).max() < 0.0
    assert volumes.distance_m(ring + np.array([0, 0, 304.8 - 50 - 1])).max() < 0.0
    assert volumes.distance_m(1.3 * ring).min() > 0.0
    assert volumes.distance_m(ring + np.array([0, 0, 304.8 - 50 + 2])).min() > 0.0


@pytest.mark.parametrize(
    ("moment", "counts"),
    [
        ("2025-06-02T12:00+00:00", True),  # a Monday, 14 h in its own zone
        ("2025-06-02T15:30+00:00", False),  # 17:30 there
        ("2025-06-03T12:00+00:00", False),  # a Tuesday
        ("2026-06-01T12:00+00:00", False),  # a Monday, after its end
    ],
)
def test_zones_have_their_times(tmp_path, moment, counts):
    times = {
        "startDateTime": "2025-01-01T00:00:00Z",
        "endDateTime": "2025-12-31T00:00:00Z",
        "schedule": [{"day": ["MON"], "startTime": "08:00:00+02:00", "endTime": "17:00:00+02:00"}],
    }
    path = saved(tmp_path, "z.json", zone_file(limitedApplicability=[times]))
    (zone,) = read_map(path, COLOGNE).keep_out
    assert zone.in_force(datetime.fromisoformat(moment)) is counts
    assert zone.in_force(None)


def test_hours_of_a_night_run_past_midnight(tmp_path):
    night = {"schedule": [{"day": ["SUN"], "startTime": "22:00Z", "endTime": "06:00Z"}]}
    path = saved(tmp_path, "z.json", zone_file(limitedApplicability=[night]))
    (zone,) = read_map(path, COLOGNE).keep_out
    assert zone.in_force(datetime(2025, 6, 2, 3, tzinfo=UTC))  # Monday, 3 h
    assert not zone.in_force(datetime(2025, 6, 1, 3, tzinfo=UTC))  # Sunday, 3 h


def test_zones_without_restriction_are_left_out(tmp_path):
    data = zone_file()
    data["features"].append(json.loads(json.dumps(data["features"][0])))
    data["features"][1]["properties"]["type"] = "NO_RESTRICTION"
    read = read_map(saved(tmp_path, "z.json", data))
    assert len(read.keep_out) == 1
    assert read.counts == {"zone without restriction": 1}


def test_limits_above_the_ellipsoid_hold_any_sea_level(tmp_path):
    data = zone_file()
    data["features"][0]["geometry"]["layer"] = {
        "lower": 0,
        "lowerReference": "WGS84",
        "upper": 100,
        "upperReference": "WGS84",
        "uom": "m",
    }
    read = read_map(saved(tmp_path, "z.json", data), Geodetic(50.9413, 6.9583, 0.0))
    box = read.keep_out[0].obstacles[0]
    assert box.position_m[2] - box.half_m[2] == pytest.approx(-86.0, abs=0.1)
    assert box.position_m[2] + box.half_m[2] == pytest.approx(207.0, abs=0.1)
    assert any("ellipsoid" in note for note in read.notes)


@pytest.mark.parametrize(
    ("place", "value", "cause"),
    [
        ("upper", 50, "upper limit 50 is not above the lower limit, 100"),
        ("uom", "fathom", "neither m nor ft"),
        ("upperReference", "FL", "upperReference"),
    ],
)
def test_bad_zones_name_the_cause(tmp_path, place, value, cause):
    data = zone_file()
    data["features"][0]["geometry"]["layer"][place] = value
    with pytest.raises(InputError) as refused:
        read_map(saved(tmp_path, "z.json", data))
    assert "features[0]" in str(refused.value)
    assert cause in str(refused.value)
