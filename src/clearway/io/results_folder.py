"""The folder of one command's results: looked at before any work, and of one run alone.

What was written there is listed in a small file beside it, so that the next run of the same thing
takes the place of the last one whole, and a run of something else is refused.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clearway.base.errors import InputError, naming, special_kind
from clearway.base.provenance import sha256_of
from clearway.base.version import SCHEMA_VERSION
from clearway.io.staging import leads_elsewhere, nearest_folder, stage_folder

LIST = ".clearway.json"
"""Beside the results: what they are of, and their names."""
LONGEST_NAME_BYTES = 255
"""Of a file or folder, on all usual file systems."""
MOST_LIST_BYTES = 10_000_000
"""Of a list: one of 100,000 files has half of that."""
TELLING = (
    "mission.toml",
    "scene.toml",
    "summary.json",
    "comparison.json",
    "encounter.json",
    "result.json",
    "risk.json",
    "traffic.json",
    "faults.json",
    "decisions.jsonl",
    "run.mcap",
    "results.parquet",
    "journal.jsonl",
)
"""Names that results have: where one of them stands without a list, it is not ours to replace."""


@dataclass(frozen=True, slots=True)
class ResultsFolder:
    """Where the results of one run go; `check` makes one."""

    path: Path
    command: str
    """The command whose results they are."""
    of: str
    """What it was run on: the name of a mission, of a scene."""
    before: tuple[str, ...] = ()
    """Files of the run whose place this one takes."""
    adds: bool = False
    """Whether earlier files of the same command stay: they have names of their own."""
    careful: bool = False
    """Whether nothing takes the place of files that another hand wrote or changed: its files are
    there to be edited."""
    list_then: str | None = None
    """What the list said when the folder was looked at; None where there was none."""

    @classmethod
    def check(
        cls,
        path: Path,
        command: str,
        of: str,
        *,
        adds: bool = False,
        own: Sequence[str] = (),
        careful: bool = False,
        option: str = "--out",
    ) -> ResultsFolder:
        """The folder, that is or can be made, can be written, and holds no results but such.

        own: names that need no list, of a command that looks after its files itself. option: how
        the command calls it.

        Raises InputError that names the folder and what to do. Nothing is left behind.
        """
        refuse_unwritable(path, option)
        listed, list_then = _read_list(path), _list_text(path)
        if listed is None:
            strange = [name for name in TELLING if name not in own and (path / name).exists()]
            if strange:
                raise InputError(
                    str(path),
                    f"{option}: {strange[0]} is there already, and no list ({LIST}) says that a "
                    "run wrote it; give another folder, or move that away",
                )
            return cls(path, command, of, (), adds, careful, list_then)
        told = f"{listed['command']} {listed['of']}".strip()
        if (listed["command"], listed["of"]) != (command, of):
            raise InputError(
                str(path),
                f"{option}: it holds the results of `clearway {told}`; give another folder for "
                f"those of `clearway {f'{command} {of}'.strip()}`, or remove it",
            )
        return cls(path, command, of, tuple(listed["files"]), adds, careful, list_then)

    def taking_more(self) -> ResultsFolder:
        """The same folder once this run has written into it, for what it adds later: pictures take
        long, and what ends them costs no result. Errors as of `check`."""
        return self.check(self.path, self.command, self.of, adds=True)

    @contextmanager
    def write(self) -> Iterator[Path]:
        """A scratch folder, whose files take the place of the run before when the block ends.

        Errors as of `stage_folder`; what the run before left stays then. InputError where it is
        careful and a file that is there is not as it was written, and where another run has
        written into the folder since it was looked at: results of two must not lie side by side.
        """
        files: list[str] = []
        with stage_folder(self.path) as scratch:
            yield scratch
            files += sorted(
                path.relative_to(scratch).as_posix()
                for path in scratch.rglob("*")
                if path.is_file()
            )
            before = self._list_left()
            kept = sorted({*before, *files}) if self.adds else files
            told: dict[str, Any] = {"command": self.command, "of": self.of, "files": kept}
            if self.careful:
                told["sha256"] = {name: sha256_of(scratch / name) for name in files}
                self._refuse_foreign(told["sha256"])
            text = json.dumps({"schema_version": SCHEMA_VERSION, **told}, indent=2)
            (scratch / LIST).write_text(text + "\n")
        if not self.adds:
            for name in set(before) - set(files):
                _remove(self.path, name)

    def _list_left(self) -> Sequence[str]:
        """The files of the run before, as they are listed now."""
        list_now = _list_text(self.path)
        if list_now is None or list_now == self.list_then:
            return self.before
        listed = _read_list(self.path)
        same = listed is not None and (listed["command"], listed["of"]) == (self.command, self.of)
        if listed is None or not (self.adds and same):
            raise InputError(
                str(self.path),
                "another run has written into it since this one began; give each its own folder",
            )
        files: Sequence[str] = listed["files"]
        return files

    def _refuse_foreign(self, fresh: Mapping[str, str | None]) -> None:
        told = (_read_list(self.path) or {}).get("sha256")
        written = told if isinstance(told, dict) else {}
        foreign = [
            name
            for name, content in fresh.items()
            if sha256_of(self.path / name) not in (None, content, written.get(name))
        ]
        if foreign:
            more = f" and {len(foreign) - 1} more" if len(foreign) > 1 else ""
            raise InputError(
                str(self.path),
                f"{foreign[0]}{more}: another hand wrote or changed what is there; give another "
                "folder, or move that away",
            )


def refuse_unwritable(path: Path, option: str = "--out") -> None:
    """Raise InputError unless a folder can be made there, or written into if it is there."""
    with naming(path, "written"):
        target = path.absolute()
        if target.exists() and not target.is_dir():
            kind = special_kind(target) or "a file"
            raise InputError(
                str(path), f"cannot be written: {option} is {kind}; a folder is needed"
            )
        # Asking for permission is no proof: read-only media, and users that may do everything.
        probe = tempfile.mkdtemp(prefix=".clearway-", suffix=".part", dir=nearest_folder(target))
        os.rmdir(probe)


def refuse_unwritable_file(path: Path, option: str) -> None:
    """Raise InputError unless a file can be written there."""
    kind = "a folder" if path.is_dir() else special_kind(path)
    if kind is not None:
        raise InputError(str(path), f"cannot be written: {option} is {kind}; a file is needed")
    refuse_unwritable(path.absolute().parent, option)


def _remove(folder: Path, name: str) -> None:
    """Remove a file of an earlier run, unless something else has its name now."""
    path = folder / name
    if leads_elsewhere(folder, name) is None and not path.is_symlink() and path.is_file():
        path.unlink(missing_ok=True)


def _list_text(folder: Path) -> str | None:
    path = folder / LIST
    try:
        if path.is_symlink() or not path.is_file() or path.stat().st_size > MOST_LIST_BYTES:
            return None
        return path.read_text()
    except (OSError, ValueError):
        return None


def _read_list(folder: Path) -> dict[str, Any] | None:
    """What the list of a folder says; None where there is none, or one that nobody can read."""
    text = _list_text(folder)
    try:
        listed: dict[str, Any] = json.loads(text or "")
        names = listed["files"]
        told = isinstance(names, list) and [listed["command"], listed["of"], *names]
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    if not told or not all(isinstance(one, str) for one in told):
        return None
    return listed if all(map(_is_inside, names)) else None


def _is_inside(name: str) -> bool:
    parts = Path(name).parts
    inside = bool(parts) and not Path(name).is_absolute() and ".." not in parts
    longest = max((len(part.encode("utf-8", "surrogatepass")) for part in parts), default=0)
    return inside and "\0" not in name and longest <= LONGEST_NAME_BYTES
