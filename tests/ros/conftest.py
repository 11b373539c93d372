"""ROS for the tests: a domain of their own, nodes as processes, a probe that speaks and listens."""

from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("intent_msgs", reason="run scripts/test.sh: it sources the workspace")

import rclpy
from tests.support.harness import Graph, Probe

from intent_perception.ros.ros_domain import private_domain


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark everything in this folder."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker("ros")


@pytest.fixture(scope="session", autouse=True)
def _domain() -> Iterator[None]:
    with private_domain():
        yield


@pytest.fixture
def graph(tmp_path: Path) -> Iterator[Graph]:
    """Nodes as processes; all end with the test."""
    nodes = Graph(tmp_path)
    yield nodes
    nodes.stop()


@pytest.fixture
def probe() -> Iterator[Probe]:
    """A node in this process that publishes camera images and keeps what it hears."""
    rclpy.init()
    node = Probe()
    yield node
    node.close()
    rclpy.try_shutdown()
