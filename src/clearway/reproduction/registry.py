"""All targets of `clearway reproduce`, in the paper's order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from clearway.errors import InputError
from clearway.reproduction.illustrations import illustrations
from clearway.reproduction.intruder_figures import intruder_figures
from clearway.reproduction.reach_set_figures import reach_set_figures
from clearway.reproduction.target import Target
from clearway.reproduction.visibility_figures import visibility_figures

ALL = "all"

TARGETS: Mapping[str, Target] = MappingProxyType(
    {
        target.name: target
        for target in (
            Target(
                "figures-2.3-2.4",
                "an intruder's spread; trajectories of different safety",
                illustrations,
            ),
            Target(
                "figures-4.1-4.3", "chaotic, harmonic and combined reach sets", reach_set_figures
            ),
            Target("figures-5.5-5.8", "visibility behind hindrances in a row", visibility_figures),
            Target(
                "figures-6.2-6.13",
                "intersection models of an intruder and the reach sets that they leave",
                intruder_figures,
            ),
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
        raise InputError("command line", [f"no target {name!r}; {valid}" for name in unknown])
    chosen = TARGETS if ALL in names else dict.fromkeys(names)
    return tuple(TARGETS[name] for name in chosen)
