"""The five nodes for installations with launch_ros; scripts/run_graph.sh needs none.

ros2 launch intent_imitation intent.launch.py --show-args
"""

import os
import shlex
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
    SetEnvironmentVariable,
)
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from intent_imitation.ros.graph import NODES
from intent_perception.bags.bag_topics import BagInput
from intent_perception.bags.playback import node_arguments

SEE = ("recognizer", "tracker", "viewer")
CAMERA = {
    "color": "rgb/image_rect_color",
    "depth": "depth_registered/image_rect",
    "info": "rgb/camera_info",
}
VIEWED = ("intent/markers", "intent/hand/markers", "intent/image/compressed", "tf", "tf_static")
"""What RViz shows: its file names topics from the root, so they are taken into the namespace."""
SUFFIX = {"raw": "", "compressed": "/compressed", "compressedDepth": "/compressedDepth"}
ARGUMENTS = {
    "color": (CAMERA["color"], "topic of the colour images, without /compressed", None),
    "depth": (CAMERA["depth"], "topic of the depth images, without /compressedDepth", None),
    "info": (CAMERA["info"], "topic of CameraInfo; with a bag, these three name its topics", None),
    "color_transport": ("raw", "how colour images are sent", ["raw", "compressed"]),
    "depth_transport": ("raw", "how depth images are sent", ["raw", "compressedDepth"]),
    "models": ("", "objects of your own: a YAML file or a folder with one", None),
    "params_file": ("", "parameters that override those of each package's config folder", None),
    "namespace": ("", "where all nodes and topics live, e.g. left", None),
    "use_sim_time": ("false", "follow /clock; a bag then brings it", ["true", "false"]),
    "log_level": ("info", "what nodes report", ["debug", "info", "warn", "error", "fatal"]),
    "rviz": ("false", "open RViz with the graph's view", ["true", "false"]),
    "view": ("0", "port of a web page on 127.0.0.1 with what the system believes; 0: none", None),
    "bag": ("", "rosbag2 folder to play, raw or compressed, once the nodes are ready", None),
    "rate": ("1.0", "speed of the bag, 1 = as recorded", None),
    "robot_objects": ("intent/objects", "topic of the objects on the robot's own table", None),
    "robot_shapes": ("intent/shapes", "topic of the shapes of those without a model", None),
    "respawn": ("false", "start a node again that has ended", ["true", "false"]),
}
"""Default, description and choices of each argument."""


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and, once they are known, the graph."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text, choices=choices)
        for name, (default, text, choices) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=graph)])


def graph(context: LaunchContext) -> list:
    """Return nodes, player and view as the arguments ask for them."""
    chosen = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    profile = Path(get_package_share_directory("intent_imitation")) / "config" / "fastdds.xml"
    file = os.environ.get("FASTRTPS_DEFAULT_PROFILES_FILE", str(profile))
    actions = [SetEnvironmentVariable("FASTRTPS_DEFAULT_PROFILES_FILE", file)]
    seen = chosen["rviz"] == "true" or chosen["view"] != "0"
    for name in (*NODES, *(["viewer"] if seen else [])):
        actions += announced(name, node(name, chosen))
    if chosen["bag"]:
        player = replay(chosen)
        end = EmitEvent(event=Shutdown(reason="the bag has been played"))
        actions += [
            player,
            RegisterEventHandler(OnProcessExit(target_action=player, on_exit=[end])),
        ]
    if chosen["rviz"] == "true":
        actions.append(rviz(chosen))
    return actions


def node(name: str, chosen: dict[str, str]) -> Node:
    """Return one of the five, with its package's config, then params_file, then arguments."""
    package = NODES.get(name, "intent_imitation")
    config = Path(get_package_share_directory(package)) / "config" / f"{package}.yaml"
    parameters = [str(config), *([chosen["params_file"]] if chosen["params_file"] else [])]
    own: dict[str, bool | float | str] = {"use_sim_time": chosen["use_sim_time"] == "true"}
    if chosen["models"]:
        own["models"] = chosen["models"]
    if name in SEE:
        own |= images(chosen)
    if name == "viewer":
        own["port"] = int(chosen["view"])
    robot = [(f"imitation/{topic}", chosen[topic]) for topic in ("robot_objects", "robot_shapes")]
    return Node(
        package=package,
        executable=name,
        namespace=chosen["namespace"],
        parameters=[*parameters, own],
        remappings=robot if name == "imitation" else camera(chosen) if name in SEE else [],
        ros_arguments=["--log-level", chosen["log_level"]],
        respawn=chosen["respawn"] == "true",
        respawn_delay=2.0,
        output="screen",
    )


def images(chosen: dict[str, str]) -> dict[str, float | str]:
    """Return the parameters that say how images come, from a camera or from the bag."""
    if not chosen["bag"]:
        return {key: chosen[key] for key in ("color_transport", "depth_transport")}
    words = shlex.split(node_arguments(chosen["bag"], BagInput(topics_of(chosen))))
    pairs = [word.split(":=") for word in words if ":=" in word]
    return {key: float(value) if key == "depth_scale" else value for key, value in pairs}


def topics_of(chosen: dict[str, str]) -> tuple[str, ...]:
    """Return the bag's topics that were named; none where they are to be found."""
    named = tuple(chosen[name] for name in CAMERA)
    return () if named == tuple(CAMERA.values()) else named


def camera(chosen: dict[str, str]) -> list[tuple[str, str]]:
    """Return the remappings of a live camera; a bag is played on the nodes' own topics."""
    if chosen["bag"]:
        return []
    pairs = []
    for name, topic in CAMERA.items():
        suffix = SUFFIX[chosen.get(f"{name}_transport", "raw")]
        if chosen[name] != topic:
            pairs.append((topic + suffix, chosen[name] + suffix))
    return pairs


def announced(name: str, action: Node) -> list:
    """Return a node and what says that it has ended, by its name."""

    def epitaph(event: object, context: LaunchContext) -> LogInfo | None:
        if context.is_shutdown:
            return None
        status = event.returncode
        how = f"killed by signal {-status}" if status < 0 else f"status {status}"
        return LogInfo(msg=f"the node {name} has ended ({how})")

    return [action, RegisterEventHandler(OnProcessExit(target_action=action, on_exit=epitaph))]


def replay(chosen: dict[str, str]) -> Node:
    """Return the player of the bag; it waits until the nodes are ready."""
    clock = ["--clock"] if chosen["use_sim_time"] == "true" else []
    named = ["--topics", *topics_of(chosen)] if topics_of(chosen) else []
    wait = ["--subscribers", "2", "--wait", "120", "--await", *NODES]
    return Node(
        package="intent_perception",
        executable="replay",
        namespace=chosen["namespace"],
        arguments=[chosen["bag"], "--rate", chosen["rate"], *clock, *named, *wait],
        output="screen",
    )


def rviz(chosen: dict[str, str]) -> Node:
    """Return RViz with the view of the graph, whose topics it finds in the graph's namespace."""
    view = Path(get_package_share_directory("intent_imitation")) / "rviz" / "intent.rviz"
    return Node(
        package="rviz2",
        executable="rviz2",
        namespace=chosen["namespace"],
        arguments=["-d", str(view)],
        remappings=[(f"/{topic}", topic) for topic in VIEWED],
        parameters=[{"use_sim_time": chosen["use_sim_time"] == "true"}],
    )
