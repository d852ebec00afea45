"""Maps for tests: real ones, made-up ones, and a square outline."""

import json

import numpy as np
import pytest

from clearway.io.maps.map_features import Geodetic

COLOGNE = Geodetic(50.9413, 6.9583, 50.0)


def real(data_dir, name):
    path = data_dir / "maps" / name
    if not path.is_file():
        pytest.skip(f"needs data: {name}")
    return path


def saved(tmp_path, name, content):
    path = tmp_path / name
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def square(latitude, longitude, half_deg=0.001):
    west, east = longitude - half_deg, longitude + half_deg
    south, north = latitude - half_deg, latitude + half_deg
    return [[[west, south], [east, south], [east, north], [west, north], [west, south]]]


def tops(obstacles):
    return np.array([one.position_m[2] + one.half_m[2] for one in obstacles])


def collection(*features):
    return {"type": "FeatureCollection", "features": list(features)}


def feature(geometry, **properties):
    return {"type": "Feature", "geometry": geometry, "properties": properties}
