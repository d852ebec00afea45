"""Reach sets of all start pitches together, kept in the user's cache between runs.

A file holds parents and movements only; states, samples and cells are recomputed on loading, so
that what is loaded equals what was built bit for bit. It carries a version, the hash of what it
was built from and a checksum; whatever does not fit is rebuilt, never used.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path

import numpy as np

from clearway.base.brief import one_line
from clearway.base.cache_folder import cache_folder
from clearway.base.checks import LARGEST, kind_of, number_problem
from clearway.base.errors import ClearwayError, InputError
from clearway.base.grid import AvoidanceGrid
from clearway.base.kept_file import KeptKind, read_kept, write_kept
from clearway.base.lazily import Lazily
from clearway.reach.expand.lattice import APART_RAD, Lattice
from clearway.reach.expand.trace import trace_reach_set
from clearway.reach.sets import lattice_for, reach_set_at
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import MovementAutomaton

VERSION = 3
"""Raised whenever the file's layout or any selection of trajectories changes."""
KIND = KeptKind(b"clearway reach\n", VERSION)
SHIPPED = Path(__file__).parent / "shipped"
"""Libraries of the standard grids, which come with the package."""
_COUNT = struct.Struct("<I")

Progress = Callable[[int, int], None]
"""Called with how many reach sets are done, and how many there will be."""
Notice = Callable[[str], None]
"""Called with a sentence for the user."""


