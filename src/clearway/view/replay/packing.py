"""A recording as the page takes it: a JSON head and arrays of few bits, deflated.

Layout before deflating: the length of the head in 4 bytes (little-endian), the head, and the blocks
that its `blocks` names by type, shape and place; each begins at a multiple of 4 bytes after it.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.base.frames import FloatArray
from clearway.view.replay.reading import Recording, ReplayMessage
from clearway.view.replay.schemas import CELL_FLAGS, CELL_QUANTITIES, RATING

STATE_STEP_S = 0.2
"""States closer together than this are left out; the page interpolates."""
FLAT = ("path_m", "way_out_m")
"""What of a decision the page takes in another form."""
TOGETHER = 64
"""Decisions whose points are looked at together: those of an hour would fill the memory."""
MOST_SEEN = 400_000
"""Seen voxels that a page keeps; beyond it every other one is left out, and so on."""

Array = npt.NDArray[Any]
TYPES = {"float32": "f4", "uint8": "u1", "uint16": "u2", "int32": "i4"}


def pack(recording: Recording) -> bytes:
    """The deflated payload of a page."""
    blocks: dict[str, Array] = {}
    head: dict[str, Any] = {
        "mission": recording.mission,
        "quantities": _quantities(recording),
        "movement_names": [one["movement_names"] for one in recording.reach_sets],
        "flags": list(CELL_FLAGS),
    }
    _pack_states(recording, blocks)
    _pack_cells(recording, blocks)
    _pack_reach(recording, blocks)
    head["intruders"] = _pack_intruders(recording, blocks)
    head["seen"] = _pack_seen(recording, blocks)
    head["surveyed"] = _pack_points("surveyed", recording.surveyed_m, blocks)
    # As text one by one: as objects those of an hour take a hundred megabytes.
    decisions = ",".join(_text(_decision(one)) for one in recording.decisions)
    return zlib.compress(_join(head, decisions, blocks), level=9)


def _text(value: dict[str, Any]) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _join(head: dict[str, Any], decisions: str, blocks: dict[str, Array]) -> bytes:
    body = bytearray()
    places: dict[str, Any] = {}
    for name, array in blocks.items():
        places[name] = {"type": array.dtype.name, "shape": list(array.shape), "at": len(body)}
        body += np.ascontiguousarray(array).astype(f"<{TYPES[array.dtype.name]}").tobytes()
        body += b"\0" * (-len(body) % 4)
    rest = _text(head | {"blocks": places})
    text = f'{rest[:-1]},"decisions":[{decisions}]}}'.encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<I", len(text)) + text + bytes(body)


def _decision(message: ReplayMessage) -> ReplayMessage:
    """What the panel tells of a decision; paths are flat, for there are many."""
    told = {name: value for name, value in message.items() if name not in FLAT}
    told["path_mm"] = _millimetres(message.get("path_m", []))
    told["way_out_mm"] = _millimetres(message.get("way_out_m", []))
    return told


def _millimetres(points: Any) -> list[int]:
    values = np.rint(np.array(points, dtype=np.float64).reshape(-1, 3) * 1e3)
    return [int(value) for value in values.ravel()]


def _pack_states(recording: Recording, blocks: dict[str, Array]) -> None:
    """States about every 0.2 s, the first and last among them."""
    time_s = np.array([one["time_s"] for one in recording.states])
    step = np.floor((time_s - time_s[0]) / STATE_STEP_S + 1e-6)
    keep = np.append(np.flatnonzero(np.diff(step, prepend=-1.0)), len(time_s) - 1)
    states = [recording.states[at] for at in np.unique(keep)]
    blocks["state_s"] = np.array([one["time_s"] for one in states], dtype=np.float32)
    blocks["state"] = np.array(
        [[*one["position_m"], *one["attitude_rad"]] for one in states], dtype=np.float32
    )
    nothing = np.float32(np.finfo(np.float32).max)
    blocks["distance"] = np.array(
        [
            [
                nothing if one[name] is None else one[name]
                for name in ("obstacle_distance_m", "intruder_distance_m")
            ]
            for one in states
        ],
        dtype=np.float32,
    )


def _pack_cells(recording: Recording, blocks: dict[str, Array]) -> None:
    """[decisions, quantities, cells] in 255ths, and flags as bits of one byte."""
    if not recording.cells:
        return
    quantities = _quantities(recording)
    blocks["cells"] = np.array(
        [[_shares(one[name]) for name in quantities] for one in recording.cells]
    )
    flags = [
        sum(np.array(one[name], dtype=np.uint8) << bit for bit, name in enumerate(CELL_FLAGS))
        for one in recording.cells
    ]
    blocks["flags"] = np.array(flags, dtype=np.uint8)


def _quantities(recording: Recording) -> list[str]:
    """What the run tells of cells; a rating may be the user's own.

    In the order of the page's choice, ratings together.
    """
    if not recording.cells:
        return []
    ratings = [name for name in recording.cells[0] if name.startswith(RATING)]
    rest = [name for name in CELL_QUANTITIES if not name.startswith(RATING)]
    return [*rest[:3], *ratings, *rest[3:]]


def _shares(values: Any) -> npt.NDArray[np.uint8]:
    return np.rint(255.0 * np.clip(np.array(values, dtype=np.float64), 0.0, 1.0)).astype(np.uint8)


def _pack_reach(recording: Recording, blocks: dict[str, Array]) -> None:
    """Reach sets once, the ratings of their nodes decision after decision."""
    pitches = [one["start_pitch_rad"] for one in recording.reach_sets]
    for number, one in enumerate(recording.reach_sets):
        nodes = len(one["parent"])
        blocks[f"parent{number}"] = np.array(one["parent"], dtype=np.int32)
        blocks[f"movement{number}"] = np.array(one["movement"], dtype=np.uint16)
        blocks[f"complete{number}"] = np.array(one["complete"], dtype=np.uint8)
        blocks[f"samples{number}"] = (
            np.array(one["samples_mm"], dtype=np.float32).reshape(nodes, one["samples"], 3) / 1e3
        )
    if recording.reach:
        rated = [
            (pitches.index(one["start_pitch_rad"]), one["chosen"], _shares(one["rating"]))
            for one in recording.reach
        ]
        blocks["reach_of"] = np.array([chosen for *chosen, _ in rated], dtype=np.int32)
        counts = [len(shares) for *_, shares in rated]
        blocks["node_start"] = np.array([0, *np.cumsum(counts)], dtype=np.int32)
        blocks["node_rating"] = np.concatenate([shares for *_, shares in rated])


def _pack_intruders(recording: Recording, blocks: dict[str, Array]) -> list[ReplayMessage]:
    """[n, 7] time, place and velocity of each; what the page must know of them."""
    tracks: dict[str, list[list[float]]] = {}
    for message in recording.intruders:
        for one in message["intruders"]:
            row = [message["time_s"], *one["position_m"], *one["velocity_mps"]]
            tracks.setdefault(one["name"], []).append(row)
    radii = recording.mission["intruder_radius_m"]
    told = []
    for number, (name, track) in enumerate(tracks.items()):
        blocks[f"intruder{number}"] = np.array(track, dtype=np.float32)
        told.append({"name": name, "radius_m": radii.get(name)})
    return told


def _pack_seen(recording: Recording, blocks: dict[str, Array]) -> ReplayMessage | None:
    """Each voxel that was ever seen, with the first and last decision that reckoned with it."""
    voxel = recording.mission["voxel_m"]

    def index(points_m: FloatArray) -> npt.NDArray[np.int64]:
        return np.asarray(np.floor(points_m / voxel), dtype=np.int64)

    ends = [np.stack([i.min(axis=0), i.max(axis=0)]) for i in map(index, _fill(recording))]
    if not ends:
        return None
    low = np.min(ends, axis=(0, 1))
    shape = tuple(np.max(ends, axis=(0, 1)) - low + 1)
    places, first, last = (np.zeros(0, dtype=np.int64) for _ in range(3))
    for begin in range(0, len(recording.points_m), TOGETHER):
        clouds = recording.points_m[begin : begin + TOGETHER]
        decision = np.repeat(np.arange(len(clouds)) + begin, [len(cloud) for cloud in clouds])
        flat = np.ravel_multi_index(tuple((index(np.concatenate(clouds)) - low).T), shape)
        both, inverse = np.unique(np.concatenate([places, flat]), return_inverse=True)
        since, until = np.full(len(both), len(recording.points_m)), np.full(len(both), -1)
        np.minimum.at(since, inverse, np.concatenate([first, decision]))
        np.maximum.at(until, inverse, np.concatenate([last, decision]))
        places, first, last = both, since, until
    thin = slice(None, None, -(-len(places) // MOST_SEEN))
    order = np.argsort(first[thin], kind="stable")
    points = (np.stack(np.unravel_index(places[thin][order], shape), axis=1) + low + 0.5) * voxel
    blocks["seen_span"] = np.stack([first[thin][order], last[thin][order]], axis=1).astype(
        np.uint16
    )
    return _pack_points("seen", points, blocks)


def _fill(recording: Recording) -> Iterator[FloatArray]:
    return (cloud for cloud in recording.points_m if len(cloud))


def _pack_points(name: str, points_m: FloatArray, blocks: dict[str, Array]) -> ReplayMessage | None:
    """Points [n, 3] in 16 bits an axis; None without any. place = origin + step * value."""
    if not len(points_m):
        return None
    origin = points_m.min(axis=0)
    step = max(float((points_m - origin).max()) / 65_535.0, 1e-3)
    blocks[name] = np.rint((points_m - origin) / step).astype(np.uint16)
    return {"origin_m": np.round(origin, 6).tolist(), "step_m": step}
