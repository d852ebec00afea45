"""Which aircraft of a recording is the own one."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from clearway.base.errors import InputError
from clearway.traffic.recorded import Aircraft, TrafficRecording

MOST_NAMED = 8


def find_own_aircraft(
    aircraft: Sequence[Aircraft], own: str | None, recording: TrafficRecording | None = None
) -> Aircraft:
    """The aircraft of an address or callsign; without one, that of the recording's own address.

    Raises InputError, with what to type, where there is none or several have that callsign.
    """
    named = own if own is not None or recording is None else recording.own_address
    source = "own aircraft" if recording is None else recording.source
    if named is None:
        raise InputError(
            source, f"the recording names no own aircraft; type --own and one of: {_some(aircraft)}"
        )
    wanted = named.strip().lower()
    mine = [one for one in aircraft if one.address.lower() == wanted]
    mine = mine or [one for one in aircraft if wanted and one.callsign.lower() == wanted]
    if len(mine) == 1:
        return mine[0]
    if mine:
        raise InputError(
            source,
            f"own aircraft {named!r}: {len(mine)} aircraft have that name; type --own and one of: "
            f"{_some(mine)}",
        )
    heard = recording is not None and wanted in {name.lower() for name in recording.heard}
    what = "is heard, but reports no position" if heard else "is not in the recording"
    names = {name.lower(): one for one in aircraft for name in (one.callsign, one.address)}
    close = [names[name] for name in difflib.get_close_matches(wanted, sorted(names), n=3)]
    near = f"; did you mean {_some(close)}?" if close else "."
    raise InputError(
        source, f"own aircraft {named!r} {what}{near} Type --own and one of: {_some(aircraft)}"
    )


def _some(aircraft: Sequence[Aircraft]) -> str:
    """Addresses, those that report most first, with their callsigns."""
    most = sorted(aircraft, key=lambda one: -len(one.time_s))[:MOST_NAMED]
    names = [
        f"{one.address} ({one.callsign})" if one.callsign not in ("", one.address) else one.address
        for one in most
    ]
    more = len(aircraft) - len(most)
    return (", ".join(names) or "none") + (f" ... and {more} more" if more else "")
