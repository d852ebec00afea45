"""KML, KMZ and DJI's missions as flight plans: the same way as a ground station's plan tells."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.io.plans.flight_plan import Converted, as_mission
from clearway.io.samples import plans
from clearway.missions.planned import plan_reader

NOBODY = np.random.default_rng(0)


def mission_of(path: Path) -> Converted:
    read = plan_reader(path)
    assert read is not None
    return as_mission(read(path))


@pytest.fixture
def planned(tmp_path: Path) -> dict[str, object]:
    plans.write_plan_sample(tmp_path / "a.plan", NOBODY)
    return mission_of(tmp_path / "a.plan").tables["mission"]


@pytest.mark.parametrize(
    ("name", "write"), [("a.kml", plans.write_kml), ("a.kmz", plans.write_wpml)]
)
def test_the_same_way_in_another_form(name, write, planned, tmp_path):
    write(tmp_path / name, NOBODY)
    read = mission_of(tmp_path / name).tables
    assert read["mission"]["waypoints_m"] == planned["waypoints_m"]
    assert read["mission"]["origin_geodetic"] == planned["origin_geodetic"]
    assert read["vehicle"]["position_m"] == (0.0, 0.0, 30.0)


def test_the_content_tells_whatever_it_is_called(tmp_path):
    plans.write_wpml(tmp_path / "a.zip", NOBODY)
    assert mission_of(tmp_path / "a.zip").tables["vehicle"]["speed_mps"] == 1.0


def dji(tmp_path: Path, *changes: tuple[str, str], without: str = "") -> Path:
    """The sample with words replaced in both of its documents."""
    plans.write_wpml(tmp_path / "whole.kmz", NOBODY)
    path = tmp_path / "a.kmz"
    with zipfile.ZipFile(tmp_path / "whole.kmz") as whole, zipfile.ZipFile(path, "w") as made:
        for name in whole.namelist():
            text = whole.read(name).decode()
            for old, new in changes:
                text = text.replace(old, new)
            if name != without:
                made.writestr(name, text)
    return path


def test_a_template_alone_is_flown_above_the_sea_level(tmp_path):
    read = mission_of(dji(tmp_path, without="wpmz/waylines.wpml")).tables["mission"]
    assert read["waypoints_m"][0] == pytest.approx((17.924, 0.0, 30.0))
    assert read["landing_m"] == [(0.0, 0.0, 30.0)]


def test_heights_above_the_place_of_take_off(tmp_path):
    path = dji(tmp_path, (">WGS84</wpml:executeHeightMode>",
                          ">relativeToStartPoint</wpml:executeHeightMode>"))  # fmt: skip
    assert mission_of(path).tables["mission"]["waypoints_m"][0][2] == pytest.approx(178.0)


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        (">WGS84</wpml:executeHeightMode>", ">MOON</wpml:executeHeightMode>", "height mode 'MOON'"),
        ("goHome", "dance", "finishAction 'dance'; valid: goHome, autoLand"),
        ("wpml:executeHeight>", "wpml:x>", "no height (executeHeight"),
        ("50.000000,8.000000,148", "fifty,8.0,148", "takeOffRefPoint 'fifty"),
        ("takeOffRefPoint", "x", "no takeOffRefPoint tells home's"),
        ("8.0002500,50.0000000", "8.00025", "waypoint 0: "),
        ("8.0002500,50.0000000", "8.0,95.0", "latitude 95.0 is no number within"),
        ("</Document>", "", "no whole XML, line "),
        ("<Document>", "<!DOCTYPE kml [<!ENTITY a 'b'>]>", "no whole XML, line "),
    ],
)
def test_what_is_wrong_is_named(old, new, cause, tmp_path):
    with pytest.raises(InputError) as told:
        mission_of(dji(tmp_path, (old, new)))
    assert cause in str(told.value)
    assert "a.kmz" in str(told.value)


def kml(tmp_path: Path, inside: str, head: str = "") -> Path:
    path = tmp_path / "a.kml"
    path.write_text(f"{head}<kml><Document>{inside}</Document></kml>")
    return path


POINT = (
    "<Placemark><name>{}</name><Point><altitudeMode>{}</altitudeMode>"
    "<coordinates>8.{},50,30</coordinates></Point></Placemark>"
)
PATH = (
    "<Placemark><name>p</name><LineString><altitudeMode>relativeToGround</altitudeMode>"
    "<coordinates>8,50,30 8.001,50,40</coordinates></LineString></Placemark>"
)


def test_places_without_a_path_are_flown_in_their_order(tmp_path):
    places = "".join(POINT.format(n, "relativeToGround", f"00{n}") for n in range(3))
    read = mission_of(kml(tmp_path, places))
    assert len(read.tables["mission"]["waypoints_m"]) == 2
    assert read.tables["vehicle"]["position_m"] == (0.0, 0.0, 30.0)
    assert any("home is not set" in note for note in read.notes)


def test_places_beside_a_path_and_polygons_are_counted(tmp_path):
    polygon = "<Placemark><Polygon/></Placemark>"
    read = mission_of(kml(tmp_path, PATH + polygon))
    assert any("1 left out: Polygon" in note for note in read.notes)
    beside = POINT.format("tree", "relativeToGround", "1")
    read = mission_of(kml(tmp_path, PATH + beside))
    assert any("1 left out: place beside the path" in note for note in read.notes)


@pytest.mark.parametrize(
    ("inside", "head", "cause"),
    [
        (PATH + PATH, "", "2 paths ('p', 'p'); valid: one"),
        (PATH.replace("relativeToGround", "clampToGround"), "", "no height to fly at; valid: abs"),
        (PATH.replace("relativeToGround", "absolute"), "", "origin_geodetic in a mission"),
        (PATH.replace("8,50,30", "eight,50,30"), "", "place 0: 'eight' is no number"),
        ("", "", "no waypoint in it"),
        (PATH, "<!DOCTYPE kml [<!ENTITY a 'b'>]>", "declares an entity ('a')"),
    ],
)
def test_what_cannot_be_flown_is_refused(inside, head, cause, tmp_path):
    with pytest.raises(InputError) as told:
        mission_of(kml(tmp_path, inside, head))
    assert cause in str(told.value)


def test_a_document_too_deep_is_refused(tmp_path):
    with pytest.raises(InputError, match="deeper than"):
        mission_of(kml(tmp_path, "<a>" * 5000))


def test_of_members_of_the_same_name_the_last_one_alone_is_unpacked(tmp_path):
    """A small file could hold thousands that each unpack to far more than it takes."""
    plans.write_wpml(tmp_path / "whole.kmz", NOBODY)
    path = tmp_path / "a.kmz"
    whole_path = tmp_path / "whole" / "a.kmz"
    whole_path.parent.mkdir()
    (tmp_path / "whole.kmz").rename(whole_path)
    with zipfile.ZipFile(whole_path) as whole, zipfile.ZipFile(path, "w") as made:
        made.writestr("first/waylines.wpml", b"unpacked")
        for name in whole.namelist():
            made.writestr(name, whole.read(name))
    path.write_bytes(path.read_bytes().replace(b"unpacked", b"damaged!"))
    assert mission_of(path).tables == mission_of(whole_path).tables
