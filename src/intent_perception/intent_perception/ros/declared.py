"""Parameters of nodes: every field of a configuration becomes one, with description and range."""

from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from intent_perception.basics.parameters import (
    Checked,
    Kind,
    Parameter,
    as_field,
    parameters_of,
    refusal,
    with_values,
)
from intent_perception.objects.database import ObjectDatabase


@dataclass(frozen=True)
class DatabaseConfig(Checked):
    """Which objects a node knows."""

    models: str = ""
    """Object database: a YAML file or a folder with one, added to the shipped 48 objects unless it
    says `only: true`; empty: the shipped ones alone."""


def declared[C](node: Node, config: C, prefix: str = "") -> C:
    """Return a configuration as the node's parameters set it, each declared with its description.

    Raises:
        ValueError: if a parameter has the wrong type or is out of range.
    """
    values = {p.name: _declared_one(node, p) for p in parameters_of(config, prefix)}
    result: C = with_values(config, values, prefix)
    return result


def _declared_one(node: Node, parameter: Parameter) -> Any:
    """Return a parameter, declared in two steps: rclpy's own refusal does not say what it got."""
    name, kind = parameter.name, parameter.kind
    default = "" if parameter.default is None else parameter.default
    default = RosParameter(name, value=list(default) if kind.many else default)
    loose = ParameterDescriptor(dynamic_typing=True)
    value = as_field(kind, node.declare_parameter(name, default.value, loose).value)
    if not kind.allows(value):
        raise ValueError(refusal(f"parameter {name}", kind, value))
    ros_value = "" if value is None else list(value) if kind.many else value
    chosen = RosParameter(name, default.type_, ros_value).get_parameter_value()
    node.set_descriptor(name, _descriptor(kind, default.type_.value), chosen)
    return value


def _descriptor(kind: Kind, ros_type: int) -> ParameterDescriptor:
    """Return description, type and range as `ros2 param describe` shows them."""
    found = ParameterDescriptor(description=kind.description, type=ros_type, read_only=True)
    if kind.choices:
        found.additional_constraints = " or ".join(kind.choices)
    if kind.range is not None and not kind.many:
        low, high, step = kind.range.low, kind.range.high, kind.range.step
        if kind.type is int:
            bounds = IntegerRange(from_value=int(low), to_value=int(high), step=step)
            found.integer_range = [bounds]
        else:
            found.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    return found


def declared_database(node: Node) -> ObjectDatabase:
    """Return the object database that the parameter `models` names; empty: the shipped one."""
    database = ObjectDatabase.load(declared(node, DatabaseConfig()).models or None)
    for note in database.notes:
        node.get_logger().warning(note)
    return database
