"""Doors of the nodes: Ctrl-C and SIGTERM end them quietly from their first moment on."""

from typing import NoReturn

from intent_perception.basics.commands import command


def inference() -> NoReturn:
    """Run the node inference."""
    command("intent_inference.ros.inference_node")


def record() -> NoReturn:
    """Run the node record."""
    command("intent_inference.ros.record_node")
