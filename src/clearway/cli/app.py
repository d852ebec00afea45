"""The command line: all commands, and their groups in `clearway --help`.

Only typer is imported here and at the head of the command modules, so that `--help` answers at
once; each command imports what it needs when it runs.
"""

from __future__ import annotations

import atexit
import gc
import sys
from collections.abc import Callable
from copy import copy
from typing import Annotated

import typer

from clearway.base.provenance import began_as
from clearway.base.version import __version__
from clearway.cli.alerts import alerts
from clearway.cli.assess import assess
from clearway.cli.automaton import measure, show
from clearway.cli.campaign import campaign
from clearway.cli.choices import Command, Group
from clearway.cli.compare import compare
from clearway.cli.data import data
from clearway.cli.encounters import encounters
from clearway.cli.faults import faults
from clearway.cli.fly import fly
from clearway.cli.guard import guard
from clearway.cli.interrupts import end_soon_on_interrupt
from clearway.cli.map import show_map
from clearway.cli.mavlink import mavlink
from clearway.cli.pursuit import pursuit
from clearway.cli.px4 import px4
from clearway.cli.reach_compare import compare_reach_methods as compare_reach_sets
from clearway.cli.reach_set import reach_set
from clearway.cli.replay import replay
from clearway.cli.report import run_guarded, run_program
from clearway.cli.reproduce import reproduce
from clearway.cli.risk import risk
from clearway.cli.ros2 import ros2
from clearway.cli.sample import sample
from clearway.cli.traffic import traffic
from clearway.cli.why import why

COUNTING = ("velodyne_decoder", "ouster.sdk")
"""Modules made with nanobind, which tells on standard error what of theirs is left at the end."""

app = typer.Typer(
    name="clearway",
    help="Detect and avoid for unmanned aircraft: see, rate, decide, fly.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
FLY = "Fly in simulation"
SEE = "Look at data"
LIVE = "Fly a vehicle"
STUDY = "Study"
MODEL = "Model a vehicle"
FILES = "Files to try"
COMMANDS: tuple[tuple[str, dict[str, Callable[..., None]]], ...] = (
    (FLY, {"fly": fly, "compare": compare, "campaign": campaign, "replay": replay, "why": why}),
    (SEE, {"assess": assess, "map": show_map, "traffic": traffic, "alerts": alerts}),
    (LIVE, {"mavlink": mavlink, "px4": px4, "ros2": ros2, "guard": guard}),
    (
        STUDY,
        {
            "encounters": encounters,
            "risk": risk,
            "pursuit": pursuit,
            "faults": faults,
            "reproduce": reproduce,
        },
    ),
    (FILES, {"sample": sample, "data": data}),
)
"""Groups of `clearway --help`, in order, with their commands."""
for panel, commands in COMMANDS:
    for name, command in commands.items():
        app.command(name, cls=Command, rich_help_panel=panel)(run_guarded(command))
reach_sets = typer.Typer(add_completion=False, cls=Group)
reach_sets.callback(invoke_without_command=True)(run_guarded(reach_set))
reach_sets.command("compare", cls=Command)(run_guarded(compare_reach_sets))
app.add_typer(reach_sets, name="reach-set", rich_help_panel=MODEL)
automata = typer.Typer(
    add_completion=False, cls=Group, help="Measure the movements of a plant, and show them."
)
automata.command("measure", cls=Command)(run_guarded(measure))
automata.command("show", cls=Command)(run_guarded(show))
app.add_typer(automata, name="automaton", rich_help_panel=MODEL)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(__version__)
        raise typer.Exit


@app.callback()
def _options(
    _version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Detect and avoid for unmanned aircraft: see, rate, decide, fly."""


def main() -> None:
    """Entry point of the `clearway` command."""
    end_soon_on_interrupt()
    began_as(sys.argv[1:])
    atexit.register(_free_nothing)
    run_program(_only(next(iter(sys.argv[1:]), "")))


def _free_nothing() -> None:
    """Leave all as it is when all ends: to free it would take as long as a hundred decisions.

    What counts its own objects would complain of those that are still there.
    """
    if sys.modules.keys().isdisjoint(COUNTING):
        gc.freeze()


def _only(name: str) -> typer.Typer:
    """Of all commands, which take long to look through, the one that is asked for by its name; all
    of them where none has it."""
    only = copy(app)
    only.registered_commands = [one for one in app.registered_commands if one.name == name]
    only.registered_groups = [one for one in app.registered_groups if one.name == name]
    return only if only.registered_commands or only.registered_groups else app
