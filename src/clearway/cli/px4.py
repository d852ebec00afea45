"""`clearway px4`: a mission, or a guardian, as one of PX4's own flight modes."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated, Any

import typer

from clearway.cli import mavlink_options, ros2_bus
from clearway.cli.guard_words import GuardWatch, describe_guard, describe_link, summarize_guard
from clearway.cli.live_ends import stop_rule
from clearway.cli.report import NOT_REACHED, add_sources, leave, print_json, say
from clearway.cli.ros2 import NodeWatch, describe_node, summarize_node
from clearway.cli.ros2_bus import BUS_CHECK_S, BusOptions, refuse_unusable


def px4(
    parameters: Annotated[Path, typer.Argument(help="The node's parameters (YAML of ROS 2).")],
    guard: Annotated[
        bool, typer.Option("--guard", help="Let somebody's commands pass, in place of a mission.")
    ] = False,
    check: ros2_bus.Check = False,
    backend: ros2_bus.Backend = "auto",
    domain: ros2_bus.Domain = None,
    namespace: ros2_bus.Namespace = "",
    remap: ros2_bus.Remap = None,
    duration: Annotated[
        float | None, typer.Option(min=0.0, help="End after so many seconds; default: Ctrl-C.")
    ] = None,
    end_on_arrival: Annotated[
        bool, typer.Option("--end-on-arrival", help="End at the last goal instead of holding it.")
    ] = False,
    hand: mavlink_options.Hand = True,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Fly PX4 as one of its flight modes, without ROS: registers only with `act: true`."""
    from clearway.px4.hand import ModeEncoding
    from clearway.px4.setup import set_up_px4, set_up_px4_guard
    from clearway.ros2.hand import begin_ros2_hand
    from clearway.ros2.parameter_file import read_parameters
    from clearway.ros2.parameters import Names

    refuse_unusable(backend, None)
    given = read_parameters(parameters, namespace=namespace)
    changed: dict[str, object] = {"act": False} if check else {}
    if guard and "rate" not in given.model_fields_set:
        changed["rate"] = 20.0
    given = given.model_copy(update=changed)

    open_bus = BusOptions(None, backend, domain, namespace).open
    set_up: Any = set_up_px4_guard if guard else set_up_px4
    loop, link = set_up(given, Names(namespace, remap=remap or ()), open_bus, say)
    watch = GuardWatch() if guard else NodeWatch()
    with closing(link):
        begin_ros2_hand(loop, ModeEncoding(link), wanted=hand, notice=say)
        lasts = BUS_CHECK_S if check else duration
        with stop_rule(lasts, arrival=end_on_arrival) as stop:
            report = loop.run(stop, watch.show)
        missing, is_over = link.missing(), link.is_forgotten or link.is_relieved
        if guard:
            result = summarize_guard(link.session, report) | describe_link(link)
            words = describe_guard(result)
        else:
            result = summarize_node(link, report)
            words = describe_node(result, link)
    px4_side = {"release": link.release.name, "activations": link.activations}
    if as_json:
        print_json(add_sources(result | {"px4": px4_side, "missing": missing}))
    else:
        print(f"{words}\nPX4        {px4_side['release']}; flew the mode {link.activations} times")
        if check:
            print("\n".join(["missing:", *missing]) if missing else "all is there")
    done = result["wishes"] if guard else result["reached"] or not end_on_arrival
    if missing if check else is_over or (given.act and not (done and link.activations)):
        leave(NOT_REACHED)