@dataclass(frozen=True, eq=False)
class ReachLibrary:
    """One reach set per start pitch of an automaton, ascending by pitch: (3.5), def. 2.

    Of an automaton that was measured, one per movement that may have been flown last.

    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=1.0)
    >>> library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform())
    >>> len(library.reach_sets), library.nearest(0.0).start_pitch_rad
    (5, 0.0)
    """

    automaton: MovementAutomaton
    grid: AvoidanceGrid
    _: KW_ONLY
    method: str
    reach_sets: Sequence[ReachSet]

    def __repr__(self) -> str:
        sets = f"{len(self.reach_sets)} reach sets"
        if isinstance(self.reach_sets, tuple):
            sets += f" of {sum(each.nodes for each in self.reach_sets):,} nodes"
        return one_line("ReachLibrary", (self.method, sets, f"to {self.grid.range_m:g} m"))

    @classmethod
    def build(
        cls,
        automaton: MovementAutomaton,
        grid: AvoidanceGrid,
        *,
        method: str = "flying",
        tuning: Mapping[str, float] | None = None,
        progress: Progress | None = None,
    ) -> ReachLibrary:
        """Build all reach sets of a vehicle anew.

        Parameters
        ----------
        automaton
            What the vehicle can do.
        grid
            Cells in the body frame of the start.
        method
            As `build_reach_set` takes it.
        tuning
            As `build_reach_set` takes it; None for the defaults.
        progress
            Called with what is done and what there is to do.

        Returns
        -------
        ReachLibrary
            One reach set per start pitch, or per class of motion.

        Raises
        ------
        ClearwayError
            As `build_reach_set` does.
        """
        tuning = _check(automaton, grid, tuning)
        reach_sets: tuple[ReachSet, ...] = ()
        every = lattice_for(automaton, grid, automaton.start_pitches_rad, tuning)
        for lattice in _root(every):
            reach_sets += _build(lattice, grid, method, tuning, progress or _silent)
        return cls(automaton, grid, method=method, reach_sets=_tell_apart(reach_sets, automaton))

    @classmethod
    def load_or_build(
        cls,
        automaton: MovementAutomaton,
        grid: AvoidanceGrid,
        *,
        method: str = "flying",
        tuning: Mapping[str, float] | None = None,
        progress: Progress | None = None,
        notice: Notice | None = None,
        folder: Path | None = None,
    ) -> ReachLibrary:
        """Load the reach sets of a vehicle from a cache; build and store what is not there.

        What ships with the package is not stored again. A file that is damaged or of another
        version is rebuilt. A folder that cannot be written only means building again the next time.

        Parameters
        ----------
        automaton
            What the vehicle can do.
        grid
            Cells in the body frame of the start.
        method
            As `build_reach_set` takes it.
        tuning
            As `build_reach_set` takes it; None for the defaults.
        progress
            Called with what is done and what there is to do.
        notice
            Called with a sentence about each file that is rebuilt or cannot be written.
        folder
            The cache; by default the user's.

        Returns
        -------
        ReachLibrary
            One reach set per start pitch, or per class of motion.

        Raises
        ------
        ClearwayError
            As `build_reach_set` does.
        """
        tuning, notice = _check(automaton, grid, tuning), notice or _ignore_notice
        found: list[ReachSet] = []
        every = lattice_for(automaton, grid, automaton.start_pitches_rad, tuning)
        for lattice in _root(every):
            key = hash_library(lattice, grid, method, tuning)
            name = f"reach-{key.hex()[:32]}.bin"
            place = folder or cache_folder()
            reach_sets = _load(SHIPPED / name, key, lattice, grid, notice)
            if reach_sets is None and place is not None:
                reach_sets = _load(place / name, key, lattice, grid, notice)
            if reach_sets is None:
                reach_sets = _build(lattice, grid, method, tuning, progress or _silent)
                if place is not None:
                    _store(place / name, key, reach_sets, notice)
            if automaton.has_inertia:  # One file has them all.
                return cls(automaton, grid, method=method, reach_sets=reach_sets)
            found += reach_sets
        told_apart = _tell_apart(tuple(found), automaton)
        return cls(automaton, grid, method=method, reach_sets=told_apart)

    def store(self, folder: Path) -> Path:
        """Write the library, built without tuning, into a folder.

        Parameters
        ----------
        folder
            Where to; the name of the file follows from the library.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            Where that cannot be done, and for an automaton that was measured.
        """
        if self.automaton.classes is not None:
            raise InputError(str(folder), "reach sets of a measured automaton are not shipped")
        lattice = lattice_for(self.automaton, self.grid, self.automaton.start_pitches_rad, {})
        key = hash_library(lattice, self.grid, self.method, {})
        path = folder / f"reach-{key.hex()[:32]}.bin"
        problems: list[str] = []
        _store(path, key, self.reach_sets, problems.append)
        if problems:
            raise InputError(str(folder), problems)
        return path

    def nearest(self, pitch_rad: float) -> ReachSet:
        """Return the reach set whose start pitch is nearest; the flatter one of two.

        Parameters
        ----------
        pitch_rad
            Nose down positive.

        Returns
        -------
        ReachSet
            One of the library.

        Raises
        ------
        ClearwayError
            For what is no angle.
        """
        if problem := number_problem("pitch_rad", pitch_rad, -LARGEST):
            raise ClearwayError(problem)
        return min(
            self.reach_sets,
            key=lambda s: (abs(s.start_pitch_rad - pitch_rad), abs(s.start_pitch_rad)),
        )


def _check(
    automaton: MovementAutomaton, grid: AvoidanceGrid, tuning: Mapping[str, float] | None
) -> Mapping[str, float]:
    """The tuning, none where none is given; ClearwayError for what no library is made of."""
    kind_of("reach library: automaton", automaton, MovementAutomaton)
    kind_of("reach library: grid", grid, AvoidanceGrid)
    return {} if tuning is None else kind_of("reach library: tuning", tuning, dict)


def hash_library(
    lattice: Lattice, grid: AvoidanceGrid, method: str, tuning: Mapping[str, float]
) -> bytes:
    """Hash of all that a library follows from.

    The automaton counts by what its movements do, so that any vehicle is covered; rounded, so
    that machines whose sine differs in the last digit share a file, and lengths in thicknesses of
    a layer, since a file holds no lengths.
    """
    digest = hashlib.sha256(repr((method, sorted(tuning.items()))).encode())
    movements = [(m.name, m.smooth, m.duration_s) for m in lattice.automaton.movements]
    digest.update(repr((movements, lattice.mirror)).encode())
    pieces = lattice.pieces
    digest.update(repr(pieces.path.shape).encode())
    digest.update(np.ascontiguousarray(pieces.following).tobytes())
    lengths = (pieces.path, grid.range_edges_m)
    angles = (
        pieces.turn_rad,
        pieces.attitude_rad,
        grid.azimuth_edges_rad,
        grid.elevation_edges_rad,
    )
    for array in (*(each / grid.layer_m for each in lengths), *angles):
        digest.update((np.round(array, 9) + 0.0).tobytes())
    digest.update(np.round(sorted(lattice.start), 9).tobytes())
    if lattice.automaton.classes is not None:
        digest.update(repr(sorted(lattice.start.values())).encode())
    return digest.digest()


