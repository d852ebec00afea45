"""The reference of mission and scene files, from the models that read them.

`python -m tools.reference` prints it, with `--write` into docs/missions.md; that also makes the
tables of formats and methods in other pages.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from clearway.avoidance.rate.fusion import RATINGS
from clearway.base.variants import Variants
from clearway.io.choices import OneOf
from clearway.io.marked_page import put_between_marks
from clearway.missions.mission_file import MissionFile, list_built_in_missions
from clearway.missions.scene_file import SceneFile
from clearway.missions.sensor_section import SENSORS
from clearway.reach.sets import METHODS
from clearway.sensors import COMBINE_RULES, NAMED_PATTERNS
from clearway.sensors.cells.detection import RULES
from clearway.sim.baselines import PLANNERS
from clearway.sim.baselines.knowledge import EVERYTHING, join_sources
from clearway.sim.baselines.registry import KnownPlanner
from clearway.sim.run import METRICS
from clearway.traffic.volumes import VOLUME_SETS
from tools.format_tables import PARTS
from tools.models import meanings_of, purpose_of
from tools.scale_table import scale_section

PAGE = Path(__file__).resolve().parent.parent / "docs" / "missions.md"

HEAD = """\
<!-- Made by `python -m tools.reference --write`: change the models in clearway.missions. -->

# Mission and scene files

