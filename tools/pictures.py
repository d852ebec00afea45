"""The pictures of the documentation, drawn by clearway itself: `python -m tools.pictures`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

REPOSITORY = Path(__file__).resolve().parent.parent
IMAGES = REPOSITORY / "docs" / "images"
STREET = REPOSITORY / "examples" / "scenes" / "street.toml"
RULES = REPOSITORY / "examples" / "missions" / "rules.toml"
PICTURES = {
    "snapshot.png": (("fly", "static-obstacles"), "snapshot-2.png"),
    "assessment.png": (("assess", str(STREET)), "reachability.png"),
    "rules.png": (("fly", str(RULES)), "traffic.png"),
}
"""Name in the documentation: the command that draws it, and what it calls it."""
COLOURS = 192


def draw(command: tuple[str, ...], drawn: str, target: Path) -> None:
    """Run a command and keep one of its pictures, with few colours for its size."""
    code = "from clearway.cli.app import main; main()"
    with TemporaryDirectory() as folder:
        arguments = [sys.executable, "-c", code, *command, "--out", folder]
        subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)
        with Image.open(Path(folder) / drawn) as picture:
            picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(
                target, optimize=True
            )


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    for name, (command, drawn) in PICTURES.items():
        draw(command, drawn, IMAGES / name)
        print(f"{IMAGES / name}: {(IMAGES / name).stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
