"""ROS node: what a running graph says about the bags that are played to it, and when.

The five nodes run as `ros2 run` would start them, in a ROS domain of their own, and hear bags from
a player that knows nothing of them. Latency is taken from the arrival of a frame's camera_info at
this node: it is sent together with the images.
"""

import os
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import rclpy
from ament_index_python import get_package_prefix
from intent_msgs import msg as msgs
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from intent_imitation.ros.graph import NODES
from intent_perception.bags.frame_assembly import stamp_of
from intent_perception.bags.playback import transports
from intent_perception.ros.node import LATCHED, RESULTS
from intent_perception.ros.ros_domain import private_domain

_PATIENCE = 120.0
"""Longest wait for the nodes to be ready and for a bag to be played to its end [s]."""
_REST = 3.0
"""Answers are waited for so long after the last frame [s]."""
_TICKS = os.sysconf("SC_CLK_TCK")


@dataclass
class Heard:
    """Everything said about one bag; times are wall clock [s]."""

    frames: dict[int, float] = field(default_factory=dict)
    """Stamp of each frame -> when it was sent."""
    states: dict[int, float] = field(default_factory=dict)
    """Stamp of each scene state -> when it came."""
    objects: list[tuple[int, float]] = field(default_factory=list)
    """Stamp of each answer with objects, and when it came."""
    grasps: list[int] = field(default_factory=list)
    """Stamps of stable grasps."""
    best: dict[int, str] = field(default_factory=dict)
    """Stamp of each final posterior -> best task."""
    plans: dict[int, float] = field(default_factory=dict)
    """Stamp of each plan -> when it came."""
    cpu: dict[str, float] = field(default_factory=dict)
    """CPU time of each node over the bag [s]."""
    memory: dict[str, float] = field(default_factory=dict)
    """Resident memory of each node after it [bytes]."""
    handles: dict[str, int] = field(default_factory=dict)
    """Open files, pipes and sockets of each node after it."""

    def latencies(self) -> list[float]:
        """Return the time from each frame to its state [s]."""
        return [self.states[t] - self.frames[t] for t in self.states if t in self.frames]


class RealtimeProbe(Node):
    """Listens to all that the five nodes publish."""

    def __init__(self, pids: dict[str, int], start: Callable[[str], int]) -> None:
        """Listen.

        Args:
            pids: of the running nodes.
            start: starts a node of this name once more and returns its pid.
        """
        super().__init__("realtime_probe")
        self._pids, self._start, self._ready = pids, start, set[str]()
        self.heard = Heard()
        self._moment, self._action = -1, cast(Callable[[], None] | None, None)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        hear = self.create_subscription
        self._frames = hear(CameraInfo, "/rgb/camera_info", self._on_info, 100)
        self._resume = self.create_client(Trigger, "/replay/resume")
        hear(msgs.RecognizedObjects, "/intent/objects", self._on_objects, 10)
        hear(msgs.SceneState, "/intent/scene_state", self._on_state, RESULTS)
        hear(msgs.StableGrasp, "/intent/stable_grasp", self._on_grasp, 10)
        hear(msgs.TaskPosterior, "/intent/task_posterior", self._on_posterior, RESULTS)
        hear(msgs.GraspPlan, "/intent/grasp_plan", self._on_plan, 10)
        for name in NODES:
            hear(Header, f"/{name}/ready", lambda _, name=name: self._ready.add(name), LATCHED)

    def await_ready(self) -> float:
        """Return how long it takes from now until all nodes are ready [s]."""
        start = time.monotonic()
        self._until(lambda: len(self._ready) == len(NODES), "not all nodes are ready")
        return time.monotonic() - start

    def restart(self, name: str) -> None:
        """Kill a node, which gets no chance to say good-bye, and start it again."""
        os.killpg(self._pids[name], signal.SIGKILL)
        self._ready.discard(name)
        self._pids[name] = self._start(name)

    def listen(self, seconds: float) -> Heard:
        """Return what the graph says for so long while nothing is played [s]."""
        self.heard = Heard()
        self._rest(seconds)
        return self.heard

    def play(self, bag: Path, moment: int = -1, action: Callable[[], None] | None = None) -> Heard:
        """Play a bag at its own rate and return what the graph says about it.

        Args:
            bag: its folder.
            moment: stamp of a frame [ns].
            action: what is done when that frame is sent.
        """
        self.heard, self._moment, self._action = Heard(), moment, action
        before = {name: cpu_seconds(pid) for name, pid in self._pids.items()}
        player = str(Path(get_package_prefix("intent_perception")) / "lib/intent_perception/replay")
        command = [player, str(bag), "--subscribers", "2", "--start-paused"]
        with subprocess.Popen(command) as process:
            self._begin(process)
            self._until(lambda: process.poll() is not None, f"{bag} was not played to its end")
        self._rest(_REST)
        for name, pid in self._pids.items():
            self.heard.cpu[name] = cpu_seconds(pid) - before[name]
            self.heard.memory[name] = resident_bytes(pid)
            self.heard.handles[name] = open_handles(pid)
        return self.heard

    def _begin(self, player: subprocess.Popen[bytes]) -> None:
        """Let a paused player go on once this node hears its frames as the others do."""

        def heard() -> bool:
            found = self._frames.get_publisher_count() > 0 and self._resume.service_is_ready()
            return player.poll() is not None or found

        self._until(heard, "the player is not heard")
        self._resume.call_async(Trigger.Request())

    def _on_info(self, message: Any) -> None:
        stamp, action = stamp_of(message), self._action
        self.heard.frames.setdefault(stamp, time.monotonic())
        if action is not None and stamp >= self._moment:
            self._action = None
            action()

    def _on_state(self, message: Any) -> None:
        self.heard.states.setdefault(stamp_of(message), time.monotonic())

    def _on_objects(self, message: Any) -> None:
        if message.objects:
            self.heard.objects.append((stamp_of(message), time.monotonic()))

    def _on_grasp(self, message: Any) -> None:
        self.heard.grasps.append(stamp_of(message))

    def _on_posterior(self, message: Any) -> None:
        if not message.preliminary:
            self.heard.best[stamp_of(message)] = message.best

    def _on_plan(self, message: Any) -> None:
        self.heard.plans.setdefault(stamp_of(message), time.monotonic())

    def _rest(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.05)

    def _until(self, condition: Callable[[], bool], trouble: str) -> None:
        end = time.monotonic() + _PATIENCE
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(f"{trouble} after {_PATIENCE:g} s")
            self._executor.spin_once(timeout_sec=0.05)


