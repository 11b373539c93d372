"""Doors of the nodes: Ctrl-C and SIGTERM end them quietly from their first moment on."""

from typing import NoReturn

from intent_perception.basics.commands import command


def recognizer() -> NoReturn:
    """Run the node recognizer."""
    command("intent_perception.ros.recognizer_node")


def calibrate() -> NoReturn:
    """Run the node calibrate."""
    command("intent_perception.ros.calibrate_node")


def replay() -> NoReturn:
    """Run the node replay."""
    command("intent_perception.ros.replay_node")
