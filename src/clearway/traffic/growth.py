"""How far aircraft stray from straight flight: two kinds of flight, fitted on tracks.

An error of the place predicted straight on is normal with one of two deviations: of an aircraft
that flies on steadily, and of one that manoeuvres. The share of the second and both deviations grow
with the time ahead; they depend on whether it manoeuvres now, and level ones on its speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import freeze_array

HORIZONS_S = np.array([0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0])


@dataclass(frozen=True, slots=True, eq=False)
class TwoKinds:
    """Shares and deviations at the horizons."""

    share: FloatArray
    """[horizons] of those that manoeuvre, or will."""
    steady: FloatArray
    """[horizons] deviation per axis of the others."""
    manoeuvring: FloatArray
    """[horizons]"""

    def __post_init__(self) -> None:
        for name in self.__slots__:
            object.__setattr__(self, name, freeze_array(getattr(self, name), (len(HORIZONS_S),)))

    def at(self, ahead_s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Share, steady and manoeuvring deviation [n] at times ahead [n]; the last one from 90 s
        on grows in proportion to time."""
        beyond = np.maximum(ahead_s / HORIZONS_S[-1], 1.0)
        share, steady, manoeuvring = (
            np.interp(ahead_s, HORIZONS_S, values)
            for values in (self.share, self.steady, self.manoeuvring)
        )
        return share, steady * beyond, manoeuvring * beyond


@dataclass(frozen=True, slots=True, eq=False)
class Growth:
    """Of aircraft that fly straight now and of those that turn; level and climbing likewise."""

    straight: TwoKinds
    """Level, per m/s of speed: seconds."""
    turning: TwoKinds
    level: TwoKinds
    """Of the height, in metres."""
    climbing: TwoKinds

    def of(self, *, turns: bool, climbs: bool) -> tuple[TwoKinds, TwoKinds]:
        """Of the place per m/s, and of the height."""
        return (
            self.turning if turns else self.straight,
            self.climbing if climbs else self.level,
        )


def _kinds(
    share: tuple[float, ...], steady: tuple[float, ...], manoeuvring: tuple[float, ...]
) -> TwoKinds:
    return TwoKinds(np.array(share), np.array(steady), np.array(manoeuvring))


LIGHT_AIRCRAFT = Growth(
    straight=_kinds(
        (0.0, 0.3149, 0.3555, 0.4187, 0.4771, 0.5515, 0.6173, 0.7175),
        (0.0, 0.0003, 0.0014, 0.0060, 0.0135, 0.0290, 0.0474, 0.0890),
        (0.0, 0.0825, 0.3392, 1.788, 4.711, 11.686, 20.482, 38.257),
    ),
    turning=_kinds(
        (0.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5),
        (0.0, 0.697, 2.47, 8.20, 15.11, 25.0, 35.9, 60.0),
        (0.0, 0.697, 2.47, 8.20, 15.11, 25.0, 35.9, 60.0),
    ),
    level=_kinds(
        (0.0, 0.0390, 0.0788, 0.1560, 0.2222, 0.3131, 0.3897, 0.5171),
        (0.0, 0.0247, 0.0467, 0.0875, 0.1271, 0.1821, 0.2347, 0.3304),
        (0.0, 6.5, 16.517, 28.666, 42.554, 60.986, 77.931, 110.997),
    ),
    climbing=_kinds(
        (0.0, 0.3596, 0.5737, 0.8128, 0.9193, 1.0, 1.0, 1.0),
        (0.0, 0.0198, 0.0400, 0.0872, 0.1425, 77.1, 114.4, 190.5),
        (0.0, 6.534, 14.532, 30.781, 48.873, 77.1, 114.4, 190.5),
    ),
)
"""Of the encounter model of uncorrelated fixed-wing traffic (1200-code, v1.2), 8,000 tracks."""
