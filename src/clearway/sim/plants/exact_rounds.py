"""Measured ways made exact where they nearly stand or circle: these can be flown for ever."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from clearway.base.frames import FloatArray


def with_exact_rounds(
    paths: Mapping[tuple[str, str], FloatArray],
    spread_m: Mapping[tuple[str, str], float],
    level: Collection[str],
) -> dict[tuple[str, str], FloatArray]:
    """The same ways, those of a movement repeated made exact where they nearly stand or circle.

    What stays within its spread stands, also after something else that stands; a level turn over
    and over is one circle. So they can be flown for ever: what the measurement missed by is in the
    spread. level: names of the movements that are asked to keep their height; no other is made to,
    however much its climb spreads.
    """

    def stays(pair: tuple[str, str]) -> bool:
        if pair not in paths:
            return False
        return float(np.abs(paths[pair][:, :3]).max()) <= 3.0 * spread_m.get(pair, 0.0)

    stand = {name for name in level if stays((name, name))}
    exact = dict(paths)
    for (previous, name), path in paths.items():
        end, near = path[-1], 3.0 * spread_m.get((previous, name), 0.0)
        shares = np.arange(1, len(path) + 1)[:, None] / len(path)
        # Off by a hair at the tip of the grid, it would lead out of it through its side.
        if previous in stand and name in stand and stays((previous, name)):
            turned = end[3] if abs(end[3]) > 0.02 else 0.0
            exact[previous, name] = shares * np.array([0.0, 0.0, 0.0, turned])
        elif previous != name or name not in level:
            continue
        elif abs(end[3]) > 0.02 and abs(end[2]) <= max(near, 0.02 * float(np.hypot(*end[:2]))):
            angle = shares[:, 0] * end[3]
            chord = float(np.hypot(end[0], end[1]))
            heading = float(np.arctan2(end[1], end[0])) - 0.5 * end[3]
            radius = chord / (2.0 * np.sin(0.5 * end[3]))
            x = radius * (np.sin(heading + angle) - np.sin(heading))
            y = radius * (np.cos(heading) - np.cos(heading + angle))
            exact[previous, name] = np.stack([x, y, np.zeros(len(path)), angle], axis=1)
    return exact
