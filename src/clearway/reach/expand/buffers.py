"""Trajectories as movement buffers in bytes, and the tree of their prefixes.

A set of trajectories is a matrix [trajectories, movements], one byte per movement: its index + 1,
and 0 after the end. Nodes are the prefixes in lexicographic order, so that parents come first.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

ByteArray = npt.NDArray[np.uint8]


def nodes_of(buffers: ByteArray) -> ByteArray:
    """All prefixes of the buffers, each once, in lexicographic order (parents first)."""
    width = buffers.shape[1]
    prefixes = []
    for depth in range(1, width + 1):
        rows = buffers[buffers[:, depth - 1] > 0].copy()
        rows[:, depth:] = 0
        prefixes.append(np.unique(keys_of(rows)))
    keys = np.unique(np.concatenate(prefixes))
    return unpack_keys(keys, width)


def keys_of(buffers: ByteArray) -> npt.NDArray[np.bytes_]:
    """[n] byte strings that sort as the buffers do."""
    rows = np.ascontiguousarray(buffers)
    return rows.view(f"S{rows.shape[1]}").ravel()


def unpack_keys(keys: npt.NDArray[np.bytes_], width: int) -> ByteArray:
    """[n, width] buffers of their byte strings."""
    return np.ascontiguousarray(keys.astype(f"S{width}")).view(np.uint8).reshape(-1, width)


def parents_of(nodes: ByteArray) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int16]]:
    """Parent [n] (-1 below the root) and last movement [n] of sorted prefixes."""
    depth = np.count_nonzero(nodes, axis=1)
    last = (np.arange(len(nodes)), depth - 1)
    movement = nodes[last].astype(np.int16) - np.int16(1)
    shorter = nodes.copy()
    shorter[last] = 0
    parent = np.searchsorted(keys_of(nodes), keys_of(shorter)).astype(np.int32)
    parent[depth == 1] = -1
    return parent, movement


def mirror_buffers(buffers: ByteArray, mirror: tuple[int, ...]) -> ByteArray:
    """The same buffers flown with left and right exchanged."""
    image = np.zeros(len(mirror) + 1, dtype=np.uint8)
    image[1:] = np.array(mirror) + 1
    return image[buffers]


def images_within(buffers: ByteArray, mirror: tuple[int, ...] | None) -> npt.NDArray[np.int64]:
    """[n] where each buffer's mirror image lies among the sorted buffers; itself without one."""
    own = keys_of(buffers)
    places = np.arange(len(own))
    if mirror is None or not len(own):
        return places
    images = keys_of(mirror_buffers(buffers, mirror))
    found = np.minimum(np.searchsorted(own, images), len(own) - 1)
    return np.where(own[found] == images, found, places)
