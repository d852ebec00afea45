"""HorizontalCAS's networks as a rival, where their files are given: planner `horizontalcas:DIR`.

Networks of Julian and Kochenderfer (2019, "Guaranteeing safety for neural network-based aircraft
collision avoidance systems"): one for each previous advisory and each time to the loss of vertical
separation. They score five advisories for turns, the highest score is flown, and they know nothing
of climbs. They were trained for two aircraft of 200 ft/s, and are flown as they are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from clearway.avoidance.long_range.rating import Other
from clearway.base.errors import InputError, naming
from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.units import FOOT_M

PREFIX = "horizontalcas:"
TURN_DEG_PER_S = (0.0, 1.5, -1.5, 3.0, -3.0)
"""Of the advisories clear of conflict, weak left, weak right, strong left, strong right."""
TAUS_S = (0, 5, 10, 15, 20, 30, 40, 60)
NAME = "HCAS_rect_v6_pra{advisory}_tau{tau:02d}_25HU_3000.nnet"
INPUTS = 3


@dataclass(frozen=True, eq=False)
class Network:
    """One network: inputs are clipped, scaled, and pass layers of rectified linear units."""

    low: FloatArray
    """[inputs] smallest, and largest values taken."""
    high: FloatArray
    mean: FloatArray
    """[inputs + 1] of the inputs and of the scores, and their ranges."""
    scale: FloatArray
    layers: tuple[tuple[FloatArray, FloatArray], ...]
    """Weights [out, in] and biases [out]."""

    def scores(self, inputs: FloatArray) -> FloatArray:
        """Return the score [outputs] of each advisory for inputs [inputs] in the file's units."""
        values = (np.clip(inputs, self.low, self.high) - self.mean[:-1]) / self.scale[:-1]
        *hidden, (weights, biases) = self.layers
        for matrix, offset in hidden:
            values = np.maximum(matrix @ values + offset, 0.0)
        out: FloatArray = (weights @ values + biases) * self.scale[-1] + self.mean[-1]
        return out


def read_network(path: Path) -> Network:
    """Read a `.nnet` file; raises InputError with the line that is wrong."""
    with naming(path, "read"):
        text = path.read_text(encoding="utf-8", errors="replace")
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.startswith("//")
    ]
    taken = iter(lines)

    def row(count: int | None = None) -> FloatArray:
        number, line = next(taken, (len(text.splitlines()) + 1, ""))
        try:
            values = np.array([float(part) for part in line.split(",") if part.strip()])
        except ValueError:
            values = np.zeros(0)
        wrong = not len(values) or not np.all(np.isfinite(values))
        if wrong or (count is not None and len(values) != count):
            needed = "numbers are" if count is None else f"{count} numbers are"
            raise InputError(str(path), f"line {number}: {needed} needed, got {line[:40]!r}")
        return values

    depth = int(row()[0])
    sizes = [int(size) for size in row(depth + 1)]
    row()  # A flag that nothing reads any more.
    low, high = row(sizes[0]), row(sizes[0])
    mean, scale = row(sizes[0] + 1), row(sizes[0] + 1)
    layers = []
    for inputs, outputs in pairwise(sizes):
        weights = np.stack([row(inputs) for _ in range(outputs)])
        layers.append((weights, np.concatenate([row(1) for _ in range(outputs)])))
    return Network(low, high, mean, scale, tuple(layers))


@lru_cache(maxsize=2)
def read_networks(folder: str) -> dict[tuple[int, int], Network]:
    """Read the networks of a folder by previous advisory and seconds; raises InputError."""
    found = {
        (advisory, tau): read_network(Path(folder) / NAME.format(advisory=advisory, tau=tau))
        for advisory in range(len(TURN_DEG_PER_S))
        for tau in TAUS_S
    }
    for (advisory, tau), network in found.items():
        if len(network.low) != INPUTS or len(network.layers[-1][1]) != len(TURN_DEG_PER_S):
            name = NAME.format(advisory=advisory, tau=tau)
            raise InputError(str(Path(folder) / name), "is no network of 3 inputs and 5 advisories")
    return found


def choose_advisory(
    networks: dict[tuple[int, int], Network],
    before: int,
    course_rad: float,
    apart_m: FloatArray,
    other_course_rad: float,
    tau_s: float,
) -> int:
    """Return the advisory with the highest score; clear of conflict beyond the last time.

    apart_m: [2] of the intruder from the ownship. tau_s: time to the loss of vertical separation.
    """
    if tau_s > TAUS_S[-1]:
        return 0
    tau = min(TAUS_S, key=lambda one: abs(one - tau_s))
    cos, sin = math.cos(course_rad), math.sin(course_rad)
    x = (cos * float(apart_m[0]) + sin * float(apart_m[1])) / FOOT_M
    y = (-sin * float(apart_m[0]) + cos * float(apart_m[1])) / FOOT_M
    psi = float(wrap_angle(other_course_rad - course_rad))
    return int(np.argmax(networks[before, tau].scores(np.array([x, y, psi]))))


def vertical_tau_s(other: Other, height_m: float, climb_mps: float, half_height_m: float) -> float:
    """Return the time until heights are within a half height; 0 inside, inf where they part."""
    off = float(other.position_m[2]) - height_m
    rush = float(other.velocity_mps[2]) - climb_mps
    gap = abs(off) - half_height_m
    if gap <= 0.0:
        return 0.0
    closing = -rush if off > 0.0 else rush
    return gap / closing if closing > 1e-6 else math.inf
