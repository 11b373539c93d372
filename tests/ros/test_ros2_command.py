"""What scripts/ros2.sh answers where no ros2 is installed, asked of a running node."""

import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import rclpy
from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray, Header
from tests.support.script_runs import SCRIPTS, bash

from intent_perception.ros.node import LATCHED
from intent_perception.ros.stand_in.interface_text import interface_text
from intent_perception.ros.stand_in.ros2_command import message_class, plain

CODE = (
    "import sys; sys.argv[0] = 'ros2.sh'; from intent_perception.basics.commands import command; "
    "command('intent_perception.ros.stand_in.ros2_command')"
)


def ros2(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    command = [sys.executable, "-c", CODE, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.fixture(scope="module", autouse=True)
def speaker() -> Iterator[Node]:
    """A node /left/speaker with a parameter, a latched topic and one that ticks at 50 Hz."""
    rclpy.init()
    node = Node("speaker", namespace="left")
    loudness = ParameterDescriptor(description="How loud.")
    loudness.integer_range = [IntegerRange(from_value=0, to_value=11, step=1)]
    node.declare_parameter("volume", 3, loudness)
    node.create_publisher(Header, "latched", LATCHED).publish(Header(frame_id="table"))
    ticks = node.create_publisher(Header, "ticks", 10)
    node.create_timer(0.02, lambda: ticks.publish(Header()))
    thread = threading.Thread(target=_spin, args=(node,))
    thread.start()
    yield node
    rclpy.try_shutdown()
    thread.join()


def _spin(node: Node) -> None:
    try:
        rclpy.spin(node)
    except ExternalShutdownException:
        node.destroy_node()


def test_topics_are_listed_with_their_types() -> None:
    lines = ros2("topic", "list", "-t").stdout.splitlines()
    assert "/left/latched [std_msgs/msg/Header]" in lines


def test_nodes_are_listed_without_the_one_that_asks() -> None:
    assert ros2("node", "list").stdout == "/left/speaker\n"


def test_a_latched_message_is_echoed_as_yaml() -> None:
    done = ros2("topic", "echo", "/left/latched", "--once")
    assert done.stdout == "stamp:\n  sec: 0\n  nanosec: 0\nframe_id: table\n---\n"


def test_a_parameter_is_read_set_and_read_again() -> None:
    assert ros2("param", "get", "/left/speaker", "volume").stdout == "3\n"
    assert ros2("param", "set", "/left/speaker", "volume", "7").stdout.endswith("successful\n")
    assert ros2("param", "get", "/left/speaker", "volume").stdout == "7\n"
    assert "  volume" in ros2("param", "list", "/left/speaker").stdout.splitlines()


def test_a_parameter_is_described_with_its_range() -> None:
    said = ros2("param", "describe", "/left/speaker", "volume").stdout
    assert said == "volume (integer): How loud.\n  from 0 to 11\n"


def test_the_rate_is_that_of_the_publisher() -> None:
    command = [sys.executable, "-c", CODE, "topic", "hz", "/left/ticks"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as listening:
        assert listening.stdout is not None
        line = listening.stdout.readline()
        listening.terminate()
    assert float(line.removeprefix("average rate: ")) == pytest.approx(50.0, rel=0.3)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("topic", "echo", "/nothing", "--once"), "nobody publishes on /nothing"),
        (("param", "get", "/nobody", "volume"), "no node /nobody answers"),
        (("param", "get", "/left/speaker", "colour"), "has no parameter colour"),
        (("param", "set", "/left/speaker", "volume", "loud"), "does not set volume"),
        (("interface", "show", "std_msgs/msg/Nothing"), "is no interface of the package"),
    ],
)
def test_what_cannot_be_answered_is_said_in_one_sentence(
    arguments: tuple[str, ...], said: str
) -> None:
    done = ros2(*arguments)
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("ros2: ")
    assert said in line


def test_an_interface_is_shown_with_what_is_nested_in_it() -> None:
    text = interface_text("intent_msgs/msg/TaskPosterior")
    assert "\tbuiltin_interfaces/Time stamp\n\t\tint32 sec\n" in text
    assert message_class("intent_msgs/msg/TaskPosterior").__name__ == "TaskPosterior"


def test_long_arrays_are_cut() -> None:
    shown = plain(Float64MultiArray(data=[1.0] * 1000))["data"]
    assert shown == [1.0] * 128 + ["..."]


def script(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run scripts/ros2.sh."""
    return bash(str(SCRIPTS / "ros2.sh"), *arguments, **environment)


@pytest.mark.skipif(shutil.which("ros2") is not None, reason="ros2 itself is installed")
def test_run_starts_an_executable_of_a_package() -> None:
    assert "replay" in script("run", "intent_perception", "replay", "--help").stdout
    unknown = script("run", "intent_perception", "nothing")
    assert unknown.returncode == 1
    assert "no executable nothing in package intent_perception" in unknown.stderr


@pytest.mark.skipif(shutil.which("ros2") is not None, reason="ros2 itself is installed")
def test_the_script_answers_as_the_command_does() -> None:
    assert "/left/speaker" in script("node", "list").stdout.splitlines()


def test_where_ros2_is_installed_it_answers_itself(tmp_path: Path) -> None:
    tool = tmp_path / "ros2"
    tool.write_text('#!/bin/bash\necho "ros2 itself: $*"\n')
    tool.chmod(0o755)
    done = script("topic", "list", "-t", PATH=f"{tmp_path}:{os.environ['PATH']}")
    assert done.stdout == "ros2 itself: topic list -t\n"
