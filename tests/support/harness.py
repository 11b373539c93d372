"""Tools of the ROS tests: nodes as processes, and a node that speaks for a camera."""

import os
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from ament_index_python import get_package_prefix
from rcl_interfaces.msg import Log
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, Image

from intent_perception.bags.bag_files import BagWriter, read_frames
from intent_perception.geometry.camera import RgbdFrame
from intent_perception.ros.convert import header_at
from intent_perception.ros.node import LATCHED

CAMERA_FRAME = "camera_color_optical_frame"
SECOND = 1_000_000_000


class Graph:
    """Nodes started as `ros2 run` starts them, each with a log file."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._nodes = folder, dict[str, subprocess.Popen[bytes]]()

    def start(self, package: str, executable: str, *arguments: str) -> str:
        """Start a node; return its name in this graph."""
        name = f"{executable}_{len(self._nodes)}"
        file = Path(get_package_prefix(package)) / "lib" / package / executable
        with (self._folder / f"{name}.log").open("wb") as log:
            self._nodes[name] = subprocess.Popen(
                [str(file), *arguments], stdout=log, stderr=log, start_new_session=True
            )
        return name

    def log(self, name: str) -> str:
        """Return what a node has printed."""
        return (self._folder / f"{name}.log").read_text()

    def alive(self, name: str) -> bool:
        """Return whether a node still runs."""
        return self._nodes[name].poll() is None

    def wait(self, name: str, timeout: float = 120.0) -> int:
        """Wait for a node to end; return its exit status."""
        return self._nodes[name].wait(timeout)

    def stop(self) -> None:
        """End all nodes."""
        for node in self._nodes.values():
            if node.poll() is None:
                os.killpg(node.pid, signal.SIGKILL)
            node.wait()


class Probe(Node):  # type: ignore[misc]
    """Publishes frames like a camera and keeps everything it hears."""

    def __init__(self) -> None:
        super().__init__("probe")
        self.heard: dict[str, list[Any]] = {}
        self.warnings: list[str] = []
        self._executor = SingleThreadedExecutor()
        self._guests: list[Node] = []
        self._executor.add_node(self)
        qos = QoSProfile(depth=20)
        self._color = self.create_publisher(Image, "/rgb/image_rect_color", qos)
        self._depth = self.create_publisher(Image, "/depth_registered/image_rect", qos)
        self._info = self.create_publisher(CameraInfo, "/rgb/camera_info", qos)
        logs = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(Log, "/rosout", self._on_log, logs)

    def close(self) -> None:
        """Leave the graph, with the nodes that ran here: a name left behind takes /rosout along."""
        self._executor.shutdown()
        for node in self._guests:
            node.destroy_node()
        self.destroy_node()

    def run_with(self, node: Node) -> None:
        """Run another node of this process together with the probe, until the probe closes."""
        self._guests.append(node)
        self._executor.add_node(node)

    def listen(self, kind: Any, topic: str, qos: Any = LATCHED) -> None:
        """Keep every message of a topic."""
        kept = self.heard.setdefault(topic, [])
        self.create_subscription(kind, topic, kept.append, qos)

    def until(self, condition: Callable[[], bool], timeout: float = 60.0) -> bool:
        """Serve until a condition holds; return whether it did in time."""
        end = time.monotonic() + timeout
        while not condition() and time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.02)
        return condition()

    def connected(self) -> bool:
        """Return whether somebody listens to every image topic."""
        topics = (self._color, self._depth, self._info)
        return all(publisher.get_subscription_count() for publisher in topics)

    def send(self, frame: RgbdFrame, depth: Any = None, info: bool = True) -> None:
        """Publish a frame; `depth` replaces its depth image (float32 m or uint16 mm)."""
        header = header_at(frame.stamp, CAMERA_FRAME)
        camera = frame.camera
        if info:
            message = CameraInfo(header=header, height=camera.height, width=camera.width)
            message.k = camera.matrix.ravel().tolist()
            self._info.publish(message)
        self._color.publish(image(header, "rgb8", frame.color))
        pixels = frame.depth if depth is None else depth
        encoding = "32FC1" if pixels.dtype == np.float32 else "16UC1"
        self._depth.publish(image(header, encoding, pixels))

    def _on_log(self, message: Any) -> None:
        if message.level >= 30 and message.name != "probe":
            self.warnings.append(message.msg)


def image(header: Any, encoding: str, pixels: Any) -> Any:
    """Return a sensor_msgs/Image of an array (H, W) or (H, W, C)."""
    rows = np.ascontiguousarray(pixels).reshape(pixels.shape[0], -1)
    message = Image(header=header, encoding=encoding, height=pixels.shape[0])
    message.width, message.step = pixels.shape[1], rows.shape[1] * rows.itemsize
    message.data = rows.tobytes()
    return message


def shipped_bag(name: str) -> Path:
    """Return a shipped bag, else the one that bags/make.py has made."""
    bags = Path(__file__).resolve().parent.parent.parent / "bags"
    return bags / name if (bags / name).is_dir() else bags / "generated" / name


def cut_bag(source: Path, path: Path, frames: slice) -> Path:
    """Write some of the frames of a bag to another, colours raw so that nothing changes."""
    with BagWriter(path, color="raw") as writer:
        for frame in list(read_frames(source))[frames]:
            writer.write(frame)
    return path


def ros_arguments(*pairs: str) -> Sequence[str]:
    """Return ROS arguments that set parameters "name:=value"."""
    return ("--ros-args", *(part for pair in pairs for part in ("-p", pair)))