def _build(
    lattice: Lattice,
    grid: AvoidanceGrid,
    method: str,
    tuning: Mapping[str, float],
    progress: Progress,
) -> tuple[ReachSet, ...]:
    pitches = sorted(lattice.start)
    reach_sets = []
    for done, pitch in enumerate(pitches):
        progress(done, len(pitches))
        reach_sets.append(reach_set_at(lattice, grid, method, pitch, **tuning))
    progress(len(pitches), len(pitches))
    return tuple(reach_sets)


def _root(lattice: Lattice) -> tuple[Lattice, ...]:
    """The same lattice, begun after each movement of an automaton that was measured."""
    classes = lattice.automaton.classes
    if classes is None or classes.has_speeds:
        return (lattice,)
    labels = lattice.pieces.attitude_rad[:, 0]
    numbers = range(len(classes.classes))
    at = [int(np.argmin(np.abs(labels - classes.label_of(n)))) for n in numbers]
    return tuple(replace(lattice, start=dict.fromkeys(lattice.start, n)) for n in at)


def _tell_apart(
    reach_sets: tuple[ReachSet, ...], automaton: MovementAutomaton
) -> tuple[ReachSet, ...]:
    """Those of a measured automaton all begin level: by so little pitch that it matters to nothing
    else, a store by start pitch tells them apart."""
    if automaton.classes is None or automaton.has_inertia:
        return reach_sets
    return tuple(replace(one, start_pitch_rad=n * APART_RAD) for n, one in enumerate(reach_sets))


def _store(path: Path, key: bytes, reach_sets: Sequence[ReachSet], notice: Notice) -> None:
    payload = b"".join(
        _COUNT.pack(each.nodes) + each.parent.tobytes() + each.movement.tobytes()
        for each in reach_sets
    )
    try:
        write_kept(path, KIND, key, payload)
    except OSError as cause:
        notice(f"reach sets cannot be stored in {path.parent}: {cause.strerror}")


def _load(
    path: Path, key: bytes, lattice: Lattice, grid: AvoidanceGrid, notice: Notice
) -> Sequence[ReachSet] | None:
    """Reach sets of a file; None, with a notice where there is a file that does not fit."""
    try:
        return _parse(read_kept(path, KIND, key), lattice, grid)
    except OSError:
        return None
    except ClearwayError as cause:
        notice(f"{path} {cause}; building the reach sets anew")
        return None


def _parse(payload: bytes, lattice: Lattice, grid: AvoidanceGrid) -> Sequence[ReachSet]:
    """Of a vehicle with inertia, each set is traced when it is first asked for."""
    trees, at = [], 0
    pitches = sorted(lattice.start)
    for _ in pitches:
        (nodes,) = _COUNT.unpack_from(payload, at)
        at += _COUNT.size
        parent = np.frombuffer(payload, dtype="<i4", count=nodes, offset=at).astype(np.int32)
        at += 4 * nodes
        movement = np.frombuffer(payload, dtype="<i2", count=nodes, offset=at).astype(np.int16)
        at += 2 * nodes
        trees.append((parent, movement))

    def trace(number: int) -> ReachSet:
        return trace_reach_set(*trees[number], grid, lattice, pitches[number])

    if lattice.automaton.has_inertia:
        return Lazily(len(trees), trace)
    return tuple(trace(number) for number in range(len(trees)))


def _silent(_done: int, _total: int) -> None:
    """No progress is shown."""


def _ignore_notice(_sentence: str) -> None:
    """No notice is taken."""
