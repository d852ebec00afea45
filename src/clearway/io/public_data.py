"""Public files that flights of the documentation use: where they are, and whose.

None of them is part of clearway. What is fetched is checked against the hash of the file that the
documentation's figures were made with.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from clearway.base.errors import InputError, naming
from clearway.io.staging import LINK, leads_elsewhere

FOLDER = "CLEARWAY_DATA"
"""Environment variable: a folder of data, looked into for files that are nowhere else."""
CHUNK = 1 << 16
TIMEOUT_S = 30.0
MIT = "MIT"
BSD2 = "BSD-2-Clause"
BSD3 = "BSD-3-Clause"
APACHE = "Apache-2.0"


class PublicFile(NamedTuple):
    """One file."""

    name: str
    """Where it goes, below the folder of data."""
    address: str
    sha256: str
    size: int
    licence: str
    about: str
    used_by: str


def _github(repository: str, commit: str, path: str) -> str:
    return f"https://github.com/{repository}/raw/{commit}/{path}"


FILES = (
    PublicFile(
        "lidar/aerial/nebraska_tree_building.las",
        _github("laspy/laspy", "cc55dcda69dc51db8e45d30692b44978e4805379",
                "tests/data/file_with_both_wkt_and_geotiff_vlrs.las"),
        "58bc14d3268eecf5f286d463b2de4d99e1d045bb6e0f626827d9c2f0ee6053c8", 763_642,
        f"{BSD2} of the repository; origin of the survey unstated",
        "a surveyed garden, 18 x 12 m", "examples/missions/tree-and-building.toml",
    ),
    PublicFile(
        "lidar/aerial/ahn_powerline_12AN2_20.laz",
        _github("hankersyan/AHN_transmission_corridor", "1655d3e86e183e74a662c5b48aa31cf87176505b",
                "data/12AN2_20.laz"),
        "c64fda69bb4a8625aac3baf1e46f8261a7c49c310277e8b47393015323ac3387", 2_372_644,
        "none stated; made of AHN4, Dutch open data",
        "a power line, 140 x 415 m", "examples/missions/power-line.toml",
    ),
    PublicFile(
        "maps/obstacles/LAC_obstacles_v1.csv",
        _github("DME-3/Low-Alt-Obstacle-Check", "ccc74545", "resources/LAC_obstacles_v1.csv"),
        "755fbe86be7db7b2f3a9837547e376e70250c6b1bc65a92acb1952fb2728dbf8", 11_091, MIT,
        "73 high obstacles of Cologne", "examples/missions/cologne-masts.toml",
    ),
    PublicFile(
        "maps/obstacles/Cologne_DEM_merged_from_LAS_25x25.tif",
        _github("DME-3/Low-Alt-Obstacle-Check", "ccc74545",
                "resources/Cologne_DEM_merged_from_LAS_25x25.tif"),
        "943e52ebf4e65e8885f0fdc2e666bbbb58bbf25fefcfd816ce35e09e49fc5ba7", 916_442, MIT,
        "terrain of Cologne, 25 m", "examples/missions/cologne-masts.toml",
    ),
    PublicFile(
        "maps/cityjson/delft.city.json",
        _github("cityjson/cjio", "35728539", "tests/data/delft.json"),
        "c02436ae74be1bb26336a91d138712e83eb7c18723f659a5845cfa047cefec8e", 1_464_527, MIT,
        "160 buildings of Delft", "examples/missions/delft-streets.toml",
    ),
    PublicFile(
        "daa/em-models/uncor_1200only_fwse_v1p2.txt",
        _github("Airspace-Encounter-Models/em-model-manned-bayes", "55bcfd68",
                "model/uncor_1200only_fwse_v1p2.txt"),
        "a40e47d0cd0735055017f572036bba4fa30cc44b54a5eda256416d891b465786", 596_767, BSD2,
        "encounter model of real flights under visual rules",
        "clearway risk; family sampled of `campaign standard`",
    ),
    PublicFile(
        "adsb/tracks_brc_20min_20230830.jsonl",
        _github("eastham/adsb_actions", "847a7776", "tests/20minutes.json"),
        "cd46dbd16b15a007847a53efa57e9898c11bcf9328c8e6a7604094dad63bba3b", 182_487,
        f"{BSD2} of the repository; origin of the feed unstated",
        "twenty minutes of traffic with a real close encounter", "docs/traffic.md",
    ),
    PublicFile(
        "adsb/tracks_monterey_20250601.jsonl.gz",
        _github("eastham/adsb_actions", "847a7776",
                "tests/fixtures/v2_pipeline/grid/20250601/20250601_36_-122.gz"),
        "bee7589ab65cc635ffe96834fc0f91b3ed47ee09f7667f0dee3c9570be91e2bf", 1_044_078,
        "ODbL (adsb.lol)", "a day of traffic with two close encounters", "docs/traffic.md",
    ),
    PublicFile(
        "lidar/bag/vlp16_rosbag2/1673400471837873222_0.db3",
        _github("tier4/nebula", "606ac41f", "{vlp16}/1673400471837873222/{db3}").format(
            vlp16="src/nebula_velodyne/nebula_velodyne_decoders/test_resources/"
            "decoder_ground_truth/vlp16", db3="1673400471837873222_0.db3"),
        "0f0c1f5e8a5818bdf0eb50ec787dbefeaa0bfbfbdeeb50211ef00baab79244ff", 761_856, APACHE,
        "four turns of a VLP-16 indoors (ROS 2 bag)", "docs/scans.md",
    ),
    PublicFile(
        "lidar/ouster/OS-1-128_v2.3.0_1024x10_lb_n3.pcap",
        _github("ouster-lidar/ouster-sdk", "46b7bcee",
                "tests/pcaps/OS-1-128_v2.3.0_1024x10_lb_n3.pcap"),
        "cad3545a6246c2638ad02f3884f880143496127192eca3329b42aac92a06fba5", 1_636_356, BSD3,
        "three turns of an OS1-128", "docs/scans.md",
    ),
    PublicFile(
        "lidar/ouster/OS-1-128_v2.3.0_1024x10.json",
        _github("ouster-lidar/ouster-sdk", "46b7bcee", "tests/pcaps/OS-1-128_v2.3.0_1024x10.json"),
        "3df9e8ebbd62c79aaea34981b0c838d6ada847d9f9b5d0af95770a4036057e49", 7_187, BSD3,
        "its metadata", "docs/scans.md",
    ),
)  # fmt: skip


def where_from(path: str | Path) -> str:
    """The end of a message about a file that is not there: how to get it, where that is known."""
    known = _find_known(path)
    if known is None:
        return ""
    return (
        f"; it is public and no part of clearway: `clearway data --fetch DIR` gets {known.name}, "
        f"and {FOLDER}=DIR tells where it is"
    )


def at_hand(path: Path) -> Path:
    """A file where it is stated to be; a public one that is not there, in the folder of data.

    The folder is that of the environment variable CLEARWAY_DATA. Returns the path as given where
    the file is in neither place.
    """
    known, folder = _find_known(path), os.environ.get(FOLDER)
    if known is None or not folder or os.path.exists(path):
        return path
    kept = Path(folder).absolute() / known.name
    return kept if kept.exists() else path


def find_public_data(path: Path) -> Path:
    """As `at_hand`; raises InputError, with how to get it, for a public file in neither place."""
    there = at_hand(path)
    if not os.path.exists(there) and (whence := where_from(path)):
        raise InputError(str(path), f"no such file{whence}")
    return there


def _find_known(path: str | Path) -> PublicFile | None:
    return next((one for one in FILES if Path(one.name).name == Path(path).name), None)


def is_there(file: PublicFile, folder: Path) -> bool:
    """Whether a folder of data has the file, with the content that is expected."""
    path = folder / file.name
    if not path.is_file():
        return False
    with naming(path, "read"), path.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest() == file.sha256


def fetch_file(
    file: PublicFile, folder: Path, watch: Callable[[int], None] = lambda _more: None
) -> bool:
    """Bring a file into a folder of data: whole and with its hash, or not at all.

    watch: called with the number of bytes that came. Returns False where it is there already.
    Raises InputError naming the file where it cannot be fetched, comes cut off, or is another one.
    """
    if is_there(file, folder):
        return False
    target = folder / file.name
    link = leads_elsewhere(folder, file.name)
    if link is not None:
        raise InputError(str(link), f"cannot be written into: it is {LINK}")
    with naming(target, "written"):
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(
            prefix=f".{target.name}-", suffix=".part", dir=target.parent
        )
    part = Path(name)
    try:
        found = hashlib.sha256()
        with os.fdopen(handle, "wb") as out:
            for block in _blocks(file):
                with naming(target, "written"):
                    out.write(block)
                found.update(block)
                watch(len(block))
        if found.hexdigest() != file.sha256:
            raise InputError(
                file.name,
                f"{file.address} gives another file (sha256 {found.hexdigest()}, expected "
                f"{file.sha256}); nothing of it was kept",
            )
        with naming(target, "written"):
            part.replace(target)
    finally:
        part.unlink(missing_ok=True)
    return True


def _blocks(file: PublicFile) -> Iterator[bytes]:
    """The content as it comes; InputError where the network does not bring all of it."""
    from http.client import HTTPException, IncompleteRead
    from urllib.error import HTTPError, URLError
    from urllib.request import Request, urlopen

    request = Request(file.address, headers={"User-Agent": "clearway"})
    done = 0
    try:
        with urlopen(request, timeout=TIMEOUT_S) as answer:
            length = answer.headers.get("Content-Length")
            while block := answer.read(CHUNK):
                done += len(block)
                yield block
        if length is not None and done != int(length):
            raise InputError(file.name, f"cut off after {done:,} of {int(length):,} bytes")
    except HTTPError as cause:
        raise InputError(file.name, f"{file.address}: {cause.code} {cause.reason}") from cause
    except IncompleteRead as cause:
        raise InputError(file.name, f"cut off after {done + len(cause.partial):,} bytes") from cause
    except (URLError, HTTPException, OSError) as cause:
        reason = getattr(cause, "reason", cause)
        raise InputError(
            file.name,
            f"cannot be fetched from {file.address} ({reason}); with a network elsewhere, put it "
            "there by hand: its sha256 is in `clearway data --json`",
        ) from cause
