"""Point clouds: real files of every format, and every way in which a file can be bad."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from absent_packages import without
from clearway.base.errors import InputError, MissingExtraError
from clearway.base.units import FOOT_M, US_SURVEY_FOOT_M
from clearway.io.scans.scan_formats import read_points
from clouds_for_tests import PCD_HEAD, POINTS, write_pcd


def write_las(path: Path, points: np.ndarray, classes: list[int], epsg: Any = None) -> Path:
    import laspy

    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [0.001] * 3
    if epsg is not None:
        import pyproj

        header.add_crs(pyproj.CRS.from_user_input(epsg))
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.classification = np.array(classes, dtype=np.uint8)
    las.write(path)
    return path


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", "1,2,3\n-4.5,0.25,0\n10,-2,1.5\n"),
        ("a.csv", "intensity,X,Y,Z\n9,1,2,3\n9,-4.5,0.25,0\n9,10,-2,1.5\n"),
        ("a.csv", "x_m;y_m;z_m;label\n1;2;3;car\n-4.5;0.25;0;car\n10;-2;1.5;tree\n"),
        ("a.xyz", "# made by hand\n1 2 3 99\n\n-4.5\t0.25 0 98 # near\n10 -2 1.5 97\n"),
        ("a.TXT", "1 2 3\n-4.5 0.25 0\n10 -2 1.5"),
        ("a.csv", '"x";"y";"z"\n"1,0";"2,0";"3"\n-4,5;0,25;0\n10;-2;1,5\n'),
        ("a.csv", "1,0;2,0;3,0\r\n-4,5;0,25;0\r\n10;-2;1,5\r\n"),
        ("a.txt", "//X Y Z Intensity\n1 2 3 7\n-4.5 0.25 0 7\n10 -2 1.5 7\n"),
    ],
)
def test_text_tables(tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    cloud = read_points(path)
    np.testing.assert_allclose(cloud.points_m, POINTS)
    assert any("cut off?" in note for note in cloud.notes) == (not text.endswith("\n"))


def test_npy_keeps_the_first_three_columns(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.column_stack([POINTS, [7, 8, 9]]).astype(np.float32))
    np.testing.assert_allclose(read_points(tmp_path / "a.npy").points_m, POINTS)


PLY_HEAD = (
    "ply\nformat {form} 1.0\ncomment made by hand\nelement vertex 3\nproperty uchar red\n"
    "property double x\nproperty float y\nproperty int Z\nelement face 1\n"
    "property list uchar int vertex_indices\nend_header\n"
)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_ply(tmp_path: Path, form: str, end: str) -> None:
    points = np.array([[1.0, 2.0, 3.0], [-4.5, 0.25, 0.0], [10.0, -2.0, 1.0]])
    order = ">" if "big" in form else "<"
    records = np.zeros(3, [("red", "u1"), ("x", order + "f8"), ("y", order + "f4"),
                           ("z", order + "i4")])  # fmt: skip
    records["x"], records["y"], records["z"] = points.T
    rows = "".join(f"7 {x:g} {y:g} {z:.0f}{end}" for x, y, z in points)
    data = (rows + f"3 0 1 2{end}").encode() if form == "ascii" else records.tobytes() + b"\3"
    path = tmp_path / "a.ply"
    path.write_bytes(PLY_HEAD.format(form=form).replace("\n", end).encode() + data)
    np.testing.assert_allclose(read_points(path).points_m, points)
    path.write_bytes(PLY_HEAD.format(form=form).replace("vertex 3", "vertex 9").encode() + data)
    with pytest.raises(InputError, match="truncated: the header promises 9 vertices, the data"):
        read_points(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("end_header", "", "no PLY header, or a truncated one"),
        ("ascii", "zip", "header format 'zip'; valid: ascii, binary_little"),
        ("element vertex 3", "element vertex many", "its first element must be vertex"),
        ("element vertex", "element camera", "its first element must be vertex"),
        ("double x", "double u", "no property x of vertex"),
        ("double x", "list uchar int x", r"property \['list', 'uchar', 'int', 'x'\]; valid: char"),
        ("7 1 2 3", "7 1 two 3", "damaged vertices after line 11: could not convert"),
        ("7 1 2 3", "7 1 2", "truncated: line 12 has less than 4 values"),
    ],
)
def test_bad_ply_files(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = PLY_HEAD.format(form="ascii") + "7 1 2 3\n7 1 2 3\n7 4 5 6\n"
    (tmp_path / "a.ply").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        read_points(tmp_path / "a.ply")


def test_npy_of_records(tmp_path: Path) -> None:
    records = np.zeros(3, [("ring", "u2"), ("x", ">f4"), ("y", "f8"), ("z", "f4")])
    records["x"], records["y"], records["z"] = POINTS.T
    np.save(tmp_path / "a.npy", records)
    np.testing.assert_allclose(read_points(tmp_path / "a.npy").points_m, POINTS)
    np.save(tmp_path / "a.npy", np.ones((3, 500)))
    with pytest.raises(InputError, match="up to 32 columns"):
        read_points(tmp_path / "a.npy")


@pytest.mark.parametrize(
    ("columns", "dtype"), [(3, "<f4"), (5, "<f4"), (4, "<f8")], ids=["xyz", "with ring", "doubles"]
)
def test_bin_of_other_layouts_is_refused(tmp_path: Path, columns: int, dtype: str) -> None:
    points = np.random.default_rng(0).uniform(-50.0, 50.0, (400, columns)).astype("<f4")
    points[:, 3:] = np.abs(points[:, 3:])
    points.astype(dtype).tofile(tmp_path / "a.bin")
    with pytest.raises(InputError, match=r"intensity, is negative in \d+ % of its points; valid"):
        read_points(tmp_path / "a.bin")


def test_points_that_are_not_finite_are_counted(tmp_path: Path) -> None:
    bad = np.vstack([POINTS, [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf]]])
    np.save(tmp_path / "a.npy", bad)
    for path in (tmp_path / "a.npy", write_pcd(tmp_path / "a.pcd", bad, "binary")):
        cloud = read_points(path)
        assert cloud.counts == {"not finite": 3}
        np.testing.assert_allclose(cloud.points_m, POINTS)


@pytest.mark.parametrize(
    ("epsg", "across_m", "up_m", "unit"),
    [
        ("EPSG:28992", 1.0, 1.0, "metres"),
        ("EPSG:6880", US_SURVEY_FOOT_M, US_SURVEY_FOOT_M, "US survey feet"),
        ("EPSG:2994", FOOT_M, FOOT_M, "feet"),
        ("EPSG:28992+5703", 1.0, 1.0, "metres"),
        ("EPSG:28992+6360", 1.0, US_SURVEY_FOOT_M, "metres across, US survey feet up"),
    ],
)
def test_las_units_of_the_crs(
    tmp_path: Path, epsg: str, across_m: float, up_m: float, unit: str
) -> None:
    pytest.importorskip("pyproj")
    cloud = read_points(write_las(tmp_path / "tile.las", POINTS, [2, 7, 5], epsg))
    expected = POINTS[[0, 2]] * [across_m, across_m, up_m]
    np.testing.assert_allclose(cloud.points_m, expected, atol=1e-3)
    assert cloud.unit.startswith(unit)
    assert cloud.classes is not None
    assert cloud.classes.tolist() == [2, 5]
    assert cloud.counts == {"noise class 7 or 18": 1}
    assert cloud.survey


def test_las_in_degrees_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("pyproj")
    path = write_las(tmp_path / "tile.las", POINTS, [2, 2, 2], "EPSG:4326")
    with pytest.raises(InputError, match=r"degrees .*valid: a projected CRS"):
        read_points(path)


def test_real_scans(data_dir: Path) -> None:
    scan = read_points(data_dir / "lidar/pcd/vls128_1585897255376374245.pcd")
    assert scan.points_m.shape == (208680, 3)
    ranges = np.linalg.norm(scan.points_m, axis=1)
    assert ranges.min() == pytest.approx(1.1, abs=0.1)
    assert ranges.max() == pytest.approx(238.7, abs=0.1)
    assert read_points(data_dir / "lidar/pcd/vlp16_1673400472138016708.pcd").points_m.shape[0] == (
        14831
    )


def test_real_surveys(data_dir: Path) -> None:
    tree = read_points(data_dir / "lidar/aerial/nebraska_tree_building.las")
    assert tree.counts == {"noise class 7 or 18": 25}
    assert tree.unit == "US survey feet"
    np.testing.assert_allclose(
        np.ptp(tree.points_m, axis=0)[:2], [18.3, 12.2], atol=0.2
    )  # 60 x 40 ft
    assert "Nebraska" in str(tree.crs)
    wires = read_points(data_dir / "lidar/aerial/ahn_powerline_12AN2_20.laz")
    assert wires.points_m.shape == (624961, 3)
    assert wires.notes == ("no CRS in the file: metres assumed",)
    assert wires.classes is not None
    assert np.count_nonzero(wires.classes == 14) == 9453
    autzen = read_points(data_dir / "lidar/aerial/autzen_trim.laz")
    assert autzen.unit == "feet"
    np.testing.assert_allclose(np.ptp(autzen.points_m[:, 0]), 1176 * FOOT_M, atol=1.0)


@pytest.mark.parametrize(
    "name",
    [
        "pcd/vls128_1585897255376374245.pcd",
        "aerial/autzen_trim.laz",
        "aerial/nebraska_tree_building.las",
    ],
)
@pytest.mark.parametrize("kept", [0, 5, 60, 300, 1000, 400_000])
def test_truncated_real_files_are_refused(
    data_dir: Path, tmp_path: Path, name: str, kept: int
) -> None:
    path = tmp_path / Path(name).name
    path.write_bytes((data_dir / "lidar" / name).read_bytes()[:kept])
    with pytest.raises(InputError, match=r"truncated|empty") as caught:
        read_points(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.e57", b"ASTM-E57", r"suffix '\.e57'.*valid suffixes: \.pcd, \.ply, \.las"),
        ("a.csv", b"ply\r\nformat", r"another format: .* belong to \.ply"),
        ("a.pcd.gz", b"\x1f\x8b\x08", r"suffix '\.gz'.*a file packed by gzip: unpack it"),
        ("a", b"1 2 3", r"suffix '\(none\)'"),
        ("a.las", b"1 2 3\n" * 100, "no LAS or LAZ header"),
        ("a.pcd", b"LASF" + bytes(400), r"\.las or \.laz"),
        ("a.csv", b"\x93NUMPY" + bytes(100), r"belong to \.npy"),
        ("a.pcd", b"hello\n", "no PCD header"),
        ("a.npy", b"1 2 3\n4 5 6\n", r"\.npy"),
        ("a.npy", b"\x93NUMPY\x01\0\x0e\0{'descr': [((\n", r"damaged or truncated \.npy file"),
        ("a.txt", b"//\n1 2 3\n", "line 1: header without x, y, z"),
        ("a.csv", b"a,b,c\n1,2,3\n", "line 1: header without x, y, z"),
        ("a.csv", b"1,2,3\n1,2\nx,2,3\n", "line 2: 2 columns"),
        ("a.csv", b"1,2,3\n1,two,3\n", "line 2: 'two' is no number"),
        ("a.csv", b"x,y,z\n", "no points"),
        ("a.csv", b"\n \n# nothing\n", "no points"),
        ("a.xyz", b"\xff\xfe1 2 3", "not UTF-8"),
        ("a.csv", b"nan,nan,nan\n", r"no usable point in it \(left out: 1 not finite\)"),
    ],
)
def test_bad_files(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_points(path)


@pytest.mark.parametrize(
    ("crs", "message"),
    [
        ("EPSG:4978", "coordinates are geocentric"),
        ("EPSG:4979", "coordinates are in degrees"),
        (None, "look like degrees: x -122 to -121.99"),
    ],
)
def test_surveys_without_a_plane_are_refused(tmp_path: Path, crs: Any, message: str) -> None:
    import laspy

    path = write_las(tmp_path / "a.las", POINTS, [2] * 3, crs)
    if crs is None:
        las = laspy.read(path)
        las.change_scaling(scales=[1e-7, 1e-7, 0.001], offsets=[-122.0, 45.0, 0.0])
        las.x, las.y, las.z = np.array([[-122.0, 45.0, 90.0], [-121.99, 45.01, 120.0]] * 2)[:3].T
        las.write(path)
    with pytest.raises(InputError, match=message):
        read_points(path)


@pytest.mark.parametrize(
    ("unit", "told"), [(9003, "US survey feet"), (9036, r"unit of length 9036.*valid: 9001")]
)
def test_units_of_a_crs_without_a_name(tmp_path: Path, unit: int, told: str) -> None:
    import laspy
    from laspy.vlrs.known import GeoKeyDirectoryVlr

    keys = [(1024, 0, 1, 1), (3072, 0, 1, 32767), (3076, 0, 1, unit), (4099, 0, 1, 0)]
    directory = GeoKeyDirectoryVlr()
    directory.parse_record_data(np.array([(1, 1, 0, len(keys)), *keys], "<u2").tobytes())
    las = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    las.header.vlrs.append(directory)
    las.x, las.y, las.z = POINTS.T
    las.write(str(tmp_path / "a.las"))
    if unit == 9003:
        cloud = read_points(tmp_path / "a.las")
        assert cloud.unit == told
        np.testing.assert_allclose(cloud.points_m, POINTS * US_SURVEY_FOOT_M, atol=0.01)
    else:
        with pytest.raises(InputError, match=told):
            read_points(tmp_path / "a.las")


@pytest.mark.parametrize(
    ("at", "value", "message"),
    [
        (4, 0xFFFF_FFF0, "its table has 4294967280 chunks, the file"),
        (-8, 2**40, r"no chunk table at byte 1099511627776 of"),
    ],
)
def test_laz_whose_table_promises_more_than_memory_holds(
    tmp_path: Path, at: int, value: int, message: str
) -> None:
    """The library would end the process."""
    path = write_las(tmp_path / "a.laz", POINTS, [2] * 3)
    content = bytearray(path.read_bytes())
    (start,) = struct.unpack_from("<I", content, 96)
    (table,) = struct.unpack_from("<q", content, start)
    struct.pack_into(*(("<I", content, table + at) if at > 0 else ("<q", content, start)), value)
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_points(path)


def test_npy_of_another_shape(tmp_path: Path) -> None:
    for array in (np.zeros(3), np.zeros((3, 2)), np.array([["a", "b", "c"]])):
        np.save(tmp_path / "a.npy", array)
        with pytest.raises(InputError, match=r"shape \[points, 3\]"):
            read_points(tmp_path / "a.npy")


def test_absent_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        read_points(tmp_path / "absent.pcd")
    (tmp_path / "folder.pcd").mkdir()
    with pytest.raises(InputError, match="directory"):
        read_points(tmp_path / "folder.pcd")


@pytest.mark.parametrize(
    ("factor", "unit"), [(1000.0, "millimetres"), (100.0, "centimetres"), (1e6, "another unit")]
)
def test_scan_in_another_unit_is_refused(tmp_path: Path, factor: float, unit: str) -> None:
    rng = np.random.default_rng(1)
    np.save(tmp_path / "wide.npy", rng.uniform(-60.0, 60.0, (500, 3)) * factor)
    with pytest.raises(InputError, match=f"points extend .* m .*{unit}"):
        read_points(tmp_path / "wide.npy")


def test_a_scan_10_km_wide_is_refused_but_a_wide_survey_is_not(tmp_path: Path) -> None:
    wide = np.random.default_rng(2).uniform(-5000.0, 5000.0, (200, 3))
    with pytest.raises(InputError, match="more than a scan can"):
        read_points(write_pcd(tmp_path / "wide.pcd", wide, "binary"))
    cloud = read_points(write_las(tmp_path / "wide.las", wide, [2] * 200))
    assert len(cloud.points_m) == 200
    with pytest.raises(InputError, match="more than an aerial tile can"):
        read_points(write_las(tmp_path / "wider.las", wide * 50.0, [2] * 200))


@pytest.mark.parametrize(
    ("suffix", "package"), [(".pcd", "lzf"), (".las", "laspy"), (".las", "pyproj")]
)
def test_missing_package_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, package: str
) -> None:
    path = tmp_path / f"a{suffix}"
    packed = PCD_HEAD.replace("ascii", "binary_compressed")
    path.write_bytes(b"LASF" if suffix == ".las" else packed.encode())
    without(monkeypatch, package)
    with pytest.raises(MissingExtraError, match=r"clearway\[lidar\]"):
        read_points(path)


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize("text", [b"", b"\0", b" \0", b"\n", b"\0 \0"])
@pytest.mark.parametrize("extended", [False, True])
def test_an_empty_wkt_record_is_none_and_counted(suffix, text, extended, tmp_path):
    laspy = pytest.importorskip("laspy")
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [0.01] * 3
    las = laspy.LasData(header)
    las.x = las.y = las.z = np.arange(5.0)
    record = laspy.vlrs.vlr.VLR("LASF_Projection", 2112, "OGC WKT", text)
    if extended:
        las.evlrs = laspy.vlrs.vlrlist.VLRList([record])
    else:
        las.vlrs.append(record)
    las.write(str(tmp_path / f"a{suffix}"))
    cloud = read_points(tmp_path / f"a{suffix}")
    assert len(cloud.points_m) == 5
    assert cloud.notes == ("no CRS in the file: metres assumed",
                           "empty WKT records in the header: 1")  # fmt: skip
