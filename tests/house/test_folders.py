"""Packages that a newcomer can look over: few entries a folder, and arrows that run down."""

import tomllib
from pathlib import Path

import pytest

import clearway
from repository import REPOSITORY

SOURCE = Path(clearway.__file__).parent
PACKAGES = ("avoidance", "live", "reach", "sensors")
MOST = 18
FOLDERS = [
    folder
    for package in PACKAGES
    for folder in (SOURCE / package, *(SOURCE / package).rglob("*/"))
    if folder.is_dir() and folder.name != "__pycache__"
]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(SOURCE)))
def test_a_folder_has_few_entries(folder: Path) -> None:
    entries = {one.name for one in folder.iterdir()} - {"__init__.py", "__pycache__"}
    assert 0 < len(entries) <= MOST


def test_each_package_has_its_layers() -> None:
    """A contract that lists all entries; `make imports` checks it."""
    tables = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
    exhaustive = {
        container
        for contract in tables["tool"]["importlinter"]["contracts"]
        if contract["type"] == "layers" and contract["exhaustive"]
        for container in contract["containers"]
    }
    assert exhaustive >= {f"clearway.{package}" for package in PACKAGES}
