"""Options of all commands on a MAVLink link."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Act = Annotated[
    bool,
    typer.Option("--act", help="Send set-points and reasons; else only our heartbeat is sent."),
]
Rate = Annotated[
    float, typer.Option(min=1.0, max=100.0, help="Ticks a second, by the vehicle's clock.")
]
SigningKey = Annotated[
    Path | None,
    typer.Option(help="File of 32 bytes or 64 hex digits: frames not signed with it are refused."),
]
System = Annotated[int, typer.Option(min=1, max=255, help="The vehicle's system id.")]
Component = Annotated[int, typer.Option(min=1, max=255, help="The autopilot's id.")]
Icao = Annotated[str | None, typer.Option(help="Our transponder's address, six hex digits.")]
TrafficMargin = Annotated[
    float,
    typer.Option(min=0.0, help="Distance kept from aircraft, beyond margin and half their span."),
]
Fan = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=60.0,
        help="How far up and down the sensor looks, of which 15 are left for tilt; 0: level.",
    ),
]
Heartbeat = Annotated[
    float, typer.Option(min=0.5, help="The link counts as lost after so long without a heartbeat.")
]
Hand = Annotated[
    bool,
    typer.Option(
        "--hand/--no-hand",
        help="With --act: a second process flies the escape to its end if this one dies or stalls.",
    ),
]
LockStep = Annotated[
    bool, typer.Option("--lock-step", help="A simulated vehicle waits for our set-points.")
]
