"""The launch file, as far as it can be read without ros2launch."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml
from tests.conftest import ROOT
from tests.support.harness import shipped_bag
from tests.support.launch_stand_in import StandInContext, read_launch_file

FILE = ROOT / "src" / "intent_imitation" / "launch" / "intent.launch.py"


@pytest.fixture(scope="module")
def launch() -> SimpleNamespace:
    """What the launch file defines."""
    return read_launch_file(FILE.read_text(), str(FILE))


def actions_of(launch: SimpleNamespace, **chosen: str) -> list[Any]:
    """Return what the launch file does with these arguments."""
    defaults = {name: default for name, (default, _, _) in launch.ARGUMENTS.items()}
    actions: list[Any] = launch.graph(StandInContext({**defaults, **chosen}))
    return actions


def graph(launch: SimpleNamespace, **chosen: str) -> dict[str, Any]:
    """Return the nodes by name that these arguments start."""
    actions = actions_of(launch, **chosen)
    return {a.named["executable"]: a for a in actions if type(a).__name__ == "Node"}


def own(node: Any) -> dict[str, Any]:
    """Return the parameters that arguments set."""
    values: dict[str, Any] = node.named["parameters"][-1]
    return values


def test_every_argument_has_a_description(launch: SimpleNamespace) -> None:
    declared = [a for a in launch.generate_launch_description().arguments[0] if a.named]
    named = {a.arguments[0]: a.named["description"] for a in declared if "description" in a.named}
    assert set(named) >= {
        *("color", "depth", "info", "color_transport", "depth_transport", "models"),
        *("params_file", "namespace", "use_sim_time", "log_level", "rviz", "bag"),
        "robot_objects",
    }
    assert all(named.values())
    assert set(named) == set(launch.ARGUMENTS)


def test_every_node_reads_its_package_s_config_and_then_the_user_s(
    launch: SimpleNamespace,
) -> None:
    nodes = graph(launch, params_file="mine.yaml")
    assert set(nodes) == {"recognizer", "tracker", "grasp_detector", "inference", "imitation"}
    for node in nodes.values():
        config, mine, _ = node.named["parameters"]
        assert Path(config).is_file()
        assert Path(config).stem == node.named["package"]
        assert mine == "mine.yaml"


def test_a_compressed_camera_is_remapped_where_it_is_sent(launch: SimpleNamespace) -> None:
    nodes = graph(launch, color="/cam/color", color_transport="compressed", info="/cam/info")
    for name in ("recognizer", "tracker"):
        assert nodes[name].named["remappings"] == [
            ("rgb/image_rect_color/compressed", "/cam/color/compressed"),
            ("rgb/camera_info", "/cam/info"),
        ]
        assert own(nodes[name])["color_transport"] == "compressed"


def test_a_shipped_bag_is_heard_compressed_and_ends_the_graph(launch: SimpleNamespace) -> None:
    bag = str(shipped_bag("give_bottle"))
    nodes = graph(launch, bag=bag, use_sim_time="true", rate="0.5")
    transports = {key: own(nodes["tracker"])[key] for key in ("color_transport", "depth_transport")}
    assert transports == {"color_transport": "compressed", "depth_transport": "compressedDepth"}
    assert nodes["replay"].named["arguments"][:4] == [bag, "--rate", "0.5", "--clock"]
    assert nodes["tracker"].named["remappings"] == []


def test_a_namespace_holds_every_node_and_no_topic_leaves_it(launch: SimpleNamespace) -> None:
    nodes = graph(launch, namespace="left", bag=str(shipped_bag("give_bottle")), rviz="true")
    assert {node.named["namespace"] for node in nodes.values()} == {"left"}
    assert nodes["imitation"].named["remappings"] == [
        ("imitation/robot_objects", "intent/objects"),
        ("imitation/robot_shapes", "intent/shapes"),
    ]


def test_the_viewer_runs_where_somebody_is_to_look(launch: SimpleNamespace) -> None:
    assert "viewer" not in graph(launch)
    assert own(graph(launch, rviz="true")["viewer"])["port"] == 0
    assert own(graph(launch, view="8765")["viewer"])["port"] == 8765


def test_a_dead_node_is_announced_by_name_but_not_at_the_end(launch: SimpleNamespace) -> None:
    _, handler = launch.announced("tracker", object())
    epitaph = handler.arguments[0].named["on_exit"]
    said = epitaph(SimpleNamespace(returncode=-9), StandInContext())
    assert said.named["msg"] == "the node tracker has ended (killed by signal 9)"
    assert epitaph(SimpleNamespace(returncode=0), StandInContext(is_shutdown=True)) is None


def test_nodes_are_started_again_by_choice(launch: SimpleNamespace) -> None:
    assert not any(node.named["respawn"] for node in graph(launch).values())
    assert all(node.named["respawn"] for node in graph(launch, respawn="true").values())


def test_every_node_hears_of_time_objects_and_log_level(launch: SimpleNamespace) -> None:
    nodes = graph(launch, use_sim_time="true", models="mine.yaml", log_level="debug")
    for node in nodes.values():
        assert own(node)["use_sim_time"] is True
        assert own(node)["models"] == "mine.yaml"
        assert node.named["ros_arguments"] == ["--log-level", "debug"]
    assert "models" not in own(graph(launch)["tracker"])


def test_the_robot_s_own_table_is_another_topic(launch: SimpleNamespace) -> None:
    nodes = graph(launch, robot_objects="/robot/objects", robot_shapes="/robot/shapes")
    assert nodes["imitation"].named["remappings"] == [
        ("imitation/robot_objects", "/robot/objects"),
        ("imitation/robot_shapes", "/robot/shapes"),
    ]


@pytest.mark.parametrize("of_the_user", ["", "mine.xml"])
def test_images_get_the_room_they_need_unless_the_user_has_a_profile(
    launch: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, of_the_user: str
) -> None:
    monkeypatch.delenv("FASTRTPS_DEFAULT_PROFILES_FILE", raising=False)
    if of_the_user:
        monkeypatch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", of_the_user)
    (first, *_) = actions_of(launch)
    assert type(first).__name__ == "SetEnvironmentVariable"
    name, file = first.arguments
    assert name == "FASTRTPS_DEFAULT_PROFILES_FILE"
    assert file == of_the_user or (not of_the_user and "<segment_size>" in Path(file).read_text())


def test_rviz_looks_at_the_graph_of_its_namespace(launch: SimpleNamespace) -> None:
    view = graph(launch, namespace="left", rviz="true")["rviz2"]
    displays = yaml.safe_load(Path(view.named["arguments"][1]).read_text())
    shown = {
        d["Topic"]["Value"] for d in displays["Visualization Manager"]["Displays"] if "Topic" in d
    }
    moved = dict(view.named["remappings"])
    assert shown | {"/tf", "/tf_static"} == set(moved)
    assert not any(topic.startswith("/") for topic in moved.values())
