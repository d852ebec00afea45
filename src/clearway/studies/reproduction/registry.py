"""All targets of `clearway reproduce`, in the paper's order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from clearway.base.errors import InputError
from clearway.base.suggest import did_you_mean
from clearway.studies.reproduction.chain_figure import chain_figure
from clearway.studies.reproduction.comparison_figures import comparison
from clearway.studies.reproduction.cone_figures import cone_figures, patch_figure
from clearway.studies.reproduction.decision_frame import frame_figure
from clearway.studies.reproduction.illustrations import illustrations
from clearway.studies.reproduction.intruder_figures import intruder_figures
from clearway.studies.reproduction.reach_set_figures import reach_set_figures
from clearway.studies.reproduction.scene_figures import map_figures, scan_figures, spaces_figure
from clearway.studies.reproduction.stability import lyapunov, prediction_ball
from clearway.studies.reproduction.static_figures import static_figures
from clearway.studies.reproduction.tables import (
    movement_tables,
    reach_set_table,
    reproduce_intruder_table,
)
from clearway.studies.reproduction.target import Target
from clearway.studies.reproduction.traffic_figures import traffic_figures
from clearway.studies.reproduction.visibility_figures import visibility_figures

ALL = "all"

TARGETS: Mapping[str, Target] = MappingProxyType(
    {
        target.name: target
        for target in (
            Target(
                "figures-2.1-2.2", "hits by distance; a map obstacle out of sight", scan_figures
            ),
            Target(
                "figures-2.3-2.4",
                "an intruder's spread; trajectories of different safety",
                illustrations,
            ),
            Target("definition-13", "predictions in bounded noise", prediction_ball),
            Target("section-3.4.2", "Lyapunov's function on the way to a waypoint", lyapunov),
            Target("figure-3.1", "spaces of a scan", spaces_figure),
            Target("figure-3.2", "surface of a patch of a ball", patch_figure),
            Target("tables-4.1-4.2", "what movements do", movement_tables),
            Target(
                "figures-4.1-4.3", "chaotic, harmonic and combined reach sets", reach_set_figures
            ),
            Target("figures-5.1-5.4", "the cone in which an intruder may be", cone_figures),
            Target("figures-5.5-5.8", "visibility behind hindrances in a row", visibility_figures),
            Target("figures-5.9-5.11", "the three cases of a map obstacle", map_figures),
            Target("figure-6.1", "chained movement buffers", chain_figure),
            Target("table-6.1", "reach sets measured beside the paper's figures", reach_set_table),
            Target(
                "figures-6.2-6.13",
                "intersection models of an intruder and the reach sets that they leave",
                intruder_figures,
            ),
            Target("figures-6.14-6.22", "the flight round static obstacles", static_figures),
            Target("table-6.2", "the set of intruders", reproduce_intruder_table),
            Target("figures-6.23-6.28", "the flight among intruders", traffic_figures),
            Target("figure-7.1", "the modules of control", frame_figure),
            Target("comparison", "planners side by side", comparison),
        )
    }
)


def targets_named(names: Sequence[str]) -> tuple[Target, ...]:
    """The targets of these names, each once, or all of them for "all".

    Raises InputError naming every unknown name and the valid ones.
    """
    valid = f"valid: {', '.join((*TARGETS, ALL))}"
    if not names:
        raise InputError("command line", f"nothing to reproduce: name at least one target; {valid}")
    unknown = [name for name in names if name not in TARGETS and name != ALL]
    if unknown:
        raise InputError(
            "command line",
            [f"no target {name!r}{did_you_mean(name, TARGETS)}; {valid}" for name in unknown],
        )
    chosen = TARGETS if ALL in names else dict.fromkeys(names)
    return tuple(TARGETS[name] for name in chosen)
