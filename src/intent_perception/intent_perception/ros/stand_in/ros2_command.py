"""The commands of `ros2` that a user of the graph needs, where no ros2 is installed.

scripts/ros2.sh topic list [-t] | topic echo TOPIC [--once] | topic hz TOPIC | node list
scripts/ros2.sh param list NODE | param get NODE NAME | param set NODE NAME VALUE
scripts/ros2.sh param describe NODE NAME | interface show TYPE
scripts/ros2.sh bag record [-o FOLDER] [TOPIC ...]
"""

import argparse
import statistics
import time
from array import array
from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
import yaml
from rcl_interfaces.msg import Parameter as ParameterMessage
from rclpy.node import Node
from rclpy.parameter import Parameter, get_parameter_value, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

from intent_perception.ros.stand_in.bag_record import as_offered, record
from intent_perception.ros.stand_in.interface_text import interface_text

_MANY = 128
"""Longer arrays are cut when a message is printed, as `ros2 topic echo` does."""


def plain(value: Any) -> Any:
    """Return a message as dictionaries, lists and scalars; long arrays and texts are cut."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, np.ndarray | array | list | tuple):
        shown = [plain(one) for one in value[:_MANY]]
        return [*shown, "..."] if len(value) > _MANY else shown
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else list(value[:_MANY])
    return value.item() if isinstance(value, np.generic) else value


def message_class(kind: str) -> Any:
    """Return the class of a type such as sensor_msgs/msg/Image.

    Raises:
        ValueError: if there is none.
    """
    package, _, name = kind.replace("/msg/", "/").partition("/")
    try:
        return getattr(import_module(f"{package}.msg"), name)
    except (ImportError, AttributeError) as error:
        raise ValueError(f"{kind} is no message type of this environment") from error


def main() -> None:
    """Run the command; it speaks to the domain that ROS_DOMAIN_ID names."""
    options = _parser().parse_args()
    if options.run is _show_interface:
        _show_interface(options.type)
        return
    arguments = dict(vars(options))
    run = arguments.pop("run")
    rclpy.init()
    try:
        run(rclpy.create_node("_intent_ros2"), **arguments)
    finally:
        rclpy.try_shutdown()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="scripts/ros2.sh",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    groups = parser.add_subparsers(required=True, metavar="GROUP")

    def group(name: str, text: str) -> Callable[..., argparse.ArgumentParser]:
        verbs = groups.add_parser(name, help=text).add_subparsers(required=True, metavar="VERB")

        def verb(name: str, run: Callable[..., None], *words: str) -> argparse.ArgumentParser:
            made = verbs.add_parser(name, help=(run.__doc__ or "").partition(".")[0])
            made.set_defaults(run=run)
            for word in words:
                made.add_argument(word)
            return made

        return verb

    verb = group("topic", "list topics and hear them")
    verb("list", _list_topics).add_argument("-t", "--types", action="store_true")
    verb("echo", _echo, "topic").add_argument("--once", action="store_true", help="one message")
    verb("hz", _hertz, "topic").add_argument("--window", type=int, default=10000)
    group("node", "list nodes")("list", _list_nodes)
    verb = group("param", "parameters of a node")
    verb("list", _list_parameters, "node_name")
    verb("describe", _describe_parameter, "node_name", "parameter")
    verb("get", _get_parameter, "node_name", "parameter")
    verb("set", _set_parameter, "node_name", "parameter", "value")
    bag = group("bag", "record topics")("record", _record_bag)
    bag.add_argument("topics", nargs="*", help="default: all")
    bag.add_argument("-o", "--output", default=time.strftime("rosbag2_%Y_%m_%d-%H_%M_%S"))
    bag.add_argument("--seconds", type=float, default=0.0, help="end after so long [s]")
    group("interface", "message types")("show", _show_interface, "type")
    return parser


def _discovered(node: Node, found: Callable[[], Any], patience: float = 5.0) -> Any:
    """Return what is found, once it is; the last answer after so many seconds."""
    end = time.monotonic() + patience
    while not (answer := found()) and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.1)
    return answer


def _settle(node: Node) -> None:
    """Wait for a first other node, at most 6 s, and then until nothing new comes for a second."""
    _discovered(node, lambda: len(node.get_node_names()) > 1, 6.0)
    known, quiet = 0, time.monotonic()
    while time.monotonic() - quiet < 1.0:
        rclpy.spin_once(node, timeout_sec=0.1)
        found = len(node.get_topic_names_and_types()) + len(node.get_node_names())
        if found != known:
            known, quiet = found, time.monotonic()


def _list_topics(node: Node, types: bool) -> None:
    """Print the topics."""
    _settle(node)
    for name, kinds in sorted(node.get_topic_names_and_types()):
        print(f"{name} [{', '.join(kinds)}]" if types else name)


def _list_nodes(node: Node) -> None:
    """Print the nodes."""
    _settle(node)
    own = node.get_name()
    for name, namespace in sorted(node.get_node_names_and_namespaces(), key=lambda n: n[::-1]):
        if name != own:
            print(f"{namespace.rstrip('/')}/{name}")


def _messages(node: Node, topic: str) -> Iterator[Any]:
    """Yield what comes on a topic, heard as its publishers offer it."""
    name = node.resolve_topic_name(topic)
    senders = _discovered(node, lambda: node.get_publishers_info_by_topic(name))
    if not senders:
        raise ValueError(f"nobody publishes on {name}; see scripts/ros2.sh topic list")
    qos = as_offered(senders, 100)
    waiting: list[Any] = []
    node.create_subscription(message_class(senders[0].topic_type), name, waiting.append, qos)
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=1.0)
        while waiting:
            yield waiting.pop(0)


def _echo(node: Node, topic: str, once: bool) -> None:
    """Print messages as YAML."""
    for message in _messages(node, topic):
        print(yaml.safe_dump(plain(message), sort_keys=False, allow_unicode=True), end="---\n")
        if once:
            return


def _hertz(node: Node, topic: str, window: int) -> None:
    """Print once a second how often messages come."""
    times: list[float] = []
    said: float | None = None  # the search for who publishes takes a while
    for _ in _messages(node, topic):
        times = [*times[-window:], time.monotonic()]
        said = said or times[0]
        if times[-1] - said >= 1.0:
            gaps = [after - before for before, after in pairwise(times)]
            spread = f"min: {min(gaps):.3f}s max: {max(gaps):.3f}s"
            print(
                f"average rate: {len(gaps) / sum(gaps):.3f}\n\t{spread} "
                f"std dev: {statistics.pstdev(gaps):.5f}s window: {len(times)}",
                flush=True,
            )
            said = times[-1]


def _record_bag(node: Node, topics: list[str], output: str, seconds: float) -> None:
    """Write messages to a bag until Ctrl-C. Default: all topics."""
    print(f"recording to {output}; Ctrl-C ends it", flush=True)
    count = record(node, topics, Path(output), message_class, seconds)
    print(f"{count} messages in {output}")


def _answer(node: Node, node_name: str, ask: Callable[[AsyncParameterClient], Any]) -> Any:
    """Return a node's answer to a question about its parameters."""
    client = AsyncParameterClient(node, node_name)
    if not _discovered(node, client.services_are_ready, 8.0):
        raise ValueError(f"no node {node_name} answers; see scripts/ros2.sh node list")
    future = ask(client)
    rclpy.spin_until_future_complete(node, future, timeout_sec=10.0)
    if future.result() is None:
        raise ValueError(f"node {node_name} does not answer; it may be busy")
    return future.result()


