"""Ghosts: a radar's track (TIS-B) of an aircraft that also reports itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from clearway.base.units import FOOT_M
from clearway.traffic.recorded.aircraft import Aircraft
from clearway.traffic.recorded.proximity import proximity_pairs
from clearway.traffic.recorded.samples import sample_aircraft

GHOST_M = 1000.0
"""A radar's track lies this near to the aircraft that it is of."""
GHOST_HEIGHT_M = 300.0 * FOOT_M
GHOST_SHARE = 0.5
"""Of the seconds at which both are reported: in so many they must lie near each other."""
LEAST_S = 5
REPORT_THEMSELVES = ("adsb", "adsr", "flarm", "remote id", "scripted")
"""Sources of aircraft that are no radar's track, whatever their address."""


def ghosts_of(aircraft: Sequence[Aircraft]) -> Mapping[str, str]:
    """Address of the aircraft that it doubles, by address of the ghost."""
    samples = sample_aircraft(aircraft, slowest_mps=0.0)
    met = proximity_pairs(samples, GHOST_M)
    # Where a height is unknown the place has to do.
    near = ~(np.abs(met.height_m) > GHOST_HEIGHT_M)
    real = np.array([one.is_icao for one in aircraft], dtype=bool)
    pairs = np.column_stack([samples.aircraft[met.first], samples.aircraft[met.second]])[near]
    pairs = pairs[real[pairs[:, 0]] != real[pairs[:, 1]]]
    # Addresses that are not ICAO's begin with "~" and so come last: first real, second ghost.
    met_pairs, together = np.unique(pairs, axis=0, return_counts=True)
    seconds = [samples.second[samples.aircraft == at] for at in range(len(aircraft))]
    found: dict[str, str] = {}
    for at in np.argsort(-together, kind="stable"):
        one, other = met_pairs[at]
        both = len(np.intersect1d(seconds[one], seconds[other], assume_unique=True))
        if together[at] >= max(LEAST_S, GHOST_SHARE * both):
            found.setdefault(aircraft[other].address, aircraft[one].address)
    return found


def without_ghosts(aircraft: Sequence[Aircraft]) -> list[Aircraft]:
    """Aircraft that report themselves: what only a radar has seen is left out, double or not.

    A radar's tracks (TIS-B without an ICAO address) change their addresses, lag behind and mostly
    double an aircraft that reports itself.
    """
    return [one for one in aircraft if one.is_icao or one.source in REPORT_THEMSELVES]