`clearway fly` takes a [mission file](#mission-files) and `clearway assess` a
[scene file](#scene-files). Both are TOML, with the unit in the key: metres, seconds, degrees. The
axis x points forward or east, y left or north, z up. Roll, pitch and yaw are in that order, **pitch
positive nose down**, yaw positive left.

Only keys that differ from the defaults have to be written. Unknown keys, wrong types and impossible
values are refused, all of them at once, with the place and the valid choices. Every run writes the
effective file, defaults filled in, into its output folder; that file repeats the run.
"""

MISSIONS = """
## Mission files

Missions that come with clearway, flown by their name: {names}.

A mission needs a name and waypoints. This one flies round a ball that no map shows:

```toml
[mission]
name = "round-a-ball"
waypoints_m = [[20, 0, 0]]

[[lidar]]
sigma_m = 0.03

[[obstacle]]
shape = "ball"
position_m = [10, 0, 0]
radius_m = 2
```

[examples/missions](../examples/missions) holds flights through real places. Flight plans of ground
stations are flown too: see [maps.md](maps.md#flight-plans).
"""

SCENES = """
## Scene files

A scene is one moment: the cells of the grid, and the trajectories through them, are rated. With a
scan of your own, `clearway assess --scan FILE` needs no scene file.
[examples/scenes](../examples/scenes) holds some to start from.

```toml
[[obstacle]]
shape = "ball"
position_m = [5, 0, 0]
radius_m = 1

[scan.simulate]
obstacles = [0]
```
"""

NAMES = """
## Names

These names count in files and on the command line. Where a key says so, your own takes its place as
`module:name` or `file.py:name`: a module beside the file that names it, in the current folder, or
installed. The folder [examples](../examples) has a planner, a rating, a sensor and a rule of one's
own.

**Reading a file that names one runs its code**: open missions of others as you would their
programs.

| symbol | of a cell |
| --- | --- |
| P_OD | probability that an obstacle was detected in it |
| P_OM, P_OI | probability that one of the map stands, an intruder is met in it |
| P_O, P_V | probability that any of these is so; how far the cell was looked into |
| base, u | the share that the map fills; the key `unknown` |

P_R is the rating of a trajectory. Numbers in brackets are [equations](equations.md) of the paper.
"""
METRICS_HEAD = """
## The summary of a flight

`summary.json`, `clearway fly --json`, `Run.summary()` in Python; with its objects flattened,
`Run.to_row()`. Null where there is nothing to tell, such as a distance in empty space.
"""
NOT_KNOWN = """\
Where something can be hit that a planner cannot know, tables say n/a instead of counting it as
a failure. All planners have the vehicle, readings and mission control in common.
"""
REGISTRIES: tuple[Variants[Any], ...] = (
    RATINGS,
    PLANNERS,
    SENSORS,
    METHODS,
    RULES,
    COMBINE_RULES,
    VOLUME_SETS,
)

KINDS = {
    "number": "number",
    "integer": "whole number",
    "string": "text",
    "boolean": "true or false",
    "object": "table",
}


def page() -> str:
    """The whole page."""
    names = ", ".join(f"`{name}`" for name in sorted(list_built_in_missions()))
    patterns = ", ".join(f"`{name}`" for name in sorted(NAMED_PATTERNS))
    described: dict[type[BaseModel], str] = {}
    parts = [
        HEAD,
        MISSIONS.format(names=names),
        *_tables(MissionFile, "", described),
        scale_section(),
        SCENES,
        *_tables(SceneFile, "", described),
        NAMES,
        *(_names(registry) for registry in REGISTRIES),
        METRICS_HEAD,
        _names(METRICS),
        f"\nSensors by name, for `pattern`: {patterns}.\n",
    ]
    return "".join(parts)


def _tables(
    model: type[BaseModel], path: str, described: dict[type[BaseModel], str]
) -> Iterator[str]:
    """A section of the page for each table of a file; what is `described` is not repeated."""
    for name, field in model.model_fields.items():
        part = _section(field.annotation)
        if part is None:
            continue
        place = f"{path}.{name}" if path else name
        many = "tuple" in str(field.annotation)
        heading = f"`[[{place}]]`" if many else f"`[{place}]`"
        yield f"\n### {heading}\n\n"
        if part in described:
            yield f"The same keys as {described[part]} above.\n"
            continue
        described[part] = heading
        yield purpose_of(part) + "\n\n" + _keys(part)
        yield from _tables(part, place, described)


def _section(annotation: object) -> type[BaseModel] | None:
    """The table behind a field, if it is one."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    found = (_section(argument) for argument in get_args(annotation))
    return next((part for part in found if part is not None), None)


def _keys(model: type[BaseModel]) -> str:
    """A markdown table of the plain keys of a table."""
    schema = model.model_json_schema()
    meanings = meanings_of(model)
    lines = ["| key | value | default | meaning |", "| --- | --- | --- | --- |"]
    for name, field in model.model_fields.items():
        if _section(field.annotation) is not None:
            continue
        default = "**needed**" if field.is_required() else _default(field.get_default())
        value = _value(schema["properties"][name])
        lines.append(f"| `{name}` | {value} | {default} | {meanings[name]}{_variants(field)} |")
    return "\n".join(lines) + "\n"


def _variants(field: FieldInfo) -> str:
    """Where the choices of a registry are told."""
    kinds = [
        _plural(one.registry).lower()
        for one in field.metadata
        if isinstance(one, OneOf) and isinstance(one.registry, Variants)
    ]
    return "".join(f" See [{kind}](#{kind.replace(' ', '-')})." for kind in kinds)


def _plural(registry: Variants[Any]) -> str:
    return f"{registry.kind.capitalize()}s"


def _names(registry: Variants[Any]) -> str:
    """A table of the variants of a kind."""
    if registry is PLANNERS:
        return _planners()
    rows = "".join(f"| `{name}` | {registry.about(name)} |\n" for name in registry)
    return f"\n### {_plural(registry)}\n\n| name | what it is |\n| --- | --- |\n{rows}"


def _planners() -> str:
    """With what tables say of them: what they decide by, and what of clearway's they use."""
    rows = "".join(
        f"| `{name}` | {PLANNERS.about(name)} | {_decides_by(planner)} | "
        f"{planner.shares or 'all of it'} |\n"
        for name, planner in PLANNERS.items()
    )
    head = "| name | what it is | decides by | shares with clearway |\n| --- | --- | --- | --- |\n"
    return f"\n### Planners\n\n{head}{rows}\n{NOT_KNOWN}"


def _decides_by(planner: KnownPlanner) -> str:
    if planner.reference:
        return "nothing: the reference"
    return "all that is known" if planner.knows == EVERYTHING else join_sources(planner.knows)


def _default(value: object) -> str:
    return "none" if value is None else f"`{json.dumps(value)}`"


def _value(schema: dict[str, Any]) -> str:
    """What a key takes, in words, from its JSON schema."""
    if "anyOf" in schema:
        kinds = [_value(part) for part in schema["anyOf"] if part.get("type") != "null"]
        return " or ".join(kinds)
    if "enum" in schema or "const" in schema:
        names = schema.get("enum", [schema.get("const")])
        own = [f"your own, `{schema['own']}`"] if "own" in schema else []
        return " or ".join([*([_choice(names)] if names else []), *own])
    if schema["type"] == "array":
        return _list(schema)
    return KINDS[schema["type"]] + _limits(schema)


def _choice(values: list[str]) -> str:
    quoted = [f'`"{value}"`' for value in values]
    return ", ".join(quoted[:-1]) + (" or " if len(quoted) > 1 else "") + quoted[-1]


def _list(schema: dict[str, Any]) -> str:
    parts = schema.get("prefixItems")
    if parts is not None:
        return _several(str(len(parts)), _value(parts[0]))
    least = f", at least {schema['minItems']}" if schema.get("minItems") else ""
    items = schema["items"]
    if "prefixItems" in items:
        return f"list of [{_value(items)}]{least}"
    if "enum" in items:
        return f"list of {_value(items)}{least}"
    return _several("list of", _value(items)) + least


def _several(count: str, value: str) -> str:
    """So many of a value: its limits stay at the end."""
    word, comma, limits = value.partition(",")
    return f"{count} [{value}]" if word[0].isdigit() else f"{count} {word}s{comma}{limits}"


def _limits(schema: dict[str, Any]) -> str:
    if "minimum" in schema and "maximum" in schema:
        return f", {schema['minimum']:g} to {schema['maximum']:g}"
    words = (
        ("exclusiveMinimum", "above"),
        ("minimum", "at least"),
        ("exclusiveMaximum", "below"),
        ("maximum", "at most"),
    )
    return "".join(f", {word} {schema[key]:g}" for key, word in words if key in schema)


def main() -> None:
    if sys.argv[1:] == ["--write"]:
        PAGE.write_text(page(), encoding="utf-8")
        for (name, mark), made in PARTS.items():
            put_between_marks(PAGE.parent / name, mark, made())
    elif sys.argv[1:]:
        raise SystemExit("python -m tools.reference [--write]")
    else:
        sys.stdout.write(page())


if __name__ == "__main__":
    main()