def _list_parameters(node: Node, node_name: str) -> None:
    """Print the names of a node's parameters."""
    for name in sorted(_answer(node, node_name, lambda c: c.list_parameters()).result.names):
        print(f"  {name}")


def _get_parameter(node: Node, node_name: str, parameter: str) -> None:
    """Print a parameter."""
    values = _answer(node, node_name, lambda c: c.get_parameters([parameter])).values
    if not values or values[0].type == Parameter.Type.NOT_SET.value:
        raise ValueError(f"{node_name} has no parameter {parameter}")
    print(parameter_value_to_python(values[0]))


def _describe_parameter(node: Node, node_name: str, parameter: str) -> None:
    """Print what a parameter means and what it may be."""
    found = _answer(node, node_name, lambda c: c.describe_parameters([parameter])).descriptors
    if not found or found[0].type == Parameter.Type.NOT_SET.value:
        raise ValueError(f"{node_name} has no parameter {parameter}")
    print(f"{parameter} ({Parameter.Type(found[0].type).name.lower()}): {found[0].description}")
    for bounds in (*found[0].integer_range, *found[0].floating_point_range):
        print(f"  from {bounds.from_value:g} to {bounds.to_value:g}")
    if found[0].additional_constraints:
        print(f"  {found[0].additional_constraints}")


def _set_parameter(node: Node, node_name: str, parameter: str, value: str) -> None:
    """Set a parameter."""
    message = ParameterMessage(name=parameter, value=get_parameter_value(value))
    wanted = Parameter.from_parameter_msg(message)
    (result,) = _answer(node, node_name, lambda c: c.set_parameters([wanted])).results
    if not result.successful:
        raise ValueError(f"{node_name} does not set {parameter}: {result.reason}")
    print("Set parameter successful")


def _show_interface(kind: str) -> None:
    """Print a message definition."""
    print(interface_text(kind), end="")
