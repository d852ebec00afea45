"""Headers that the core is compiled with: Python's and numpy's, the same for 64-bit ARM."""

from __future__ import annotations

import re
import sysconfig
from dataclasses import dataclass
from pathlib import Path

from clearway_build.errors import BuildError

OWN = Path(__file__).parent / "include"


@dataclass(frozen=True)
class Headers:
    """Folders of headers, and the versions of what they describe."""

    folders: tuple[Path, ...]
    versions: str


def find_headers(made: Path) -> Headers:
    """Return the folders of headers; raises BuildError with what is absent and what to type.

    `made` is where headers go that have to be made.
    """
    python = Path(sysconfig.get_path("include"))
    version = sysconfig.get_python_version()
    if not (python / "Python.h").is_file():
        raise BuildError(
            f"{python / 'Python.h'} is absent: the headers of Python {version} are needed to build "
            f"clearway.\nType `sudo apt install python{version}-dev`."
        )
    try:
        import numpy as np
    except ImportError as cause:
        raise BuildError(
            f"numpy cannot be loaded, whose headers are needed: {cause}\nType `pip install numpy`."
        ) from cause
    if np.lib.NumpyVersion(np.__version__) < "2.0.0":
        raise BuildError(
            f"numpy {np.__version__}: its headers would make a core for that numpy alone.\n"
            "Type `pip install 'numpy>=2'`."
        )
    folders = (OWN, _by_machine(python, made), python, Path(np.get_include()))
    return Headers(folders, f"python {version} numpy {np.__version__}")


def _by_machine(python: Path, made: Path) -> Path:
    """Write the headers that Debian's pyconfig.h includes, one for each machine, to a folder.

    They stand outside of the folder of Python's headers, and there is one for this machine alone.
    What the stable interface takes from it is the same for all machines of 64 bits.
    """
    text = (python / "pyconfig.h").read_text(errors="replace")
    names = re.findall(r"include <(.+/pyconfig\.h)>", text)
    there = [python.parent / name for name in names if (python.parent / name).is_file()]
    for name in names if there else ():
        path = made / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f'#include "{there[0]}"\n')
    return made
