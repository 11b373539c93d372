"""Doors of the nodes: Ctrl-C and SIGTERM end them quietly from their first moment on."""

from typing import NoReturn

from intent_perception.basics.commands import command


def imitation() -> NoReturn:
    """Run the node imitation."""
    command("intent_imitation.ros.imitation_node")


def demo() -> NoReturn:
    """Run the node demo."""
    command("intent_imitation.ros.demo_node")


def viewer() -> NoReturn:
    """Run the node viewer."""
    command("intent_imitation.ros.viewer_node")


def bridge() -> NoReturn:
    """Run the node bridge."""
    command("intent_imitation.ros.bridge_node")
