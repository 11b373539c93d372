"""What a node says of itself when it is asked for --help."""

import inspect
from typing import Any


def node_help(kind: Any) -> str:
    """Return how a node is started, what its class says of it, and where its parameters stand."""
    package, _, module = kind.__module__.partition(".ros.")
    name = module.removesuffix("_node")
    return (
        f"usage: ros2 run {package} {name} [--ros-args] [-p NAME:=VALUE] [-r TOPIC:=TOPIC] "
        "[--params-file FILE]\n\n"
        f"{inspect.getdoc(kind)}\n\n"
        f"Usual parameters: config/{package}.yaml in the package's share folder. While it runs,\n"
        f"`scripts/ros2.sh param list /{name}` names them, and `param describe /{name} NAME`\n"
        "says what one means and may be.\n"
    )
