"""Films of flights as MP4, by ffmpeg, or as GIF, by pillow."""

from __future__ import annotations

import logging
import math
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clearway.base.errors import ClearwayError, InputError
from clearway.base.frames import FloatArray
from clearway.base.suggest import did_you_mean
from clearway.io.foreign_errors import damage_told
from clearway.view.film.scenes import Scenes
from clearway.view.replay.reading import Recording

if TYPE_CHECKING:
    from matplotlib.animation import AbstractMovieWriter

FASTEST_FPS = 60
LASTS_S = 20.0
"""A film lasts about so long, where nothing else is asked for; never slower than the flight."""
HOLDS_S = 1.5
"""How long the last moment stays."""


class MissingProgramError(ClearwayError):
    """What writes a film is no Python package, and absent; says what to install, or use instead."""


@dataclass(frozen=True, slots=True)
class FilmKind:
    """One format of films."""

    fps: int
    """Where nothing else is asked for."""
    dpi: int
    most: int
    """Frames; a GIF is held in memory until it is whole."""
    needs: str
    """What to install where its writer is not there."""


KINDS = {
    ".mp4": FilmKind(15, 133, 3_000, "ffmpeg (apt install ffmpeg, brew install ffmpeg)"),
    ".gif": FilmKind(10, 83, 300, "pillow (pip install pillow)"),
}
"""By suffix; 1276 x 718 and 796 x 448 pixels."""
WRITERS = {".mp4": "ffmpeg", ".gif": "pillow"}


@dataclass(frozen=True, slots=True)
class FilmAsked:
    """A film that is to be made."""

    path: Path
    fps: int
    speed: float | None
    """Seconds of flight in a second of film; None for what makes it last about 20 s."""

    @classmethod
    def check(cls, path: Path, fps: int | None, speed: float | None) -> FilmAsked:
        """Before any work: raises InputError for a suffix or number that cannot be, and
        MissingProgramError where what writes such films is not there."""
        kind = KINDS.get(path.suffix.lower())
        if kind is None:
            near = did_you_mean(path.suffix.lower(), KINDS)
            raise InputError(str(path), f"no kind of film{near}: there are {', '.join(KINDS)}")
        if fps is not None and not 1 <= fps <= FASTEST_FPS:
            raise InputError("--fps", f"{fps} is not within 1 to {FASTEST_FPS}")
        if speed is not None and not (math.isfinite(speed) and speed > 0.0):
            raise InputError("--speed", f"must be above 0, got {speed:g}")
        _writer_of(path)
        return cls(path, fps or kind.fps, speed)

    @property
    def kind(self) -> FilmKind:
        """By the suffix."""
        return KINDS[self.path.suffix.lower()]

    def times_s(self, begins_s: float, ends_s: float) -> tuple[FloatArray, float]:
        """Times of the frames, the last one held, and how fast the flight goes.

        Faster than asked for where it would take more frames than a film has.
        """
        held = round(HOLDS_S * self.fps)
        lasts_s = ends_s - begins_s
        speed = self.speed or max(1.0, lasts_s / LASTS_S)
        speed = max(speed, lasts_s * self.fps / (self.kind.most - held - 1))
        count = math.ceil(lasts_s / speed * self.fps - 1e-9) + 1
        moving = np.minimum(begins_s + np.arange(count) * speed / self.fps, ends_s)
        return np.concatenate([moving, np.full(held, ends_s)]), speed


def write_film(
    recording: Recording,
    asked: FilmAsked,
    folder: Path,
    progress: Callable[[int, int], None],
) -> float:
    """Draw a film into a folder, by the name asked for; seconds of flight in one of the film.

    progress: called with frames done and all frames. Raises InputError where it cannot be written.
    """
    from clearway.view.film.stage import Stage
    from clearway.view.plot.style import house_style

    with damage_told(recording.source, "run"):
        scenes = Scenes.of(recording)
    times, speed = asked.times_s(float(scenes.time_s[0]), float(scenes.time_s[-1]))
    with house_style(), _translate_errors(asked.path):
        stage = Stage(scenes)
        writer = _writer_of(asked.path)(fps=asked.fps)
        with writer.saving(stage.figure, str(folder / asked.path.name), asked.kind.dpi):
            for number, time_s in enumerate(times, start=1):
                stage.show(float(time_s))
                writer.grab_frame()
                progress(number, len(times))
    return speed


def _writer_of(path: Path) -> Callable[..., AbstractMovieWriter]:
    """Of matplotlib's; MissingProgramError where what it takes is not there."""
    from matplotlib.animation import writers

    suffix = path.suffix.lower()
    if not writers.is_available(WRITERS[suffix]):
        others = [name for name, writer in WRITERS.items() if writers.is_available(writer)]
        instead = f"; or name a {others[0]} file" if others else ""
        needed = KINDS[suffix].needs
        raise MissingProgramError(f"{path}: a {suffix} film needs {needed}{instead}")
    found: Callable[..., AbstractMovieWriter] = writers[WRITERS[suffix]]
    return found


@contextmanager
def _translate_errors(path: Path) -> Iterator[None]:
    """What a writer's program raises in the block, as InputError of the file."""
    log = logging.getLogger("matplotlib.animation")
    level = log.level
    log.setLevel(logging.ERROR)  # What the program said is told once, below.
    try:
        yield
    except subprocess.CalledProcessError as cause:
        said = cause.stderr or cause.stdout or ""
        lines = (said if isinstance(said, str) else said.decode(errors="replace")).split("\n")
        last = next((line for line in reversed(lines) if line.strip()), "")
        told = " ".join(last.split()) or f"it ended with status {cause.returncode}"
        raise InputError(str(path), f"ffmpeg could not write it: {told[:300]}") from cause
    except OSError as cause:
        raise InputError(str(path), f"cannot be written: {cause.strerror or cause}") from cause
    finally:
        log.setLevel(level)
