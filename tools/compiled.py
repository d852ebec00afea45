"""Compiled code to go into the wheel: `python -m tools.compiled`, before the wheel is built.

Made by the Python and the numba that run this, for the common set of instructions that is named in
`clearway.base.kernels.cache`; it is used only where sources, Python and numba are the same. Another
Python adds its own. Nothing of it is committed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from clearway.base.kernels.cache import LEVEL
from clearway.base.kernels.folders import SHIPPED


def make(folder: Path = SHIPPED) -> int:
    """Compile all there is and put it into a folder in place of what is stale there; returns how
    many files it then holds.

    The folder is set aside meanwhile: what would be found in it would not be compiled.
    """
    with tempfile.TemporaryDirectory() as scratch:
        before = Path(scratch) / "before"
        if folder.is_dir():
            shutil.move(folder, before)
        machine = {"NUMBA_CPU_NAME": LEVEL, "NUMBA_CPU_FEATURES": "", "CLEARWAY_CACHE": scratch}
        command = "from clearway.cli.app import main; main()"
        subprocess.run(
            [sys.executable, "-c", command, "warm-up"], env={**os.environ, **machine}, check=True
        )
        for place in (Path(scratch) / "compiled").iterdir():
            if place.is_dir():
                for source in (before / place.name, place):
                    if source.is_dir():
                        shutil.copytree(source, folder / place.name, dirs_exist_ok=True)
    return sum(1 for _ in folder.rglob("*.kernel"))


if __name__ == "__main__":
    print(f"{make()} loops compiled for {LEVEL} in {SHIPPED}")
