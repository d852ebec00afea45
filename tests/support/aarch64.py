"""A Python for aarch64 under emulation: packages of Debian and PyPI in a folder, none installed."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from repository import REPOSITORY

DEBIAN = (
    *("python3.11-minimal", "libpython3.11-minimal", "libpython3.11-stdlib", "libc6", "libgcc-s1"),
    *("libstdc++6", "zlib1g", "libexpat1", "libssl3", "libffi8", "libbz2-1.0", "liblzma5"),
    *("libsqlite3-0", "libuuid1", "tzdata"),
)
EMULATOR = "qemu-aarch64-static"
PYPI = ("matplotlib", "numpy", "platformdirs", "pydantic", "pymap3d", "rich", "scipy", "typer")
PLATFORMS = ("manylinux_2_28_aarch64", "manylinux_2_17_aarch64", "manylinux2014_aarch64")


class AbsentError(Exception):
    """Why there can be no such Python here."""


def emulated_python(folder: Path) -> list[str]:
    """Return the command of a Python with clearway's dependencies beside it, in `site`.

    It is made where it is not there. Raises AbsentError where packages cannot be had.
    """
    root, ready = folder / "root", folder / "ready"
    if not ready.exists():
        shutil.rmtree(folder, ignore_errors=True)
        _fill(root, folder / "site", folder / "debs")
        ready.touch()
    emulator = shutil.which(EMULATOR) or str(folder / "own" / "usr" / "bin" / EMULATOR)
    return [emulator, "-L", str(root), str(root / "usr" / "bin" / "python3.11")]


def _fill(root: Path, site: Path, debs: Path) -> None:
    """Unpack what Debian and PyPI have for aarch64."""
    apt = _apt_of_arm(debs)
    _run([*apt, "update"])
    _run([*apt, "download", *DEBIAN], cwd=debs)
    for package in debs.glob("*.deb"):
        _run(["dpkg-deb", "-x", str(package), str(root)])
    if shutil.which(EMULATOR) is None:
        own = root.parent / "own"
        own.mkdir()
        _run(["apt-get", "-q", "download", "qemu-user-static"], cwd=own)
        _run(["dpkg-deb", "-x", str(next(own.glob("*.deb"))), str(own)])
    wheels = root.parent / "wheels"
    chosen = [word for name in PLATFORMS for word in ("--platform", name)]
    pip = [sys.executable, "-m", "pip", "download", "-q", "--only-binary", ":all:", *chosen]
    pinned = ["-c", str(REPOSITORY / "constraints.txt"), "-d", str(wheels)]
    _run([*pip, "--python-version", "3.11", *pinned, *PYPI])
    for wheel in wheels.glob("*.whl"):
        zipfile.ZipFile(wheel).extractall(site)


def _apt_of_arm(debs: Path) -> list[str]:
    """apt-get that looks for packages of aarch64, with lists and caches of its own."""
    for name in ("lists/partial", "cache/archives/partial"):
        (debs / name).mkdir(parents=True)
    (debs / "status").touch()
    settings = {
        "Dir::State": debs,
        "Dir::State::lists": debs / "lists",
        "Dir::State::status": debs / "status",
        "Dir::Cache": debs / "cache",
        "APT::Architecture": "arm64",
        "APT::Architectures": "arm64",
    }
    return ["apt-get", "-q", *(word for k, v in settings.items() for word in ("-o", f"{k}={v}"))]


def _run(command: list[str], cwd: Path | None = None) -> None:
    try:
        done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    except OSError as problem:
        raise AbsentError(f"{command[0]} cannot be run: {problem}") from problem
    if done.returncode:
        raise AbsentError(f"{' '.join(command[:3])}...: {done.stderr.strip()[-300:]}")
