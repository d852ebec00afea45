"""City models as maps: boxes that hold buildings, by real and made-up ones."""

import json

import numpy as np
import pytest

pytest.importorskip("pyproj")
pytest.importorskip("shapely")
pytest.importorskip("rasterio")

from clearway.base.errors import ClearwayError, InputError
from clearway.base.frames import enu_from_geodetic
from clearway.io.maps import placing
from clearway.io.maps.map_features import Geodetic
from clearway.io.maps.maps import read_map
from clearway.obstacles.obstacle_map import ObstacleMap
from maps_for_tests import real, saved, tops


@pytest.fixture(scope="session")
def delft(data_dir):
    return read_map(real(data_dir, "cityjson/delft.city.json"))


@pytest.mark.nightly
def test_every_building_of_delft_that_stands_is_there(delft):
    ids = {one.name for one in delft.obstacles if one.name.startswith("Building")}
    flat = delft.counts["Building: no higher than 1 m above its lowest point"]
    assert len(ids) + flat == 160
    assert delft.counts["Road: ground"] == 143
    assert delft.crs == "Amersfoort / RD New + NAP height"
    assert tops(delft.obstacles).max() + delft.origin.height_m == pytest.approx(16.846, abs=0.02)
    assert any("more area than the outlines" in note for note in delft.notes)


def test_boxes_hold_every_corner_of_the_buildings(delft, data_dir):
    import pyproj

    city = json.loads(real(data_dir, "cityjson/delft.city.json").read_text())
    scale, shift = city["transform"]["scale"], city["transform"]["translate"]
    corners = []
    for part in city["CityObjects"].values():
        if part["type"] == "Building":
            numbers = np.unique(np.concatenate(_leaves(part["geometry"][0]["boundaries"])))
            own = np.array(city["vertices"])[numbers] * scale + shift
            if np.ptp(own[:, 2]) > 1.0:
                corners.append(own)
    points = np.concatenate(corners)
    to_geographic = pyproj.Transformer.from_crs(28992, 4326, always_xy=True)
    longitude, latitude = to_geographic.transform(points[:, 0], points[:, 1])
    local = enu_from_geodetic(np.stack([latitude, longitude, points[:, 2]], axis=-1), delft.origin)
    distance = ObstacleMap(delft.obstacles).distance_m(local)
    assert distance.max() < 0.05
    # And not the streets between them.
    everywhere = np.random.default_rng(0).uniform([-100, -40, 1.5], [50, 60, 1.5], (4000, 3))
    assert 0.3 < (ObstacleMap(delft.obstacles).distance_m(everywhere) > 0).mean() < 0.8


def _leaves(boundaries):
    if all(isinstance(part, int) for part in boundaries):
        return [np.array(boundaries)]
    return [leaf for part in boundaries for leaf in _leaves(part)]


def city_of(**parts):
    """A block of 10 x 8 m with a lower wing of 6 x 8 m beside it, in RD New."""
    model = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [0.001] * 3, "translate": [85000.0, 447500.0, 0.0]},
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415"},
        "vertices": [
            [int(1000 * x), int(1000 * y), int(1000 * z)]
            for z in (0, 5, 12)
            for x, y in ((0, 0), (10, 0), (10, 8), (0, 8), (16, 0), (16, 8))
        ],
        "CityObjects": {
            "b1": {
                "type": "Building",
                "geometry": [
                    {
                        "type": "MultiSurface",
                        "lod": "2",
                        "boundaries": [
                            [[0, 4, 5, 3]],
                            [[12, 13, 14, 15]],
                            [[7, 10, 11, 8]],
                            [[0, 1, 13, 12]],
                        ],
                    }
                ],
            }
        },
    }
    return {**model, **parts}


def test_roofs_of_different_height_become_steps(tmp_path):
    read = read_map(saved(tmp_path, "a.city.json", city_of()), Geodetic(52.011, 4.366, 0.0))
    assert sorted(tops(read.obstacles)) == pytest.approx([5.0, 12.0], abs=0.01)
    low, high = sorted(read.obstacles, key=lambda one: one.size_m[2])
    assert sorted(high.size_m[:2]) == pytest.approx([8.0, 10.0], abs=0.02)
    assert sorted(low.size_m[:2]) == pytest.approx([8.0, 16.0], abs=0.02)


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        ({"metadata": {}}, "referenceSystem: missing"),
        ({"metadata": {"referenceSystem": "EPSG:99999"}}, "is not known"),
        ({"metadata": {"referenceSystem": "EPSG:4326"}}, "coordinates are in degrees of no plane"),
        ({"vertices": [[0, 0, 0]]}, ", but there are 1"),
        ({"vertices": [[0, 0, 0]] * 20 + [[0, 0, 1e308]]}, "vertices[20]: "),
        ({"vertices": "none"}, "vertices"),
        ({"transform": {"scale": [1, 1]}}, "transform.translate: missing"),
        ({"CityObjects": {}}, "no object that stands"),
    ],
)
def test_bad_city_models_name_the_cause(tmp_path, change, cause):
    with pytest.raises(InputError) as refused:
        read_map(saved(tmp_path, "bad.json", city_of(**change)))
    assert cause in str(refused.value)


def test_more_than_can_be_placed_is_refused_before_anything_is(tmp_path, monkeypatch):
    monkeypatch.setattr(placing, "MOST_PLACED", 3)
    ring = [[[1.0, 2.0], [1.0, 2.001], [1.001, 2.001]]]
    geometry = {"type": "MultiPolygon", "coordinates": [ring] * 4}
    feature = {"type": "Feature", "properties": {"height": 9}, "geometry": geometry}
    path = tmp_path / "city.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    with pytest.raises(ClearwayError, match="4 obstacles on the map, at most"):
        read_map(path)
