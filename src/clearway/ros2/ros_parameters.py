"""Parameters of a node of rclpy: declared by name and type, read back, guarded against misuse."""

from __future__ import annotations

import types
import typing
from collections.abc import Callable, Collection, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError
from pydantic_core import PydanticUndefined

from clearway.ros2.parameter_file import merge
from clearway.ros2.parameters import NodeParameters, list_problems, parameters_of

OF_ROS = ("start_type_description_service", "qos_overrides")
"""Declared by rclpy itself."""
READ_AT_CONFIGURE = (
    "is read when the node is configured: deactivate and clean up before it is set "
    "(ros2 lifecycle set NODE deactivate; ros2 lifecycle set NODE cleanup)"
)


class Leaf(NamedTuple):
    """One parameter."""

    name: str
    kind: str
    """BOOL, DOUBLE or STRING: a `rclpy.Parameter.Type`."""
    default: object
    """None where it has none."""


def list_leaves(
    model: type[BaseModel], given: Mapping[str, Any], within: str = ""
) -> Iterator[Leaf]:
    """Yield all parameters below a section; of maps, those whose names are given."""
    for field, info in model.model_fields.items():
        name, kind = f"{within}{field}", _without_none(info.annotation)
        below = given.get(field)
        names = below if isinstance(below, Mapping) else {}
        if typing.get_origin(kind) is dict:
            one = typing.get_args(kind)[1]
            for own, values in names.items():
                yield from list_leaves(
                    one, values if isinstance(values, Mapping) else {}, f"{name}.{own}."
                )
        elif isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from list_leaves(kind, names, f"{name}.")
        else:
            default = None if info.default is PydanticUndefined else info.default
            yield Leaf(name, _KINDS.get(kind, "STRING"), default)


_KINDS: dict[object, str] = {bool: "BOOL", float: "DOUBLE"}


def _without_none(annotation: Any) -> Any:
    """X of X | None."""
    if isinstance(annotation, types.UnionType):
        (annotation,) = (one for one in typing.get_args(annotation) if one is not type(None))
    return annotation


class RosParameters:
    """Of one node, made with `automatically_declare_parameters_from_overrides`."""

    def __init__(
        self,
        node: Any,
        folder: Path,
        defaults: Mapping[str, object],
        without: Collection[str],
        is_open: Callable[[], bool],
    ) -> None:
        """folder: where a relative mission is looked for. defaults: other ones than the model's.
        without: sections that are not declared. is_open: whether parameters may be set."""
        self._node, self._folder, self._is_open = node, folder, is_open
        parameter: Any = import_module("rclpy.parameter").Parameter
        given = self._nest()
        self._leaves = {
            leaf.name: leaf._replace(default=defaults.get(leaf.name, leaf.default))
            for leaf in list_leaves(NodeParameters, given)
            if leaf.name.partition(".")[0] not in without
        }
        for leaf in self._leaves.values():
            value = leaf.default
            if node.has_parameter(leaf.name):
                present = node.get_parameter(leaf.name)
                if present.type_ != parameter.Type.INTEGER or leaf.kind != "DOUBLE":
                    continue
                value = float(present.value)  # YAML writes 10 for 10.0.
                node.undeclare_parameter(leaf.name)
            kind_or_value = parameter.Type[leaf.kind] if value is None else value
            node.declare_parameter(leaf.name, kind_or_value, ignore_override=True)
        node.add_on_set_parameters_callback(self._check)

    def read(self) -> NodeParameters:
        """Return what is set; raises ValidationError."""
        return parameters_of(self._nest(), self._folder)

    def _nest(self, changed: Mapping[str, object] = types.MappingProxyType({})) -> dict[str, Any]:
        """Values by sections."""
        own = self._node.get_parameters_by_prefix("")
        found: dict[str, Any] = {}
        for name, value in ({name: one.value for name, one in own.items()} | dict(changed)).items():
            if value is not None and name.partition(".")[0] not in OF_ROS:
                merge(found, {name: value})
        return found

    def _check(self, parameters: list[Any]) -> Any:
        """Whether parameters may be set so."""
        result: Any = import_module("rcl_interfaces.msg").SetParametersResult
        ours = [one for one in parameters if one.name in self._leaves]
        if ours and not self._is_open():
            return result(successful=False, reason=f"{ours[0].name} {READ_AT_CONFIGURE}")
        before = self._problems(self._nest())
        after = self._problems(self._nest({one.name: one.value for one in ours}))
        fresh = [problem for problem in after if problem not in before]
        return result(successful=not fresh, reason="; ".join(fresh))

    def _problems(self, nested: Mapping[str, Any]) -> list[str]:
        try:
            parameters_of(nested, self._folder)
        except ValidationError as refused:
            return list_problems(refused)
        return []