def cpu_seconds(pid: int) -> float:
    """Return the CPU time of a process so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def resident_bytes(pid: int) -> float:
    """Return the memory that a process holds [bytes]."""
    pages = Path(f"/proc/{pid}/statm").read_text().split()[1]
    return float(pages) * os.sysconf("SC_PAGE_SIZE")


def open_handles(pid: int) -> int:
    """Return how many files, pipes and sockets a process has open."""
    return sum(1 for _ in Path(f"/proc/{pid}/fd").iterdir())


@contextmanager
def probed_graph(bag: Path, models: Path | None) -> Iterator[RealtimeProbe]:
    """Run the five nodes in a ROS domain that no other run on this machine uses, and the probe.

    Args:
        bag: whose kind of images they hear.
        models: objects that they know, None = the shipped ones.
    """
    color, depth = transports(str(bag))
    arguments = ["--ros-args", "-r", "imitation/robot_objects:=/intent/objects"]
    arguments += ["-r", "imitation/robot_shapes:=/intent/shapes"]
    arguments += ["-p", f"color_transport:={color}", "-p", f"depth_transport:={depth}"]
    arguments += ["-p", f"models:={models}"] if models else []
    with private_domain(), tempfile.TemporaryDirectory() as folder:
        nodes = list[subprocess.Popen[bytes]]()

        def start(name: str) -> int:
            file = Path(get_package_prefix(NODES[name])) / "lib" / NODES[name] / name
            with (Path(folder) / f"{name}.log").open("ab") as log:
                nodes.append(
                    subprocess.Popen(
                        [str(file), *arguments], stdout=log, stderr=log, start_new_session=True
                    )
                )
            return nodes[-1].pid

        pids = {name: start(name) for name in NODES}
        rclpy.init()
        try:
            yield RealtimeProbe(pids, start)
        finally:
            rclpy.try_shutdown()
            for node in nodes:
                if node.poll() is None:
                    os.killpg(node.pid, signal.SIGTERM)
            for node in nodes:
                try:
                    node.wait(_PATIENCE)
                except subprocess.TimeoutExpired:
                    os.killpg(node.pid, signal.SIGKILL)
                    node.wait()
