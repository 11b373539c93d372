"""Doors of the nodes: Ctrl-C and SIGTERM end them quietly from their first moment on."""

from typing import NoReturn

from intent_perception.basics.commands import command


def tracker() -> NoReturn:
    """Run the node tracker."""
    command("intent_tracking.ros.tracker_node")


def grasp_detector() -> NoReturn:
    """Run the node grasp_detector."""
    command("intent_tracking.ros.grasp_detector_node")
